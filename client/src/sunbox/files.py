"""The files that a scene names, and the arrays in it."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from sunbox.errors import Refused

UPLOADED = "sha256:"
Scene = dict[str, Any]
Folders = str | os.PathLike[str] | Sequence[str | os.PathLike[str]]


def read_scene(scene: Any, pointer: str = "/scene") -> tuple[Scene, Path]:
    """A copy of the document that holds JSON's types alone, and the folder that its paths are relative to: of a dict
    the working directory, of a JSON file its own. `pointer`: where the document stands in the request. Raises
    TypeError, OSError, ValueError, Refused."""
    if isinstance(scene, dict):
        return plain(scene, pointer), Path()
    if isinstance(scene, str | os.PathLike):
        path = Path(scene)
        document = json.loads(path.read_text())
        if not isinstance(document, dict):
            raise ValueError(f"{path}: is not a scene's document, which is an object")
        return document, path.parent
    raise TypeError(f"a scene is a dict or a path to its JSON file, not {type(scene).__name__}")


def references(scene: Scene) -> dict[str, str]:
    """The paths in a scene: what its assets are called that are not on a server yet. Each with the JSON pointer of
    its first place."""
    found = dict[str, str]()
    for pointer, holder, name in _places(scene):
        if not holder[name].startswith(UPLOADED):
            found.setdefault(holder[name], pointer)
    return found


def allowed(name: str, folder: Path, roots: Sequence[str | os.PathLike[str]], pointer: str) -> Path:
    """The file that a document names, without links: it lies in the document's folder or below one of `roots`, from
    each of which a relative path may lead. Whoever wrote the document could otherwise have any file of this machine
    sent. Raises Refused."""
    bases = [Path(os.path.realpath(base)) for base in (folder, *roots)]
    candidates = [Path(os.path.realpath(base / name)) for base in bases]
    inside = [path for path in candidates if any(path.is_relative_to(base) for base in bases)]
    if not inside:
        detail = (
            f"{name!r} lies outside of the scene's folder {str(bases[0])!r}: Client(asset_root=...) allows another"
        )
        raise Refused(f"{pointer}: {detail}", errors=[(pointer, detail)])
    return next((path for path in inside if path.exists()), inside[0])


def with_ids(scene: Scene, ids: dict[str, str]) -> Scene:
    """A copy in which the paths are replaced by ids."""
    copy = plain(scene)
    for _, holder, name in _places(copy):
        holder[name] = ids.get(holder[name], holder[name])
    return copy


def plain(document: Scene, pointer: str = "") -> Scene:
    """A copy with lists for arrays. Raises as `text` does."""
    copy: Scene = json.loads(text(document, pointer))
    return copy


def text(document: Any, pointer: str = "") -> str:
    """JSON; numpy's arrays and numbers become lists and numbers, paths their text. `pointer`: where the document
    stands in the request. Raises Refused for NaN and infinity, TypeError for what JSON has no word for."""
    try:
        return json.dumps(document, default=_plain, allow_nan=False, separators=(",", ":"))
    except ValueError:
        value = json.loads(json.dumps(document, default=_plain))
        for place, number in _numbers(value, pointer):
            if not math.isfinite(number):
                detail = f"is {number}: it must be a finite number"
                raise Refused(f"{place}: {detail}", errors=[(place, detail)]) from None
        raise


def _numbers(value: Any, pointer: str) -> Iterator[tuple[str, float]]:
    members = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, child in members:
        yield from _numbers(child, f"{pointer}/{_step(name)}")
    if isinstance(value, float):
        yield pointer, value


def _step(name: object) -> str:
    """One step of a JSON pointer (RFC 6901)."""
    return str(name).replace("~", "~0").replace("/", "~1")


def _plain(value: Any) -> Any:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    to_list: Callable[[], Any] | None = getattr(value, "tolist", None)
    if to_list is None:
        raise TypeError(f"a document cannot hold a {type(value).__name__}")
    return to_list()


def _places(scene: Scene) -> Iterator[tuple[str, dict[str, str], str]]:
    """Where a scene names assets: the JSON pointer, the object and the member's name. What is no asset is the
    server's to refuse."""
    environment = scene.get("environment")
    holders = [("/environment", environment)]
    for kind in ("shapes", "textures", "materials"):
        holders += [(f"/{kind}/{_step(name)}", value) for name, value in _members(scene.get(kind))]
    for pointer, holder in holders:
        if isinstance(holder, dict) and isinstance(holder.get("asset"), str):
            yield f"{pointer}/asset", holder, "asset"
    faces = environment.get("assets") if isinstance(environment, dict) else None
    if isinstance(faces, dict):
        for name, value in faces.items():
            if isinstance(value, str):
                yield f"/environment/assets/{_step(name)}", faces, name


def _members(value: Any) -> list[tuple[object, Any]]:
    if isinstance(value, dict):
        return list(value.items())
    return list(enumerate(value)) if isinstance(value, list | tuple) else []
