"""The files that a scene names, and the arrays in it."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

UPLOADED = "sha256:"
Scene = dict[str, Any]


def read_scene(scene: Any) -> tuple[Scene, Path]:
    """A copy of the document that holds JSON's types alone, and the folder that its paths are relative to: of a dict
    the working directory, of a JSON file its own. Raises TypeError, OSError, ValueError."""
    if isinstance(scene, dict):
        return plain(scene), Path()
    if isinstance(scene, str | os.PathLike):
        path = Path(scene)
        document = json.loads(path.read_text())
        if not isinstance(document, dict):
            raise ValueError(f"{path}: is not a scene's document, which is an object")
        return document, path.parent
    raise TypeError(f"a scene is a dict or a path to its JSON file, not {type(scene).__name__}")


def references(scene: Scene) -> set[str]:
    """The paths in a scene: what its assets are called that are not on a server yet."""
    return {value for holder, name in _places(scene) if not (value := holder[name]).startswith(UPLOADED)}


def with_ids(scene: Scene, ids: dict[str, str]) -> Scene:
    """A copy in which the paths are replaced by ids."""
    copy = plain(scene)
    for holder, name in _places(copy):
        holder[name] = ids.get(holder[name], holder[name])
    return copy


def plain(document: Scene) -> Scene:
    """A copy with lists for arrays. Raises ValueError for NaN, TypeError for what JSON has no word for."""
    copy: Scene = json.loads(text(document))
    return copy


def text(document: Any) -> str:
    """JSON; numpy's arrays and numbers become lists and numbers, paths their text. Raises ValueError for NaN."""
    return json.dumps(document, default=_plain, allow_nan=False, separators=(",", ":"))


def _plain(value: Any) -> Any:
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    to_list: Callable[[], Any] | None = getattr(value, "tolist", None)
    if to_list is None:
        raise TypeError(f"a document cannot hold a {type(value).__name__}")
    return to_list()


def _places(scene: Scene) -> Iterator[tuple[dict[str, str], str]]:
    """Where a scene names assets: the object and the member's name. What is no asset is the server's to refuse."""
    environment = scene.get("environment")
    holders = [
        environment,
        *_values(scene.get("shapes")),
        *_values(scene.get("textures")),
        *_values(scene.get("materials")),
    ]
    for holder in holders:
        if isinstance(holder, dict) and isinstance(holder.get("asset"), str):
            yield holder, "asset"
    faces = environment.get("assets") if isinstance(environment, dict) else None
    if isinstance(faces, dict):
        for name, value in faces.items():
            if isinstance(value, str):
                yield faces, name


def _values(members: Any) -> list[Any]:
    if isinstance(members, dict):
        return list(members.values())
    return list(members) if isinstance(members, list | tuple) else []
