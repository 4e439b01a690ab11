"""The nodes of the scene that is shown, and where each stands in the world."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from service.assets.data import Doubles
from service.assets.errors import ParseError
from service.assets.gltf.accessors import read
from service.assets.gltf.file import GltfFile
from service.assets.gltf.place import Place, shown

MOST_INSTANCES = 100_000  # shapes in a document; beyond, the document itself is the burden


@dataclass(frozen=True)
class Node:
    place: Place
    index: int
    world: Doubles  # (4, 4)


class Nodes:
    def __init__(self, file: GltfFile) -> None:
        self._file = file
        self._all = file.root.array("nodes")
        self._parents: dict[int, int] | None = None

    @cached_property
    def shown(self) -> list[Node]:
        """Those of the default scene, or of the first; all, where the file has no scenes. Parents first."""
        found, seen = [], set()
        stack = [(np.eye(4), index, pointer) for index, pointer in reversed(self._roots())]
        while stack:
            parent, index, pointer = stack.pop()
            place = self._file.item("nodes", index, pointer)
            if index in seen:  # also every cycle
                raise ParseError(f"reaches /nodes/{index} a second time; nodes must form a tree", pointer)
            seen.add(index)
            hidden = place.extension("KHR_node_visibility")
            if hidden is not None and not hidden.flag("visible", True):
                continue  # with all below it
            world = parent @ local_matrix(place)
            found.append(Node(place, index, world))
            children = place.array("children")
            stack += [(world, children[k], f"{place.at('children')}/{k}") for k in reversed(range(len(children)))]
        return found

    @cached_property
    def worlds(self) -> dict[int, Doubles]:
        return {node.index: node.world for node in self.shown}

    def world(self, index: int, pointer: str) -> Doubles:
        """Also of a node outside the scene: a skeleton may stand there."""
        if index in self.worlds:
            return self.worlds[index]
        matrix, at, steps = np.eye(4), index, 0
        while True:
            matrix = local_matrix(self._file.item("nodes", at, pointer)) @ matrix
            parent = self.parents.get(at)
            steps += 1
            if parent is None:
                return matrix
            if steps > len(self._all):
                raise ParseError(f"/nodes/{index} is its own ancestor; nodes must form a tree", pointer)
            at = parent

    @cached_property
    def parents(self) -> dict[int, int]:
        found = {}
        for k in range(len(self._all)):
            place = Place(self._all[k], f"/nodes/{k}")
            found.update({child: k for child in place.array("children") if type(child) is int})
        return found

    def _roots(self) -> list[tuple[Any, str]]:
        file = self._file
        if not file.count("scenes"):
            return [(k, f"/nodes/{k}") for k in range(len(self._all)) if k not in self.parents]
        scene = file.item("scenes", file.root.value.get("scene", 0), "/scene")
        return [(one, f"{scene.at('nodes')}/{k}") for k, one in enumerate(scene.array("nodes"))]


def local_matrix(place: Place) -> Doubles:
    """(4, 4): the matrix, given by columns, or T R S."""
    if "matrix" in place:
        columns: Doubles = np.array(place.numbers("matrix", tuple(np.eye(4).reshape(-1)), 1e38))
        matrix: Doubles = np.ascontiguousarray(columns.reshape(4, 4).T)
        if tuple(matrix[3]) != (0, 0, 0, 1):
            raise place.error("matrix", f"must be affine: its last row is {shown(matrix[3].tolist())}")
        return matrix
    made: Doubles = trs(
        np.array([place.numbers("translation", (0.0, 0.0, 0.0))]),
        np.array([place.numbers("rotation", (0.0, 0.0, 0.0, 1.0))]),
        np.array([place.numbers("scale", (1.0, 1.0, 1.0))]),
    )[0]
    return made


def trs(translation: Doubles, rotation: Doubles, scale: Doubles) -> Doubles:
    """(n, 4, 4) of (n, 3), quaternions x y z w (n, 4) and (n, 3). A quaternion of any length but zero turns."""
    x, y, z, w = rotation.T
    square = x * x + y * y + z * z + w * w
    with np.errstate(divide="ignore", invalid="ignore"):
        s = np.where(square > 0, 2 / square, 0.0)
    matrix = np.zeros((len(x), 4, 4))
    matrix[:, 0, :3] = np.stack([1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)], axis=1)
    matrix[:, 1, :3] = np.stack([s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)], axis=1)
    matrix[:, 2, :3] = np.stack([s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)], axis=1)
    matrix[:, :3, :3] *= scale[:, None, :]
    matrix[:, :3, 3] = translation
    matrix[:, 3, 3] = 1
    return matrix


def instances(file: GltfFile, node: Node) -> Iterator[Doubles]:
    """The world matrices of a node's mesh: its own, or those of EXT_mesh_gpu_instancing."""
    extension = node.place.extension("EXT_mesh_gpu_instancing")
    if extension is None:
        yield node.world
        return
    attributes = extension.need("attributes")
    defaults = {"TRANSLATION": (0.0,) * 3, "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0,) * 3}
    given = {n: read(file, attributes, n, f"VEC{len(d)}") for n, d in defaults.items() if n in attributes}
    counts = {len(values) for values in given.values()}
    if len(counts) != 1:
        detail = f"its attributes have {sorted(counts) or 'no'} items; they must have the same"
        raise ParseError(detail, extension.pointer)
    (count,) = counts
    if count > MOST_INSTANCES:
        raise ParseError(f"has {count} instances; {MOST_INSTANCES} are allowed", extension.pointer)
    rows = [np.asarray(given[n], np.float64) if n in given else np.tile(d, (count, 1)) for n, d in defaults.items()]
    if not all(np.isfinite(row).all() for row in rows):
        raise ParseError("its attributes are not all finite", extension.pointer)
    yield from np.asarray(node.world @ trs(*rows))
