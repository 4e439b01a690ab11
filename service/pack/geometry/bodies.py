"""What fills the shapes of a scene, and the space around them."""

from __future__ import annotations

import numpy as np

from gpu.layout import Body
from service.scene import Scene
from service.scene.medium import Medium

LARGEST_G = np.nextafter(np.float32(1), np.float32(0))


def bodies(scene: Scene) -> np.ndarray:
    """A `layout.Body` for what is outside, and one for each shape; none where nothing is filled."""
    outside = None if scene.environment is None else scene.environment.medium
    media: list[Medium | None] = [outside, *(getattr(shape, "medium", None) for shape in scene.shapes)]
    filled = {i: medium for i, medium in enumerate(media) if medium is not None and not medium.is_empty()}
    records = np.zeros(len(media) if filled else 0, Body.dtype)
    for i, medium in filled.items():
        _fill(records[i], medium)
    return records


def _fill(record: np.void, medium: Medium) -> None:
    record["extinction"], record["scattering"] = medium.coefficients()
    record["g"], record["emission"] = np.clip(medium.g, -LARGEST_G, LARGEST_G), medium.emission
