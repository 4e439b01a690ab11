"""The transforms of a file's parts, computed all at once because numpy takes 100 us for a single matrix."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.read.raw_mesh import MAX_COORDINATE
from service.formats.read.scenes.framing import Bounds
from service.formats.read.scenes.rays import Placed
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import Doubles, Indices

MOST_SHAPES = 100_000  # with more, the document itself would be too large
LEAST_VOLUME = 1e-7  # least volume of the axes at length one that service.document.transform takes for invertible


@dataclass(frozen=True)
class Part:
    """A mesh with one material in one pose, written once for all the places where it stands."""

    shape: dict[str, Any]  # without its transform
    vertices: npt.NDArray[Any]  # (n, 3) floating
    faces: Indices  # (m, 3)

    @property
    def triangles(self) -> int:
        return len(self.faces)

    @cached_property
    def bounds(self) -> Bounds:
        return self.vertices.min(axis=0), self.vertices.max(axis=0)


class Placements:
    """Parts and their world matrices, in the order of the file."""

    def __init__(self) -> None:
        self._parts: list[Part] = []
        self._pointers: list[str] = []
        self._matrices: list[Doubles] = []
        self._names: list[str] = []

    def add(self, part: Part, pointer: str, worlds: Doubles, name: str) -> None:
        """Add `part` under each of `worlds` (k, 4, 4); `pointer` says which node of the file they are. Raises
        ParseError where there are too many."""
        if len(self._parts) + len(worlds) > MOST_SHAPES:
            raise ParseError(f"the scene has more than the {MOST_SHAPES} primitives allowed, counted in each node")
        self._parts += [part] * len(worlds)
        self._pointers += [pointer] * len(worlds)
        self._matrices.extend(worlds)
        self._names += [name] * len(worlds)

    def shapes(self, notes: Warnings) -> list[dict[str, Any]]:
        """A shape for each placement; one whose matrix has no inverse is left out, with a warning."""
        stands, moves = self._stands.tolist(), (self._worlds != np.eye(4)).any(axis=(1, 2)).tolist()
        matrices = self._worlds.reshape(-1, 16).tolist()
        found = []
        for k, (part, name) in enumerate(zip(self._parts, self._names, strict=True)):
            named = {"name": name} if name else {}
            if not stands[k]:
                notes.leave_out(self._pointers[k], "the node's transform makes its mesh flat; it is left out")
            elif moves[k]:
                found.append({**named, **part.shape, "transform": {"matrix": matrices[k]}})
            else:
                found.append({**named, **part.shape})
        return found

    @property
    def shown(self) -> list[Part]:
        """The part of each shape."""
        return [part for part, stands in zip(self._parts, self._stands.tolist(), strict=True) if stands]

    def placed(self) -> list[Placed]:
        """The shapes for rays to hit."""
        worlds = self._worlds[self._stands]
        return [
            Placed(part.vertices, part.faces, world, part.shape.get("double_sided", True), part.shape["material"])
            for part, world in zip(self.shown, worlds, strict=True)
        ]

    @property
    def bounds(self) -> Bounds:
        """The box around all shapes, at least one."""
        boxes, worlds = np.array([part.bounds for part in self.shown], np.float64), self._worlds[self._stands]
        linear, moved = worlds[:, :3, :3], worlds[:, :3, 3]
        middles = np.einsum("nij,nj->ni", linear, boxes.mean(axis=1)) + moved
        halves = np.einsum("nij,nj->ni", np.abs(linear), np.ptp(boxes, axis=1) / 2)
        return (middles - halves).min(axis=0), (middles + halves).max(axis=0)

    @cached_property
    def _worlds(self) -> Doubles:
        """(n, 4, 4). Raises ParseError where one is not finite."""
        worlds = np.array(self._matrices).reshape(-1, 4, 4)
        beyond = ~(np.abs(worlds).max(axis=(1, 2), initial=0) <= MAX_COORDINATE)  # also where it is not a number
        if beyond.any():
            pointer = self._pointers[int(beyond.argmax())]
            raise ParseError("the node's matrix in the world is not finite or has a number beyond 1e9", pointer)
        return worlds

    @cached_property
    def _stands(self) -> npt.NDArray[np.bool_]:
        """(n,): which matrices have an inverse."""
        axes = self._worlds[:, :3, :3]
        lengths = np.linalg.norm(axes, axis=1)
        has_axes = lengths.min(axis=1, initial=np.inf) > 1e-30
        units = axes / np.where(has_axes[:, None], lengths, 1)[:, None]
        stands: npt.NDArray[np.bool_] = has_axes & (np.abs(np.linalg.det(units)) >= LEAST_VOLUME)
        return stands
