"""A zip as what is in it: an OBJ with its materials, or images that make materials. Runs in the parsing process."""

from __future__ import annotations

from service.assets.obj.archive import Archive
from service.assets.obj.importer import read_obj_scene
from service.assets.texture_sets.importer import read_texture_sets
from service.assets.types import AssetLimits, SceneFile


def parse_zip(data: memoryview, limits: AssetLimits) -> SceneFile:
    """Raises ParseError."""
    archive = Archive(data, limits.max_file)
    if any(name.lower().endswith(".obj") for name in archive.names):
        return read_obj_scene(data, limits)
    return read_texture_sets(archive, limits)
