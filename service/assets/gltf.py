"""The triangles of a glTF 2.0 file, GLB or JSON, its nodes' transforms applied. Runs in the parsing child.

Our own, and not trimesh's: that one gives an accessor the memory it asks for, reads sparse accessors as zeros and
normalised positions as integers, and skips fans. Skins and morph targets are left at rest.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from service.assets.data import AssetLimits, Doubles
from service.assets.errors import ParseError
from service.assets.gltf_file import GltfFile
from service.assets.polygons import Longs

POINTS_AND_LINES = (0, 1, 2, 3)
TRIANGLES, STRIP, FAN = 4, 5, 6


@dataclass(frozen=True)
class Primitive:
    vertices: Doubles
    faces: Longs
    normals: Doubles | None

    def moved(self, world: Doubles) -> "Primitive":
        """Under a 4x4 matrix. Outward stays outward: a mirroring one turns the triangles round."""
        linear = world[:3, :3]
        cofactors = np.stack([np.cross(linear[:, k - 2], linear[:, k - 1]) for k in range(3)], axis=1)
        sign = -1.0 if np.linalg.det(linear) < 0 else 1.0
        return Primitive(
            self.vertices @ linear.T + world[:3, 3],
            self.faces[:, ::-1] if sign < 0 else self.faces,
            None if self.normals is None else self.normals @ (sign * cofactors).T,
        )


def read_gltf(data: bytes, limits: AssetLimits) -> tuple[Doubles, Longs, Doubles | None]:
    """All meshes of the scene as one."""
    file = GltfFile(data, limits)
    meshes: dict[int, list[Primitive]] = {}
    parts: list[Primitive] = []
    triangles = 0
    for world, mesh in _nodes(file):
        if mesh not in meshes:
            listed = file.item("meshes", mesh).get("primitives", [])
            meshes[mesh] = [p for p in (_primitive(file, one) for one in listed) if p is not None]
        triangles += sum(len(p.faces) for p in meshes[mesh])
        if triangles > limits.max_triangles:  # before the memory is taken: one mesh may stand in many nodes
            raise ParseError(f"its nodes hold more than the {limits.max_triangles} triangles allowed")
        parts += [p.moved(world) for p in meshes[mesh]]
    if not parts:
        raise ParseError("its scene has no triangles")
    first = np.cumsum([0, *(len(p.vertices) for p in parts)])
    vertices = np.concatenate([p.vertices for p in parts])
    faces = np.concatenate([p.faces + at for p, at in zip(parts, first, strict=False)])
    if all(p.normals is None for p in parts):
        return vertices, faces, None
    # Zeros where a part has none: they are computed from its triangles.
    normals = [np.zeros_like(p.vertices) if p.normals is None else p.normals for p in parts]
    return vertices, faces, np.concatenate(normals)


def _nodes(file: GltfFile) -> list[tuple[Doubles, int]]:
    """World matrix and mesh index of every node in the scene that has a mesh."""
    nodes = file.tree.get("nodes", [])
    if file.tree.get("scenes"):
        roots = file.item("scenes", file.tree.get("scene", 0)).get("nodes", [])
    else:
        children = {child for node in nodes for child in node.get("children", [])}
        roots = [k for k in range(len(nodes)) if k not in children]
    found, seen = [], set()
    stack = [(np.eye(4), index) for index in reversed(roots)]
    while stack:
        parent, index = stack.pop()
        node = file.item("nodes", index)
        if index in seen:  # also every cycle
            raise ParseError(f"nodes[{index}] is reached twice; nodes must form a tree")
        seen.add(index)
        world = parent @ _matrix(node, index)
        if "mesh" in node:
            found.append((world, node["mesh"]))
        stack += [(world, child) for child in reversed(node.get("children", []))]
    return found


def _matrix(node: dict[str, Any], index: int) -> Doubles:
    """T R S, or the matrix given by columns."""
    matrix = np.eye(4)
    if "matrix" in node:
        matrix = _numbers(node["matrix"], 16, index).reshape(4, 4).T
    x, y, z, w = _numbers(node.get("rotation", (0, 0, 0, 1)), 4, index)
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    local = np.eye(4)
    local[:3, :3] = rotation * _numbers(node.get("scale", (1, 1, 1)), 3, index)
    local[:3, 3] = _numbers(node.get("translation", (0, 0, 0)), 3, index)
    return matrix @ local


def _numbers(values: Any, count: int, index: int) -> Doubles:
    try:
        numbers = np.array(values, np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise ParseError(f"the transform of nodes[{index}] needs {count} finite numbers: {str(values)[:60]}")
    return numbers


def _primitive(file: GltfFile, primitive: dict[str, Any]) -> Primitive | None:
    """None for points and lines."""
    mode, attributes = primitive.get("mode", TRIANGLES), primitive.get("attributes", {})
    if mode in POINTS_AND_LINES or "POSITION" not in attributes:
        return None
    draco = primitive.get("extensions", {}).get("KHR_draco_mesh_compression")
    if draco is not None:
        return _draco(file, draco)
    vertices = file.accessor(attributes["POSITION"], "VEC3").astype(np.float64)
    normals = None
    if "NORMAL" in attributes:
        normals = file.accessor(attributes["NORMAL"], "VEC3").astype(np.float64)
        if len(normals) != len(vertices):
            raise ParseError(f"{len(normals)} normals for {len(vertices)} vertices")
    if "indices" in primitive:
        indices = file.accessor(primitive["indices"], "SCALAR")[:, 0].astype(np.int64)
    else:
        indices = np.arange(len(vertices))
    return Primitive(vertices, _triangles(mode, indices, len(vertices)), normals)


def _triangles(mode: int, indices: Longs, vertices: int) -> Longs:
    if len(indices) and not 0 <= indices.min() <= indices.max() < vertices:
        raise ParseError(f"an index of {indices.max()} where there are {vertices} vertices")
    k = np.arange(max(len(indices) - 2, 0))
    if mode == STRIP:
        return indices[np.stack([k, k + 1 + k % 2, k + 2 - k % 2], axis=1)]
    if mode == FAN:
        return indices[np.stack([k + 1, k + 2, 0 * k], axis=1)]
    if mode != TRIANGLES or len(indices) % 3:
        raise ParseError(f"a primitive of mode {mode} with {len(indices)} indices is no list of triangles")
    return indices.reshape(-1, 3)


def _draco(file: GltfFile, extension: dict[str, Any]) -> Primitive:
    import DracoPy

    decoded = DracoPy.decode(file.view(extension["bufferView"]).tobytes())
    found: dict[int, npt.NDArray[Any]] = {one["unique_id"]: one["data"] for one in decoded.attributes}
    faces = getattr(decoded, "faces", None)
    ids = extension["attributes"]
    if faces is None or not len(faces) or ids["POSITION"] not in found:
        raise ParseError("its Draco data hold no triangles")
    vertices = np.asarray(found[ids["POSITION"]], np.float64).reshape(-1, 3)
    normals = found.get(ids.get("NORMAL", -1))
    return Primitive(
        vertices,
        _triangles(TRIANGLES, np.asarray(faces, np.int64).reshape(-1), len(vertices)),
        None if normals is None else np.asarray(normals, np.float64).reshape(-1, 3),
    )
