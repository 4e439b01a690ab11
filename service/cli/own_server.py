"""A server of this machine's own, for as long as a command needs one."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import Failed
from service.cli.api import server

if TYPE_CHECKING:
    from sunbox import Client

ENDS_S = 20.0  # for a server that ends
# Serves until the process of this id ends, however it ends.
PROGRAM = """
import sys
from service.cli.program import main
from service.system.lifeline import end_with
if end_with(int(sys.argv[1])):
    sys.exit(main(["serve", "--host", "127.0.0.1", "--port", "0"]))
"""


@contextmanager
def server_or_own(url: str | None) -> Iterator[Client]:
    """The server at an address, or without one a server that renders here and stores nothing. Raises as `server`."""
    if url is not None:
        with server(url) as client:
            yield client
        return
    with tempfile.TemporaryDirectory(prefix="sunbox-") as folder, _own(Path(folder)) as own, server(own) as client:
        yield client


@contextmanager
def _own(folder: Path) -> Iterator[str]:
    """The address of a server whose data lie in a folder. Ctrl-C is for this process, which ends the server then."""
    environment = {**os.environ, "SUNBOX_DATA_DIR": str(folder / "data"), "SUNBOX_HOST": "127.0.0.1"}
    command = [sys.executable, "-P", "-c", PROGRAM, str(os.getpid())]
    with (folder / "log").open("w+") as said_there:
        process = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=said_there, text=True, start_new_session=True
        )
        try:
            assert process.stdout is not None
            said = process.stdout.readline()
            if "http://" not in said:
                said_there.seek(0)
                raise Failed("no server could be started here", *said_there.read().splitlines()[-3:])
            yield said[said.index("http://") :].strip().rstrip("/")
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(ENDS_S)
            process.kill()
