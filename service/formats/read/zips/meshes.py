"""An STL file of a zip as a scene, and the triangles of a PLY or an STL file there."""

from __future__ import annotations

import posixpath
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.archive import Archive
from service.formats.read.bad_elements import mend
from service.formats.read.ply import read_ply
from service.formats.read.raw_mesh import RawMesh
from service.formats.read.scenes.framing import framed
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.plain_mesh import GREY, NAME
from service.formats.read.scenes.ply_writer import ply
from service.formats.read.scenes.rays import Placed
from service.formats.read.scenes.room import stand_inside
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.stl import read_stl
from service.formats.types import AssetLimits, SceneFile


def read_zipped_mesh(archive: Archive, path: str, format: str, limits: AssetLimits) -> RawMesh:
    """The triangles of the PLY or STL file at this path of a zip. Raises ParseError."""
    data = memoryview(archive.read(path))
    try:
        return read_ply(data) if format == "ply" else read_stl(data, limits)
    except ParseError as error:
        raise ParseError(error.detail, path[:100]) from None


def read_stl_scene(archive: Archive, path: str, limits: AssetLimits) -> SceneFile:
    """The scene of the STL file at this path of a zip: grey, or with the colours of its facets. Raises ParseError."""
    mesh = read_zipped_mesh(archive, path, "stl", limits)
    try:
        mend(mesh, limits.max_triangles)
    except ParseError as error:
        raise ParseError(error.detail, path[:100]) from None
    notes, files = Warnings(), PartFiles()
    base = path.rpartition("/")[2]
    for warning in mesh.warnings:
        notes.add(base, warning)
    vertices, faces = np.asarray(mesh.vertices, np.float64), mesh.faces.astype(np.int32)
    asset = files.add_mesh(ply(vertices, faces, colors=mesh.colors), path, vertices, len(faces))
    # STL has a vertex for each corner, and facets.
    shape: dict[str, Any] = {"name": posixpath.splitext(base)[0], "type": "mesh", "asset": asset, "material": NAME}
    shape["smooth"] = False
    used = vertices[np.unique(faces)]
    bounds = used.min(axis=0), used.max(axis=0)
    document: dict[str, Any] = {
        "version": 1, "camera": framed(bounds), "materials": {NAME: dict(GREY)}, "shapes": [shape],
    }  # fmt: skip
    placed = [Placed(vertices, faces, np.eye(4), True, NAME)]
    if (remark := stand_inside(document, placed, bounds)) is not None:
        notes.add(base, remark)
    corners = [corner.tolist() for corner in bounds]
    return SceneFile(document, files.parts, notes.document(), len(faces), False, bounds=corners)
