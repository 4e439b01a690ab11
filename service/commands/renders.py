"""`sunbox renders`: the renders of a server, submitted, listed, shown, waited for, fetched, cancelled and deleted.

Only `submit` reads files; the server checks the rest and says what is wrong.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from service.commands import BadInput, Failed, files
from service.commands.api import Api
from service.views import LOSSLESS_FORMATS

AGAIN_S = 2.0  # between two attempts to hear of a render whose server was restarted
PATIENCE_S = 60.0  # for a server that is away
PAGE = 200
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
    return actions[arguments.action](Api(arguments.server), arguments)


def _submit(api: Api, arguments: argparse.Namespace) -> int:
    """The id goes to stdout."""
    from service.assets import FileAssets
    from service.commands.configuration import configuration
    from service.commands.documents import asset_folders, read_settings, read_source, refusals
    from service.commands.models import is_model
    from service.scene import references

    path, config = Path(arguments.input), configuration()
    if is_model(path, files.read(path)):
        raise BadInput(f"{path}: is a model; `sunbox import` makes a scene of it")
    source = read_source(path, arguments.asset_root, config)
    chosen = read_settings(arguments.set or [], config, source.settings)
    settings = chosen.model_dump(mode="json", exclude_unset=True)
    with refusals(), FileAssets(path.parent, asset_folders(arguments.asset_root)) as found:
        uploaded: dict[str, str] = {}
        for ref in references.references(source.document):
            if not ref.startswith("sha256:"):
                uploaded[ref] = api.upload(found.read(ref), Path(ref).name)
    scene = references.renamed(source.document, lambda ref: uploaded.get(ref, ref))
    asked = {"scene": scene, "settings": settings, "label": arguments.label, "priority": arguments.priority}
    body = {name: value for name, value in asked.items() if value is not None}
    key = {} if arguments.idempotency_key is None else {"idempotency-key": arguments.idempotency_key}
    print(api.json("POST", "/v1/renders", body, key)["id"])
    return 0


def _list(api: Api, arguments: argparse.Namespace) -> int:
    """The newest come first."""
    left, after = arguments.limit, None
    while left > 0:
        page, more = api.page(
            "/v1/renders", label=arguments.label, state=arguments.state, limit=min(left, PAGE), after=after
        )
        if after is None:
            print(COLUMNS.format("ID", "STATE", "SAMPLES", "SECONDS", "PRIO", "LABEL"))
        for each in page:
            figures = each["samples"], f"{each['elapsed_s']:.1f}", each["priority"]
            print(COLUMNS.format(each["id"], each["state"], *figures, each["label"] or "").rstrip())
        if not more:
            break
        left, after = left - len(page), page[-1]["id"]
    return 0


def _show(api: Api, arguments: argparse.Namespace) -> int:
    print(json.dumps(api.json("GET", _path(arguments.id)), indent=1))
    return 0


def _wait(api: Api, arguments: argparse.Namespace) -> int:
    """The state at the end goes to stdout. Exit code 1 where the render failed or was cancelled."""
    status = _watched(api, arguments.id)
    print(status["state"])
    if "problem" in status:
        raise Failed(f"{status['problem']['title']}: {status['problem']['detail']}")
    return 0 if status["state"] == "done" else 1


def _watched(api: Api, id: str) -> dict[str, Any]:
    """The status at the render's end. A server that is restarted meanwhile is asked again."""
    from service.commands.progress import ProgressLine
    from service.ipc.messages import Progress

    line, heard_at = ProgressLine(), time.monotonic()
    try:
        while True:
            try:
                for name, status in api.events(f"{_path(id)}/events"):
                    heard_at = time.monotonic()
                    if name == "done":
                        return dict(status)
                    if line.due():
                        line.show(Progress(status["samples"], status["noise"], status["elapsed_s"], status["eta_s"]))
            except Failed:
                if time.monotonic() - heard_at > PATIENCE_S:
                    raise
            time.sleep(AGAIN_S)
    finally:
        line.close()


def _fetch(api: Api, arguments: argparse.Namespace) -> int:
    """The image so far."""
    path = Path(arguments.output)
    format = next((name for name in LOSSLESS_FORMATS if path.suffix.lower() == "." + name), None)
    if format is None:
        raise BadInput(f"-o {arguments.output!r}: must end in one of {', '.join('.' + f for f in LOSSLESS_FORMATS)}")
    output = files.writable(path)
    asked = {"aov": arguments.aov, "exposure": arguments.exposure, "tone_map": arguments.tone_map}
    query = {"format": format} | {name: value for name, value in asked.items() if value is not None}
    with api.open("GET", f"{_path(arguments.id)}/image?{urlencode(query)}") as answer:
        files.write(output, answer.read())
    return 0


def _cancel(api: Api, arguments: argparse.Namespace) -> int:
    """Of one that has ended DELETE would delete the picture."""
    if (state := api.json("GET", _path(arguments.id))["state"]) in ENDED:
        print(f"it is {state} already; `sunbox renders delete` deletes it", file=sys.stderr)
        return 0
    api.json("DELETE", _path(arguments.id))
    print("cancelled", file=sys.stderr)
    return 0


def _delete(api: Api, arguments: argparse.Namespace) -> int:
    if api.json("GET", _path(arguments.id))["state"] not in ENDED:
        api.json("DELETE", _path(arguments.id))
    api.json("DELETE", _path(arguments.id))
    print("deleted", file=sys.stderr)
    return 0


def _path(id: str) -> str:
    return f"/v1/renders/{quote(id, safe='')}"
