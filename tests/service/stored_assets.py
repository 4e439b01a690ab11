"""Assets as a store has them on the disk, and scenes that refer to them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from service.server.storage.stores import Storage
from service.system.disk_usage import BLOCK
from tests.serving import SCENE

ASSET = 2 * BLOCK  # bytes that a small asset takes on the disk: its own and its record's block


def file(folder: Path, id: str, suffix: str = "") -> Path:
    return folder / "assets" / (id.removeprefix("sha256:") + suffix)


def mesh_scene(*assets: str) -> dict[str, Any]:
    return {**SCENE, "shapes": [{"type": "mesh", "asset": asset, "material": "ball"} for asset in assets]}


def here(kept: Storage, ids: list[str]) -> list[bool]:
    return [kept.assets.holds(id) for id in ids]
