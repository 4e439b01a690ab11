"""An OBJ or a PLY file in a zip, its material libraries and textures as a document with meshes and images as parts.

Each material's triangles become a mesh of their own. Coordinates stay as they are, and nothing else is merged or
reordered.
"""

from __future__ import annotations

import posixpath
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.formats import text
from service.formats.read.archive import Archive
from service.formats.read.bad_elements import mend
from service.formats.read.obj.libraries import named_libraries
from service.formats.read.obj.materials import Materials
from service.formats.read.obj.mtl import Map, MtlMaterial, read_mtl
from service.formats.read.obj.textures import Textures
from service.formats.read.obj_lines import Named
from service.formats.read.obj_mesh import MaterialMesh, read_obj_with_materials
from service.formats.read.ply import read_textured_ply
from service.formats.read.polygons import Longs
from service.formats.read.raw_mesh import RawMesh
from service.formats.read.scenes.framing import framed
from service.formats.read.scenes.part_files import PartFiles
from service.formats.read.scenes.ply_writer import ply
from service.formats.read.scenes.rays import Placed
from service.formats.read.scenes.room import stand_inside
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import AssetLimits, SceneFile

OBJ, PLY = ".obj", ".ply"
MOST_MATERIALS = 10_000  # materials that faces use
MOST_LIBRARIES = 1_000


def read_obj_scene(archive: Archive, path: str, limits: AssetLimits) -> SceneFile:
    """The scene of the OBJ file at this path of a zip. Raises ParseError."""
    notes = Warnings()
    read = read_obj_with_materials(text(archive.read(path)))
    library = _library(path, read.libraries, archive, notes)
    return _scene(path, read, library, archive, notes, limits)


def read_ply_scene(archive: Archive, path: str, limits: AssetLimits) -> SceneFile:
    """The scene of the PLY file at this path of a zip, whose comments name its textures. Raises ParseError."""
    found = read_textured_ply(memoryview(archive.read(path)), path)
    place = path.rpartition("/")[2]
    numbers: dict[str, int] = {"": 0}  # of the materials: one for each texture, called by its name
    of_texture = [numbers.setdefault(name, len(numbers)) for name in found.textures]
    maps = {name: {"map_kd": Map(place, path, name)} for name in numbers if name}
    library = {name: MtlMaterial(name, place, maps=each, places={"map_kd": place}) for name, each in maps.items()}
    of_triangle = np.array([*of_texture, 0], np.int32)[found.of_triangle]  # -1, none, is the last
    return _scene(
        path, MaterialMesh(found.mesh, list(numbers), of_triangle, []), library, archive, Warnings(), limits
    )


def _scene(
    path: str,
    read: MaterialMesh,
    library: dict[str, MtlMaterial],
    archive: Archive,
    notes: Warnings,
    limits: AssetLimits,
) -> SceneFile:
    mesh = read.mesh
    mend(mesh, limits.max_triangles)
    files = PartFiles()
    name = path.rpartition("/")[2]
    for warning in mesh.warnings:
        notes.add(name, warning)
    textures = Textures(archive, files, notes, limits)
    used = mesh.vertices[np.unique(mesh.faces)]
    bounds = used.min(axis=0), used.max(axis=0)
    materials = Materials(library, textures, mesh.uvs is not None, float(np.ptp(bounds, axis=0).max()), notes)
    shapes = [
        _keep(files, mesh, which, worn or name) | {"material": materials.add(worn, name)}
        for worn, which in _by_material(read)
    ]
    group = posixpath.splitext(name)[0]
    shapes = [{"name": f"{group}/{shape['material']}" if len(shapes) > 1 else group} | shape for shape in shapes]
    document = {"version": 1, "camera": framed(bounds), "materials": materials.documents, "shapes": shapes}
    if textures.documents:
        document["textures"] = textures.documents
    whole = np.asarray(mesh.vertices, np.float64)
    parts = [
        Placed(whole, mesh.faces[which].astype(np.int32), np.eye(4), True, shape["material"])
        for (_, which), shape in zip(_by_material(read), shapes, strict=True)
    ]
    if (remark := stand_inside(document, parts, bounds)) is not None:
        notes.add(name, remark)
    corners = [corner.tolist() for corner in bounds]
    return SceneFile(document, files.parts, notes.document(), len(mesh.faces), False, bounds=corners)


def _library(model: str, statements: list[Named], archive: Archive, notes: Warnings) -> dict[str, MtlMaterial]:
    """The materials of all libraries that the zip contains; the first of several with the same name."""
    if len(statements) > MOST_LIBRARIES:
        raise ParseError(f"it names {len(statements)} material libraries; {MOST_LIBRARIES} are allowed")
    found: dict[str, MtlMaterial] = {}
    read: set[str] = set()
    for statement in statements:
        place = f"{model.rpartition('/')[2]}:{statement.line}"
        for name, file in named_libraries(model, statement.name, archive.finder):
            path = name if file is None else file.path
            if path in read:
                continue
            read.add(path)
            if file is None or path == model:
                notes.add(place, f"the material library {name[:100]!r} is not there; its materials are shown grey")
                continue
            if file.remark:
                notes.add(place, f"the material library {file.remark}")
            found = read_mtl(path, archive.read(path), notes) | found
    maps = (each for material in found.values() for each in material.maps.values())
    readings = (one for each in maps for one in (each, *each.others) if one.reference)
    images = (archive.finder.find(one.source, one.reference) for one in readings)
    archive.used |= {image.path for image in images if image is not None}  # shown or not, they belong to the model
    return found


def _by_material(read: MaterialMesh) -> list[tuple[str, Longs]]:
    """The materials that triangles use, in the order in which the file first uses them, and the numbers of those
    triangles."""
    counts = np.bincount(read.of_triangle, minlength=len(read.materials))
    if np.count_nonzero(counts) > MOST_MATERIALS:
        raise ParseError(f"its faces wear {np.count_nonzero(counts)} materials; {MOST_MATERIALS} are allowed")
    order = np.argsort(read.of_triangle, kind="stable")
    ends = np.cumsum(counts)
    return [(read.materials[k], order[ends[k] - counts[k] : ends[k]]) for k in np.flatnonzero(counts)]


def _keep(files: PartFiles, mesh: RawMesh, which: Longs, pointer: str) -> dict[str, Any]:
    """The shape, without its material, of these triangles with the vertices that they use: a mesh of their own."""
    used, corners = np.unique(mesh.faces[which], return_inverse=True)
    normals, uvs, colors = (None if rows is None else rows[used] for rows in (mesh.normals, mesh.uvs, mesh.colors))
    if normals is not None and not normals.any():
        normals = None
    if colors is not None:
        colors = np.clip(colors, 0, 1)
    triangles = corners.reshape(-1, 3).astype(np.int32)
    groups = None if mesh.groups is None or normals is not None else mesh.groups[which]
    is_flat = groups is not None and not groups.any()
    if groups is not None and groups.min() == groups.max():
        groups = None
    data = ply(mesh.vertices[used], triangles, normals, [uvs], colors, groups=groups)
    shape = {"type": "mesh", "asset": files.add_mesh(data, pointer, mesh.vertices[used], len(triangles))}
    return shape | ({"smooth": False} if is_flat else {})
