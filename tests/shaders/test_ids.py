"""AOVs of the first hit that say what was met, of the very first camera ray of a pixel, and at which angle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from tests.rendering import document, picture

MATERIALS = {
    "unused": {"type": "diffuse", "albedo": 0.1},
    "left": {"type": "diffuse", "albedo": 0.2},
    "right": {"type": "diffuse", "albedo": 0.8},
    "veil": {"type": "diffuse", "albedo": 0.5, "alpha": 0.5},
}
HIDDEN = {"type": "sphere", "center": [0, 0, 3], "radius": 0.5, "material": "unused", "visible_to_camera": False}
LEFT = {"type": "quad", "origin": [-9, -1, 0], "u": [9, 0, 0], "v": [0, 2, 0], "material": "left"}
FAN = {
    "type": "mesh",
    "vertices": [[0, -1, 0], [9, -1, 0], [9, 1, 0], [0, 1, 0]],
    "faces": [[0, 1, 2], [0, 2, 3]],
    "material": "right",
    "double_sided": False,
}


def ids(gpu: Renderer, shapes: list[dict[str, Any]], aov: str, samples: int = 3, **settings: Any) -> np.ndarray:
    made = picture(gpu, document(shapes, MATERIALS), samples, **settings)
    values = made.read(aov)
    made.release()
    made.scene.release()
    assert values.dtype == np.float32 and values.shape == (32, 32, 1)
    return values[..., 0]


def test_ids_count_from_one_in_the_documents_order(gpu: Renderer) -> None:
    """The hidden shape is looked through; the mesh, and its bits for one side, is the third shape."""
    shapes = ids(gpu, [HIDDEN, LEFT, FAN], "shape_id")
    materials = ids(gpu, [HIDDEN, LEFT, FAN], "material_id")
    assert (shapes[0] == 0).all() and (materials[0] == 0).all()
    assert (shapes[16, :15] == 2).all() and (shapes[16, 17:] == 3).all()
    assert (materials[16, :15] == 2).all() and (materials[16, 17:] == 3).all()


@pytest.mark.parametrize("aov", ["shape_id", "material_id"])
def test_more_samples_change_no_id(gpu: Renderer, aov: str) -> None:
    """A veil is met by half of the first rays and let the others through; the later ones have no say."""
    veil = {"type": "quad", "origin": [-9, -9, 1], "u": [18, 0, 0], "v": [0, 18, 0], "material": "veil"}
    once, often = (ids(gpu, [LEFT, veil], aov, samples) for samples in (1, 9))
    assert np.array_equal(once, often)
    met = {"shape_id": 2, "material_id": 4}[aov]
    assert 0.4 < (once == met).mean() < 0.6
    assert set(np.unique(once)) == {0, met, {"shape_id": 1, "material_id": 2}[aov]}


def test_incidence_is_the_angle_between_view_and_normal(gpu: Renderer) -> None:
    """On a ball seen from afar the sine of the angle is the distance from its middle; 0 beside it."""
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "left"}
    camera = {"position": [0, 0, 1000], "target": [0, 0, 0], "vfov": 0.16}
    made = picture(gpu, document([ball], MATERIALS, camera=camera), 64, filter="box")
    angles, shown = made.read("incidence")[..., 0], made.display("incidence")
    depth, first = made.read("depth")[..., 0], made.read("shape_id")[..., 0]
    assert (angles[depth == 0] == 0).all(), "none of the samples hits anything"
    assert (angles[(first == 0) & (depth > 0)] > 45).any(), "the first one misses the edge, and others hit it"
    made.release()
    made.scene.release()
    y, x = (np.mgrid[:32, :32] + 0.5 - 16) / 16 * 1000 * np.tan(np.radians(0.08))
    r = np.hypot(x, y)
    assert (angles[r > 1.1] == 0).all() and (shown[r > 1.1][:, :3] == 0).all()
    inside = r < 0.9
    assert angles[inside] == pytest.approx(np.degrees(np.arcsin(r[inside])), abs=1.5)
    zones = [set(map(tuple, shown[(angles > low) & (angles < high)])) for low, high in ((1, 45), (45, 75), (75, 90))]
    assert all(len(zone) == 1 for zone in zones) and len(set.union(*zones)) == 3
