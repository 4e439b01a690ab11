"""`sunbox serve`: the editor and the API, until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse
import logging
import os
from pathlib import Path

from service.cli import configuration

CLOSED = (
    "SUNBOX_DATA_DIR cannot be used by user {user}: user {owner} owns {folder} and keeps others from reading or "
    "writing it. Uploads and saved documents will be refused."
)

log = logging.getLogger(__name__)


def run(arguments: argparse.Namespace) -> int:
    config = configuration(host=arguments.host, port=arguments.port)
    from service.server import launch
    from service.system import logs

    secrets = [*config.api_key, *config.callback_secret]
    logs.configure(config.log_format, config.log_level, queued=True, secrets=secrets)
    if (closed := _closed(config.data_dir)) is not None:
        log.warning(CLOSED.format(user=os.geteuid(), owner=closed.stat().st_uid, folder=closed))

    return launch.run(config)


def _closed(folder: Path) -> Path | None:
    """The first path that prevents storing data: another user's, mostly root's, or one without permission."""
    for wanted in (folder, folder / "assets", folder / "documents.sqlite3"):
        path = wanted.absolute()
        while not os.path.exists(path):  # it will be made in its parent
            path = path.parent
        if not os.access(path, os.R_OK | os.W_OK | (os.X_OK if path.is_dir() else 0)):
            return path
    return None
