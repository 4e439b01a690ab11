"""Warnings about the shapes of a scene: the same one about many shapes is a single line with a count."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gpu import layout
from service.formats import MeshOddities

NUMBER = re.compile(r"\d+")


def counted(found: Iterable[tuple[int, str]]) -> tuple[str, ...]:
    """A line for each kind of warning, from pairs of a shape's number and a text; numbers make no kind."""
    kinds: dict[str, list[tuple[int, str]]] = {}
    for shape, text in found:
        kinds.setdefault(NUMBER.sub("#", text), []).append((shape, text))
    return tuple(map(_line, kinds.values()))


@dataclass(frozen=True)
class OddMesh:
    """A mesh of the document that has oddities."""

    shape: int  # its index, and its material's
    material: int
    oddities: MeshOddities
    is_smoothed: bool  # whether its vertices have normals that are computed
    is_double_sided: bool


def odd_meshes(found: Iterable[OddMesh], materials: np.ndarray, emissive: np.ndarray) -> tuple[str, ...]:
    """Warnings about oddities that the picture shows: most surfaces look the same with them.

    `materials` are the layout.Material records, and `emissive` (materials,) is whether each shines.
    """
    details = [(each.shape, _odd(each, materials[each.material], bool(emissive[each.material]))) for each in found]
    return counted((shape, text) for shape, text in details if text)


def _odd(mesh: OddMesh, material: np.void, emits: bool) -> str:
    """One line with the oddities that matter under this material; "" where none does."""
    odd, transmits = mesh.oddities, material["transmission"] != 0 and material["thin_walled"] == 0
    fades = material["opacity"] != 1 and material["cutoff"] == layout.ABSENT
    has_inside = transmits or (emits and material["emission_sides"] == 1)
    parts = list[str]()
    if odd.coinciding and (transmits or emits or fades):
        parts.append(_many(odd.coinciding, "triangle coincides with another", "triangles coincide with others"))
    elif odd.differing and mesh.is_double_sided:
        coincide = _many(odd.differing, "triangle coincides with one", "triangles coincide with others")
        parts.append(f"{coincide} of other colours or texture coordinates")
    if odd.crowded and transmits:
        parts.append(_many(odd.crowded, "edge belongs", "edges belong") + " to more than two triangles")
    if odd.turned and (has_inside or mesh.is_smoothed):
        parts.append(_many(odd.turned, "edge joins", "edges join") + " triangles that face opposite ways")
    if odd.inwards and has_inside:
        parts.append("the mesh is closed and faces inwards")
    if not parts:
        return ""
    if transmits:
        effect = "light that passes through it may be wrong"
    elif emits:
        effect = "light that it emits may be wrong"
    elif odd.turned and mesh.is_smoothed:
        effect = "its smooth shading may be wrong there"
    else:
        effect = "it is more opaque there" if fades else "which of them is seen is arbitrary"
    return f"{' and '.join(parts)}: {effect}"


def _many(count: int, one: str, more: str) -> str:
    return f"1 {one}" if count == 1 else f"{count} {more}"


def _line(alike: list[tuple[int, str]]) -> str:
    (shape, text), more = alike[0], len({shape for shape, _ in alike}) - 1
    if not more:
        return f"/shapes/{shape}: {text}"
    shapes = "1 more shape" if more == 1 else f"{more} more shapes"
    others = "here and" if len({text for _, text in alike}) == 1 else "with other counts also"
    return f"/shapes/{shape}: {text} ({others} in {shapes})"
