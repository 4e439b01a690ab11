"""The nodes of the scene that is shown, and their transforms to world space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.gltf.accessors import read
from service.formats.read.gltf.document import GltfDocument
from service.formats.read.gltf.json_view import JsonView, shown
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import Doubles

MOST_INSTANCES = 100_000  # shapes in a document; with more the document itself would be too large
LONGEST_NAME = 400  # characters of a path; what is deeper goes by the name of what is above it
IDENTITY = tuple(np.eye(4).reshape(-1).tolist())


@dataclass(frozen=True)
class Node:
    place: JsonView
    index: int
    world: Doubles  # (4, 4)
    path: str  # the names of those above it and its own, with slashes between; empty where none has one


class Nodes:
    def __init__(self, file: GltfDocument, notes: Warnings) -> None:
        self._file, self._notes = file, notes
        self._all = file.root.array("nodes")

    @cached_property
    def shown(self) -> list[Node]:
        """The nodes of the default scene, or of the first; all nodes where the file has no scenes. Parents come
        first."""
        places, indices, parents = self._walk()
        locals_, worlds = local_matrices(places), np.empty((len(places), 4, 4))
        for place in places:
            if "rotation" in place and not any(place.value["rotation"]):
                self._notes.add(
                    place.at("rotation"), "a quaternion of length 0 is no rotation; the node is not turned"
                )
        for k, (local, parent) in enumerate(zip(locals_, parents, strict=True)):
            worlds[k] = local if parent < 0 else worlds[parent] @ local
        return list(map(Node, places, indices, worlds, _paths(places, parents)))

    def _walk(self) -> tuple[list[JsonView], list[int], list[int]]:
        """The nodes that are shown, their numbers in the file, and where in the list their parents are (-1: none)."""
        places: list[JsonView] = []
        indices: list[int] = []
        parents: list[int] = []
        seen: set[int] = set()
        stack = [(index, pointer, -1) for index, pointer in reversed(self._roots())]
        while stack:
            index, pointer, parent = stack.pop()
            place = self._file.item("nodes", index, pointer)
            if index in seen:  # also every cycle
                raise ParseError(f"reaches /nodes/{index} a second time; nodes must form a tree", pointer)
            seen.add(index)
            hidden = place.extension("KHR_node_visibility")
            if hidden is not None and not hidden.flag("visible", True):
                continue  # with all below it
            children = place.array("children")
            stack += [
                (children[k], f"{place.pointer}/children/{k}", len(places)) for k in reversed(range(len(children)))
            ]
            places.append(place)
            indices.append(index)
            parents.append(parent)
        return places, indices, parents

    @cached_property
    def worlds(self) -> dict[int, Doubles]:
        return {node.index: node.world for node in self.shown}

    def world(self, index: int, pointer: str) -> Doubles:
        """The world matrix of a node, which may be outside the scene, as a skeleton's may be."""
        if index in self.worlds:
            return self.worlds[index]
        matrix: Doubles = np.eye(4)
        at, steps = index, 0
        while True:
            matrix = local_matrices([self._file.item("nodes", at, pointer)])[0] @ matrix
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
            place = JsonView(self._all[k], f"/nodes/{k}")
            found.update({child: k for child in place.array("children") if type(child) is int})
        return found

    def _roots(self) -> list[tuple[Any, str]]:
        file = self._file
        if not file.count("scenes"):
            return [(k, f"/nodes/{k}") for k in range(len(self._all)) if k not in self.parents]
        scene = file.item("scenes", file.root.value.get("scene", 0), "/scene")
        return [(one, f"{scene.at('nodes')}/{k}") for k, one in enumerate(scene.array("nodes"))]


def _paths(places: list[JsonView], parents: list[int]) -> list[str]:
    """Siblings of the same name are numbered; a node without a name is not a step of the path."""
    paths: list[str] = []
    taken: dict[str, int] = {"": 0}
    for place, parent in zip(places, parents, strict=True):
        above = paths[parent] if parent >= 0 else ""
        name = "-".join(place.text("name", "").split("/"))
        path = (f"{above}/{name}" if above else name) if name else above
        if name and len(path) <= LONGEST_NAME:
            count = taken[path] = taken.get(path, 0) + 1
            if count > 1:
                path = f"{path} {count}"
        paths.append(path if len(path) <= LONGEST_NAME else above)
    return paths


def local_matrices(places: list[JsonView]) -> Doubles:
    """(n, 4, 4): each node's matrix, given by columns, or T R S, all at once, as numpy takes 100 us for a single
    node."""
    translations = np.array([place.numbers("translation", (0.0, 0.0, 0.0)) for place in places]).reshape(-1, 3)
    rotations = np.array([place.numbers("rotation", (0.0, 0.0, 0.0, 1.0)) for place in places]).reshape(-1, 4)
    scales = np.array([place.numbers("scale", (1.0, 1.0, 1.0)) for place in places]).reshape(-1, 3)
    matrices: Doubles = trs(translations, rotations, scales)
    for k, place in enumerate(places):
        if "matrix" in place:
            columns = np.array(place.numbers("matrix", IDENTITY, 1e38))
            matrices[k] = columns.reshape(4, 4).T
            if tuple(matrices[k, 3]) != (0, 0, 0, 1):
                raise place.error("matrix", f"must be affine: its last row is {shown(matrices[k, 3].tolist())}")
    return matrices


def trs(translation: Doubles, rotation: Doubles, scale: Doubles) -> Doubles:
    """(n, 4, 4) from translations (n, 3), quaternions x y z w (n, 4) of any length but zero, and scales (n, 3)."""
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


def instances(file: GltfDocument, node: Node) -> Doubles:
    """(k, 4, 4): the world matrices of a node's mesh, its own or those of EXT_mesh_gpu_instancing."""
    extension = node.place.extension("EXT_mesh_gpu_instancing")
    if extension is None:
        return node.world[None]
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
    return np.asarray(node.world @ trs(*rows))
