"""`sunbox renders`: the renders of a server, submitted, listed, shown, waited for, fetched, cancelled and deleted.

Only `submit` reads files; the server checks the rest and says what is wrong.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli import BadInput, Failed, files
from service.cli.api import server

if TYPE_CHECKING:
    from sunbox import Client

ENDED = ("done", "cancelled", "failed")
COLUMNS = "{:<32}  {:<9}  {:>8}  {:>7}  {:>4}  {}"


def run(arguments: argparse.Namespace) -> int:
    actions = {
        "submit": _submit,
        "list": _list,
        "show": _show,
        "wait": _wait,
        "fetch": _fetch,
        "cancel": _cancel,
        "delete": _delete,
    }
    with server(arguments.server) as client:
        return actions[arguments.action](client, arguments)


def _submit(client: Client, arguments: argparse.Namespace) -> int:
    """The id goes to stdout."""
    from service.cli import configuration
    from service.cli.documents import read_settings, read_source, with_uploads
    from service.cli.models import is_model

    path, config = Path(arguments.input), configuration()
    if is_model(path, files.read(path)):
        raise BadInput(f"{path}: is a model; `sunbox import` makes a scene of it")
    source = read_source(path, arguments.asset_root, config)
    chosen = read_settings(arguments.set or [], config, source.settings)
    settings = chosen.model_dump(mode="json", exclude_unset=True)
    scene = with_uploads(client, source, arguments.asset_root)
    key, callback = arguments.idempotency_key, arguments.callback
    job = client.submit(scene, arguments.label, arguments.priority or 0, key, callback, **settings)
    print(job.id)
    return 0


def _list(client: Client, arguments: argparse.Namespace) -> int:
    """The newest come first."""
    statuses = client.statuses(arguments.label, arguments.state, arguments.limit)
    first = next(statuses, None)
    print(COLUMNS.format("ID", "STATE", "SAMPLES", "SECONDS", "PRIO", "LABEL"))
    for each in () if first is None else (first, *statuses):
        figures = each["samples"], f"{each['elapsed_s']:.1f}", each["priority"]
        print(COLUMNS.format(each["id"], each["state"], *figures, each["label"] or "").rstrip())
    return 0


def _show(client: Client, arguments: argparse.Namespace) -> int:
    print(json.dumps(client.job(arguments.id).status(), indent=1))
    return 0


def _wait(client: Client, arguments: argparse.Namespace) -> int:
    """The state at the end goes to stdout. Exit code 1 where the render failed or was cancelled."""
    status = _followed(client, arguments.id)
    print(status["state"])
    if "problem" in status:
        raise Failed(f"{status['problem']['title']}: {status['problem']['detail']}")
    return 0 if status["state"] == "done" else 1


def _followed(client: Client, id: str) -> dict[str, Any]:
    """The status at the render's end."""
    from service.cli.progress import ProgressLine
    from service.ipc.messages import Progress

    line, status = ProgressLine(), {}
    try:
        for status in client.job(id).events():
            if line.due() and status["state"] not in ENDED:
                line.show(Progress(status["samples"], status["noise"], status["elapsed_s"], status["eta_s"]))
    finally:
        line.close()
    return status


def _fetch(client: Client, arguments: argparse.Namespace) -> int:
    """The image so far."""
    path = Path(arguments.output)
    format = files.picture_format(arguments.output)
    output = files.writable(path)
    asked = {"aov": arguments.aov, "exposure": arguments.exposure, "tone_map": arguments.tone_map}
    asked |= {"color_space": arguments.color_space, "lut": arguments.lut}
    asked["cryptomatte"] = "true" if arguments.cryptomatte else None
    view = {name: value for name, value in asked.items() if value is not None}
    files.write(output, client.job(arguments.id).picture().fetch(format, **view))
    return 0


def _cancel(client: Client, arguments: argparse.Namespace) -> int:
    """Cancel a render, unless it has ended: DELETE would delete its picture."""
    job = client.job(arguments.id)
    if (state := job.status()["state"]) in ENDED:
        print(f"it is {state} already; `sunbox renders delete` deletes it", file=sys.stderr)
        return 0
    job.cancel()
    print("cancelled", file=sys.stderr)
    return 0


def _delete(client: Client, arguments: argparse.Namespace) -> int:
    client.job(arguments.id).delete()
    print("deleted", file=sys.stderr)
    return 0
