"""What fills the shapes of a scene, and the space around them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gpu.layout import Body
from service.document import Scene
from service.document.medium import LARGEST_G, Medium
from service.document.shape import CylinderShape
from service.pack.geometry.warnings import OddMesh, counted


def bodies(scene: Scene) -> np.ndarray:
    """A `layout.Body` for what is outside, and one for each shape; none where nothing is filled or has a priority."""
    outside = None if scene.environment is None else scene.environment.medium
    media: list[Medium | None] = [outside, *(getattr(shape, "medium", None) for shape in scene.shapes)]
    filled = {i: medium for i, medium in enumerate(media) if medium is not None and not medium.is_empty()}
    ranks = [0, *(getattr(shape, "priority", 0) for shape in scene.shapes)]
    records = np.zeros(len(media) if filled or any(ranks) else 0, Body.dtype)
    records["priority"] = ranks[: len(records)]
    numbers = {name: number for number, name in enumerate(scene.materials)}
    records["material"][1:] = [numbers[shape.material] for shape in scene.shapes][: len(records)]
    for i, medium in filled.items():
        _fill(records[i], medium)
    return records


def odd_media(scene: Scene, materials: np.ndarray, odd: Iterable[OddMesh]) -> tuple[str, ...]:
    """Warnings about media that rays enter and may never leave, or never enter. `materials` are the records, in the
    document's order; `odd` are the meshes that have oddities."""
    rims = {each.shape: each.oddities.rim for each in odd}
    enter = (materials["transmission"] > 0) & (materials["metallic"] < 1) & (materials["thin_walled"] == 0)
    clear = dict(zip(scene.materials, enter.tolist(), strict=True))
    found = list[tuple[int, str]]()
    for i, shape in enumerate(scene.shapes):
        medium = getattr(shape, "medium", None)
        if medium is None or medium.is_empty():
            continue
        if not clear[shape.material]:
            found.append((i, "it has a medium, which is not seen, as its material lets no light in"))
        elif rims.get(i) or (isinstance(shape, CylinderShape) and not shape.caps):
            found.append((i, "it is open and has a medium: light that leaves by the opening stays in the medium"))
    return counted(found)


def _fill(record: np.void, medium: Medium) -> None:
    record["extinction"], record["scattering"] = medium.coefficients()
    record["g"], record["emission"] = np.clip(medium.g, -LARGEST_G, LARGEST_G), medium.emission
