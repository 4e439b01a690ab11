"""Members of the records of all kinds: shapes that the camera looks through, and lights."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpu import layout
from gpu.layout import ShapeKind
from service.document.shape import Shape
from service.pack.geometry.world import ShapeMaterials
from service.pack.lights import lights


def hide(records: Sequence[np.ndarray], shapes: Sequence[Shape]) -> None:
    """Mark the records of shapes that the camera looks through."""
    hidden = np.array([not shape.visible_to_camera for shape in shapes], bool)
    if hidden.any():
        for array in records:
            index = array["shape"] & np.uint32(~(layout.SINGLE_SIDED | layout.ROUND | layout.OPEN) & layout.NONE)
            array["shape"] |= np.where(hidden[index], layout.HIDDEN, 0).astype(np.uint32)


def area_lights(
    analytic: dict[ShapeKind, np.ndarray], triangles: np.ndarray, materials: ShapeMaterials
) -> tuple[np.ndarray, np.ndarray]:
    """`layout.Light` records of the shapes that shine, not yet weighted, and their areas (m^2). The lights' numbers
    are written into the shapes' records. `triangles` are those that no instance shows."""
    records = {**analytic, ShapeKind.TRIANGLE: triangles}
    found = lights.mark(records, np.array([name in materials.emissive for name in materials.names]))
    return found, lights.areas(records, found)
