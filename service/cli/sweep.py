"""`sunbox sweep`: a scene with other values here and there, and a contact sheet of all of them."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from service.cli import BadInput, Failed, files
from service.cli.api import server_or_local

if TYPE_CHECKING:
    from sunbox import Batch

SHEETS = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg", ".webp": "webp"}


def run(arguments: argparse.Namespace) -> int:
    over = [axis(text) for text in arguments.over]
    path = Path(arguments.output)
    format = ending(path, SHEETS | {".zip": "zip"})
    output = files.writable(path)
    if format == "zip":
        batch_file(arguments, over, output, lambda batch: batch.zip(exposure=arguments.exposure))
    else:
        batch_file(
            arguments, over, output, lambda batch: batch.sheet(format, arguments.width, exposure=arguments.exposure)
        )
    return 0


def axis(text: str) -> dict[str, Any]:
    """`/path=a,b,c`: the values in JSON, or bare words. Raises BadInput."""
    path, equals, values = text.partition("=")
    if not equals or not path.startswith("/") or not values:
        raise BadInput(f"--over {text!r}: write it as /materials/NAME/roughness=0.1,0.3")
    return {"path": path, "values": _values(values)}


def _values(text: str) -> list[Any]:
    try:
        return list(json.loads(f"[{text}]"))
    except ValueError:
        return [_value(each) for each in text.split(",")]


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text.strip()


def ending(path: Path, formats: dict[str, str]) -> str:
    """The format of an ending. Raises BadInput."""
    found = formats.get(path.suffix.lower())
    if found is None:
        raise BadInput(f"-o {str(path)!r}: must end in one of {', '.join(formats)}")
    return found


def batch_file(
    arguments: argparse.Namespace, over: list[dict[str, Any]], output: Path, made: Callable[[Batch], bytes]
) -> None:
    """Render the batch and write the file that is `made` of it."""
    from service.cli import configuration
    from service.cli.documents import read_settings, read_source, with_uploads

    config = configuration()
    source = read_source(Path(arguments.input), arguments.asset_root, config, arguments.entry)
    settings = read_settings(arguments.set or [], config, source.settings).model_dump(mode="json", exclude_unset=True)
    with server_or_local(arguments.server) as client:
        scene = with_uploads(client, source, arguments.asset_root)
        with typed(arguments, over):
            batch = client.batch(scene, over, **settings)
        try:
            status = batch.wait()
            _refuse_failures(batch, status)
            files.write(output, made(batch))
        finally:
            if arguments.server is not None:
                batch.delete()


@contextmanager
def typed(arguments: argparse.Namespace, over: list[dict[str, Any]]) -> Iterator[None]:
    """A context that names what was typed in place of the request's members: `--over /path`, `--frames`, `--set`."""
    from sunbox import Refused

    def place(pointer: str) -> str:
        first, _, rest = pointer.removeprefix("/").partition("/")
        if first == "over" and rest:
            number, _, member = rest.partition("/")
            axis = over[int(number)]
            if "path" not in axis:
                return {"turntable": "--frames", "degrees": "--degrees"}.get(member, "--frames")
            _, _, index = member.partition("/")
            value = (
                f"={json.dumps(axis['values'][int(index.partition('/')[0])])}" if member.startswith("values/") else ""
            )
            return f"--over {axis['path']}{value}"
        if first == "settings" and rest:
            return f"--set {rest}"
        return f"{arguments.input}: /{rest}" if first == "scene" else "--over" if first == "over" else pointer or "/"

    try:
        yield
    except Refused as error:
        if not error.errors:
            raise
        raise BadInput(*(f"{place(pointer)}: {detail}" for pointer, detail in error.errors)) from None


def _refuse_failures(batch: Batch, status: dict[str, Any]) -> None:
    failed = [place for place, each in enumerate(status["renders"]) if each["state"] == "failed"]
    if failed:
        try:
            batch.pictures(progress=False)
        except Exception as error:
            raise Failed(f"render {failed[0]} failed: {error}") from None
    if status["state"] != "done":
        raise Failed(f"the batch is {status['state']}")
