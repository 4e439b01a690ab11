"""A zip as what is in it: an OBJ with its materials, MaterialX with its images, or images that make materials by
their names. Runs in the parsing process."""

from __future__ import annotations

from service.formats.errors import MissingExtra, ParseError
from service.formats.read.materialx.importer import ALONE, SUFFIX, read_materialx
from service.formats.read.obj.archive import Archive
from service.formats.read.obj.importer import read_obj_scene
from service.formats.read.texture_sets.importer import read_texture_sets
from service.formats.types import AssetLimits, SceneFile


def parse_zip(data: memoryview, limits: AssetLimits) -> SceneFile:
    """Raises ParseError."""
    archive = Archive(data, limits.max_file)
    if any(name.lower().endswith(".obj") for name in archive.names):
        return read_obj_scene(data, limits)
    if any(name.lower().endswith(SUFFIX) for name in archive.names):
        try:
            return read_materialx(archive.names, archive.read, limits)
        except MissingExtra as missing:
            try:
                return read_texture_sets(archive, limits)  # its names may say as much
            except ParseError:
                raise missing from None
    return read_texture_sets(archive, limits)


def parse_mtlx(data: memoryview, limits: AssetLimits) -> SceneFile:
    """A `.mtlx` file that came without images. Raises ParseError."""
    return read_materialx([ALONE], lambda name: bytes(data), limits)
