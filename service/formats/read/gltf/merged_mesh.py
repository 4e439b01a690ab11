"""All meshes of a file's scene as one, which `{type: "mesh", asset}` shows of a glTF file."""

from __future__ import annotations

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.archive import Archive
from service.formats.read.gltf.bad_rows import usable
from service.formats.read.gltf.beside import Beside
from service.formats.read.gltf.deform import Skin, morphed, weights
from service.formats.read.gltf.document import Array, GltfDocument
from service.formats.read.gltf.nodes import Nodes, instances
from service.formats.read.gltf.primitives import UV_SETS, Primitive, read_primitive
from service.formats.read.raw_mesh import RawMesh
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import AssetLimits, Indices


def read_merged(data: bytes | memoryview, limits: AssetLimits) -> RawMesh:
    """The merged mesh of a glTF file. Raises ParseError."""
    return _merged(GltfDocument(data, limits), Warnings(), limits)


def read_zipped_merged(archive: Archive, path: str, limits: AssetLimits) -> RawMesh:
    """The merged mesh of the glTF file at this path of a zip. Raises ParseError."""
    notes = Warnings()
    return _merged(GltfDocument(archive.read(path), limits, Beside(archive, path, notes)), notes, limits)


def _merged(file: GltfDocument, notes: Warnings, limits: AssetLimits) -> RawMesh:
    nodes, read, parts, triangles = Nodes(file, notes), dict[str, Primitive | None](), list[Primitive](), 0
    for node in nodes.shown:
        if "mesh" not in node.place:
            continue
        mesh = file.follow(node.place, "mesh", "meshes")
        morph = weights(node.place, mesh)
        skin = Skin(file, file.follow(node.place, "skin", "skins"), nodes) if "skin" in node.place else None
        for place in mesh.objects("primitives"):
            if place.pointer not in read:
                read[place.pointer] = read_primitive(file, place, notes)
            primitive = read[place.pointer]
            if primitive is None:
                continue
            primitive = usable(morphed(file, primitive, place, morph) if morph else primitive, place, notes)
            if primitive is None:
                continue
            for world in [np.eye(4)] if skin else instances(file, node):
                triangles += len(primitive.faces)
                if triangles > limits.max_triangles:  # before the memory is taken: one mesh may stand in many nodes
                    raise ParseError(f"the scene has more than the {limits.max_triangles} triangles allowed")
                parts.append(skin.posed(primitive, place) if skin else primitive.moved(world))
    if not parts:
        raise notes.nothing_left()
    return _joined(parts, [f"{note['pointer']}: {note['detail']}" for note in notes.document()])


def _joined(parts: list[Primitive], warnings: list[str]) -> RawMesh:
    first = np.cumsum([0, *(len(p.vertices) for p in parts)])
    uvs = [_rows([p.uvs[k] for p in parts], parts, 2) for k in range(UV_SETS)]
    for rows in uvs:
        if rows is not None:
            rows[:, 1] = 1 - rows[:, 1]  # glTF's v points down
    faces = np.concatenate([p.faces + np.int64(at) for p, at in zip(parts, first, strict=False)])
    normals = _rows([p.normals for p in parts], parts, 3)
    return RawMesh(
        np.concatenate([p.vertices for p in parts]),
        faces,
        normals,
        uvs[0],
        uvs[1],
        _rows([None if p.colors is None else p.colors[:, :3] for p in parts], parts, 3, 1.0),
        warnings,
        _rows([p.tangents for p in parts], parts, 4),
        None if normals is not None else _groups(parts),
    )


def _groups(parts: list[Primitive]) -> Indices:
    """The smoothing group of each triangle: 0 for facets, which the specification demands without normals."""
    return np.concatenate([
        np.full(len(part.faces), k if part.is_smooth else 0, np.int32) for k, part in enumerate(parts, 1)
    ])  # fmt: skip


def _rows(columns: list[Array | None], parts: list[Primitive], width: int, missing: float = 0.0) -> Array | None:
    """The parts' rows as one array; None where no part has any. A part without gets `missing`: normals and tangents
    of zero are computed later."""
    if all(column is None for column in columns):
        return None
    return np.concatenate([
        np.full((len(p.vertices), width), missing, np.float32) if column is None else column
        for column, p in zip(columns, parts, strict=True)
    ])  # fmt: skip
