"""A PLY or an STL file of a zip as a scene: it is grey, or shows the image that the PLY file names."""

from __future__ import annotations

import posixpath
import re
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.formats import KINDS, decoded, sniff
from service.formats.read.archive import Archive
from service.formats.read.ply import HEADER_BYTES, read_ply
from service.formats.read.raw_mesh import RawMesh, check_raw_mesh
from service.formats.read.scenes.framing import framed
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.plain_mesh import GREY, NAME
from service.formats.read.scenes.ply_writer import ply
from service.formats.read.scenes.rays import Placed
from service.formats.read.scenes.room import stand_inside
from service.formats.read.scenes.warnings import Warnings
from service.formats.read.stl import read_stl
from service.formats.types import AssetLimits, SceneFile

# What MeshLab writes; the name may hold blanks.
TEXTURE = re.compile(rb"^comment[ \t]+TextureFile[ \t]+([^\r\n]+)", re.IGNORECASE | re.MULTILINE)
END = b"end_header"


def read_zipped_mesh(archive: Archive, path: str, format: str, limits: AssetLimits) -> RawMesh:
    """The triangles of the PLY or STL file at this path of a zip. Raises ParseError."""
    data = memoryview(archive.read(path))
    try:
        return read_ply(data) if format == "ply" else read_stl(data, limits)
    except ParseError as error:
        raise ParseError(error.detail, path[:100]) from None


def read_mesh_scene(archive: Archive, path: str, format: str, limits: AssetLimits) -> SceneFile:
    """The same as a scene. Raises ParseError."""
    mesh = read_zipped_mesh(archive, path, format, limits)
    try:
        check_raw_mesh(mesh, limits.max_triangles)
    except ParseError as error:
        raise ParseError(error.detail, path[:100]) from None
    notes, files = Warnings(), PartFiles()
    base = path.rpartition("/")[2]
    for warning in mesh.warnings:
        notes.add(base, warning)
    # A PLY file stays as it is; STL has a vertex for each corner, and facets.
    vertices, faces = np.asarray(mesh.vertices, np.float64), mesh.faces.astype(np.int32)
    data = archive.read(path) if format == "ply" else ply(vertices, faces, None, [], None)
    asset = files.add_mesh(data, path, vertices, len(mesh.faces))
    shape: dict[str, Any] = {"name": posixpath.splitext(base)[0], "type": "mesh", "asset": asset, "material": NAME}
    if format == "stl":
        shape["smooth"] = False
    used = vertices[np.unique(mesh.faces)]
    bounds = used.min(axis=0), used.max(axis=0)
    material, textures = dict(GREY), dict[str, Any]()
    if format == "ply" and (image := _image(archive, path, mesh, notes)) is not None:
        name = posixpath.splitext(posixpath.basename(image))[0]
        textures[name] = {"asset": files.add(archive.read(image), image)}
        material["albedo"] = {"texture": name}
    document: dict[str, Any] = {
        "version": 1, "camera": framed(bounds), "materials": {NAME: material}, "shapes": [shape],
    }  # fmt: skip
    if textures:
        document["textures"] = textures
    placed = [Placed(vertices, faces, np.eye(4), True, NAME)]
    if (remark := stand_inside(document, placed, bounds)) is not None:
        notes.add(base, remark)
    corners = [corner.tolist() for corner in bounds]
    return SceneFile(document, files.parts, notes.document(), len(mesh.faces), False, bounds=corners)


def textures_named(data: bytes) -> list[str]:
    """The images that the header of a PLY file names."""
    return [decoded(name).strip() for name in TEXTURE.findall(data[:HEADER_BYTES].partition(END)[0])]


def _image(archive: Archive, path: str, mesh: RawMesh, notes: Warnings) -> str | None:
    """The path of the image that a PLY file names; None, with a warning, where it cannot be shown."""
    named = textures_named(archive.head(path, HEADER_BYTES))
    base = path.rpartition("/")[2]
    found: str | None = None
    for name in named[:1]:
        found = archive.finder.located(path, name, place=base, notes=notes)
        if found is None:
            notes.add(base, f"the texture {name[:100]!r} is not there; the mesh is shown without it")
        elif KINDS.get(sniff(archive.read(found), filename=found) or "") != "image":
            notes.add(base, f"the texture {name[:100]!r} is not an image that is read; the mesh is shown without it")
            found = None
        elif mesh.uvs is None:
            notes.add(base, f"the mesh has no texture coordinates; it is shown without the texture {name[:100]!r}")
            found = None
    if named[1:]:
        notes.add(base, f"of {len(named)} textures only the first is shown")
    return found
