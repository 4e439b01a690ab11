"""A saved material as the scene that writers of materials take."""

from __future__ import annotations

from typing import Any

from service.document import Scene, load_json, parse_scene
from service.problems import escaped

NOWHERE = {"position": [0, 0, 1], "target": [0, 0, 0]}


def material_scene(data: bytes, name: str) -> tuple[Scene, str]:
    """A scene without shapes whose only material it is, with its textures; and the pointer to what the document has
    of that scene. `data` is a bare material, which gets the name, or `{materials: {NAME: ...}, textures}`."""
    document: Any = load_json(data)
    is_bare = "type" in document
    parts = {"materials": {name: document}} if is_bare else document
    return parse_scene({"version": 1, "camera": NOWHERE, "shapes": [], **parts}), (
        f"/materials/{escaped(name)}" if is_bare else ""
    )
