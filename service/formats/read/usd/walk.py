"""The things of a stage that are shown, each with the places where it stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from service.formats.errors import ParseError
from service.formats.read.scenes.placements import MOST_SHAPES
from service.formats.read.scenes.warnings import Warnings
from service.formats.types import Doubles

MOST_PRIMS = 300_000  # visited, each in every instance of it
DEEPEST = 16  # instancers whose prototypes are instancers
HIDDEN = ("proxy", "guide")  # purposes: stand-ins for the viewport, and helpers
LONGEST_NAME = 400  # characters of a name in the document


@dataclass(frozen=True)
class Item:
    """A prim under each of `worlds` (k, 4, 4), which take columns; `name` is for people."""

    prim: Usd.Prim
    worlds: Doubles
    name: str

    @property
    def pointer(self) -> str:
        return str(self.prim.GetPath())


class Walk:
    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode, notes: Warnings) -> None:
        self._stage, self._time, self._notes = stage, time, notes
        self._visited = 0
        self.hidden: tuple[str, str] | None = None  # the first thing that is not shown, and why
        self.root = placed(stage)

    def items(self) -> list[Item]:
        """All prims but groups, in the order of the file. Raises ParseError where there are too many."""
        children = self._children(self._stage.GetPseudoRoot())
        return [item for prim in children for item in self._below(prim, self.root[None], 0)]

    def _below(self, top: Usd.Prim, worlds: Doubles, depth: int) -> Iterator[Item]:
        """A prim and all that is below it."""
        stack = [(top, worlds, "default")]
        while stack:
            prim, above, purpose = stack.pop()
            self._visited += 1
            if self._visited > MOST_PRIMS:
                raise ParseError(f"the scene has more than the {MOST_PRIMS} prims allowed, counted in each instance")
            here = above
            if prim.IsA(UsdGeom.Imageable):
                seen = UsdGeom.Imageable(prim)
                if seen.GetVisibilityAttr().Get(self._time) == "invisible":
                    self._hide(prim, "it is invisible")
                    continue
                purpose = self._purpose(seen, purpose)
                if purpose in HIDDEN:
                    self._hide(prim, f"its purpose is {purpose}, which no picture shows")
                    continue
                if prim.IsA(UsdGeom.Xformable):
                    local = UsdGeom.Xformable(prim)
                    if local.GetResetXformStack():
                        above = self.root[None]
                    here = above @ _matrix(local.GetLocalTransformation(self._time))
            if prim.IsA(UsdGeom.PointInstancer):
                yield from self._instances(UsdGeom.PointInstancer(prim), here, depth)
                continue
            if prim.GetTypeName():
                yield Item(prim, here, str(prim.GetPath())[1:][:LONGEST_NAME])
            stack += [(child, here, purpose) for child in reversed(self._children(prim))]

    def _instances(self, instancer: UsdGeom.PointInstancer, worlds: Doubles, depth: int) -> Iterator[Item]:
        """The instances that an instancer places: its prototypes are not shown by themselves."""
        pointer = str(instancer.GetPath())
        if depth >= DEEPEST:
            raise ParseError(f"instancers are nested more than {DEEPEST} deep, or in a circle", pointer)
        own = UsdGeom.PrimvarsAPI(instancer).GetPrimvar("displayColor")
        if own and own.HasValue() and own.GetInterpolation() != UsdGeom.Tokens.constant:
            self._notes.add(pointer, "a displayColor of each instance is not supported; it is ignored")
        which = instancer.GetProtoIndicesAttr().Get(self._time)
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        if not which or not targets:
            return
        numbers = np.array(which)
        wrong = (numbers < 0) | (numbers >= len(targets))
        if wrong.any():
            detail = f"instances name prototypes that do not exist, the first: {numbers[wrong][0]}; there are"
            self._notes.leave_out(
                f"{pointer}.protoIndices", f"{wrong.sum()} {detail} {len(targets)}; they are left out"
            )
        if len(numbers) * len(worlds) > MOST_SHAPES:
            raise ParseError(f"places {len(numbers) * len(worlds)} instances; {MOST_SHAPES} are allowed", pointer)
        matrices = instancer.ComputeInstanceTransformsAtTime(
            self._time, self._time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
        )
        if len(matrices) != len(numbers):
            self._notes.leave_out(pointer, "its positions and protoIndices differ in number; it is left out")
            return
        visible = np.array(instancer.ComputeMaskAtTime(self._time) or np.ones(len(numbers)), bool)
        placed = np.array([np.array(one) for one in matrices]).transpose(0, 2, 1)
        for k, target in enumerate(targets):
            prim = self._stage.GetPrimAtPath(target)
            rows = placed[visible & (numbers == k)]
            if not prim and len(rows):
                self._notes.leave_out(
                    pointer, f"its prototype {str(target)[:100]} is not in this file; it is left out"
                )
            if not prim or not len(rows):
                continue
            every = (worlds[:, None] @ rows[None]).reshape(-1, 4, 4)
            for item in self._below(prim, every, depth + 1):
                if len(item.worlds) > MOST_SHAPES:
                    raise ParseError(f"places more than the {MOST_SHAPES} instances allowed", pointer)
                yield Item(item.prim, item.worlds, f"{pointer[1:]}/{item.prim.GetName()}"[:LONGEST_NAME])

    def _hide(self, prim: Usd.Prim, why: str) -> None:
        self.hidden = self.hidden or (str(prim.GetPath()), why)

    def _purpose(self, seen: UsdGeom.Imageable, above: str) -> str:
        """A prim's own purpose, where it or its schema says one; else that of what is above it."""
        purpose = seen.GetPurposeAttr()
        if purpose.HasAuthoredValue():
            return str(purpose.Get())
        return above

    def _children(self, prim: Usd.Prim) -> list[Usd.Prim]:
        return list(prim.GetFilteredChildren(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))


def placed(stage: Usd.Stage) -> Doubles:
    """(4, 4): from the stage's units and axes to metres with +Y up."""
    matrix = np.eye(4)
    if up_axis(stage) == "Z":
        matrix[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    matrix[:3, :3] *= metres_per_unit(stage)
    return matrix


# The library's own functions refuse these where they have another type, as in files of Blender 2.8.


def metres_per_unit(stage: Usd.Stage) -> float:
    """The stage's unit of length; a centimetre where it says none."""
    found = _said(stage, "metersPerUnit")
    return float(found) if isinstance(found, int | float) else 0.01


def up_axis(stage: Usd.Stage) -> str:
    return str(_said(stage, "upAxis") or "Y")


def _said(stage: Usd.Stage, name: str) -> Any:
    """What the root layer says of the stage; None where it says nothing."""
    root = stage.GetRootLayer().pseudoRoot
    return root.GetInfo(name) if root.HasInfo(name) else None


def _matrix(row_vectors: Any) -> Doubles:
    """A matrix of USD, which multiplies rows, for columns."""
    return np.array(row_vectors, np.float64).T
