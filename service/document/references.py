"""The assets that a scene's document, or a saved material's, refers to, valid or not."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from service.problems import escaped

Step = str | int


def places(scene: Any) -> Iterator[tuple[tuple[Step, ...], str]]:
    """The path of each reference to an asset in a document, which need not be valid, and the asset."""
    if not isinstance(scene, dict):
        return
    holders: list[tuple[tuple[Step, ...], Any]] = [(("environment",), scene.get("environment"))]
    for kind in ("textures", "shapes", "materials"):
        holders += [((kind, name), each) for name, each in _members(scene.get(kind))]
    if "type" in scene:  # a material by itself, as users save it
        holders.append(((), scene))
    for place, holder in holders:
        if not isinstance(holder, dict):
            continue
        if isinstance(ref := holder.get("asset"), str):
            yield (*place, "asset"), ref
        if isinstance(several := holder.get("assets"), dict):
            yield from (((*place, "assets", key), ref) for key, ref in several.items() if isinstance(ref, str))


def _members(value: Any) -> Iterable[tuple[Step, Any]]:
    """The members of an object or the entries of a list, whichever a document should have there."""
    return value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()


def pointed(scene: Any) -> list[tuple[str, str]]:
    """The JSON pointer of each reference in a document, and the asset."""
    return [("".join(f"/{escaped(step)}" for step in place), ref) for place, ref in places(scene)]


def references(scene: Any) -> list[str]:
    """Every asset that a document refers to, once, in order."""
    return list(dict.fromkeys(ref for _, ref in places(scene)))


def renamed(scene: Any, name: Callable[[str], str]) -> Any:
    """The document with other names for its assets; unchanged parts are shared with the given one."""
    if not isinstance(scene, dict):
        return scene
    copies: dict[tuple[Step, ...], Any] = {(): scene.copy()}
    for place, ref in places(scene):
        for depth in range(1, len(place)):
            holder, step = copies[place[: depth - 1]], place[depth - 1]
            if place[:depth] not in copies:
                copies[place[:depth]] = holder[step] = holder[step].copy()
        copies[place[:-1]][place[-1]] = name(ref)
    return copies[()]
