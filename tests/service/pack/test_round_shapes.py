"""Disks and cylinders, which are quads and boxes of which only the round in them is there."""

from __future__ import annotations

import numpy as np
import pytest

from gpu.layout import ShapeBit
from service.problems import InvalidDocument
from tests.documents import GREY, LAMP, MIRRORED, matrix_of, packed, quad, sphere


@pytest.mark.parametrize("transform", [None, {"scale": [1, 2, 3], "rotate": [9, 8, 7]}, MIRRORED])
@pytest.mark.parametrize(
    ("normal", "right"), [([0, 3, 0], [1, 0, 0]), ([0, 0, -2], [-1, 0, 0]), ([5, 5, 0], [0, 0, -1])]
)
def test_disk_is_the_round_in_a_square_that_stands_upright(transform, normal, right):
    placed = {} if transform is None else {"transform": transform}
    disk = {"type": "disk", "center": [1, 2, 3], "normal": normal, "radius": 0.5, "material": "grey", **placed}
    arrays = packed(quad(), disk, {**disk, "visible_to_camera": False}).arrays
    _, record, _hidden = arrays.quads
    assert arrays.quads["shape"].tolist() == [0, ShapeBit.ROUND | 1, ShapeBit.ROUND | ShapeBit.HIDDEN | 2]
    matrix = np.eye(4) if transform is None else matrix_of(transform)
    outward = np.linalg.inv(matrix[:3, :3]).T @ normal
    np.testing.assert_allclose(record["normal"], outward / np.linalg.norm(outward), atol=1e-6)
    np.testing.assert_allclose(record["u"], matrix[:3, :3] @ right, atol=1e-6)
    middle = record["origin"] + (record["u"] + record["v"]) / 2
    np.testing.assert_allclose(middle, (matrix @ [1, 2, 3, 1])[:3], rtol=1e-5)
    across = np.linalg.norm(np.cross(record["u"].astype(float), record["v"]))
    assert record["area"] == pytest.approx(np.pi / 4 * across, rel=1e-5)


@pytest.mark.parametrize("transform", [None, {"scale": [1, 2, 3], "rotate": [9, 8, 7]}, MIRRORED])
@pytest.mark.parametrize("emissive", [False, True])
@pytest.mark.parametrize("caps", [False, True])
def test_cylinder_is_the_round_in_a_box(transform, emissive, caps):
    """One that shines is an open side and its caps, which are disks."""
    placed = {} if transform is None else {"transform": transform}
    material = "lamp" if emissive else "grey"
    pipe = {
        "type": "cylinder",
        "base": [1, 2, 3],
        "axis": [2, 3, 6],
        "radius": 0.5,
        "caps": caps,
        "material": material,
    }
    materials = {"grey": GREY, "lamp": LAMP}
    arrays = packed(sphere(), {**pipe, **placed}, {**pipe, "visible_to_camera": False}, materials=materials).arrays
    bits = ShapeBit.ROUND | (ShapeBit.OPEN if emissive or not caps else 0)
    assert arrays.boxes["shape"].tolist() == [bits | 1, bits | ShapeBit.HIDDEN | 2]
    matrix = np.eye(4) if transform is None else matrix_of(transform)
    axes = np.linalg.inv(np.stack([arrays.boxes[f"row_{name}"][0].astype(float) for name in "xyz"]))
    center = arrays.boxes["center"][0]
    np.testing.assert_allclose(axes[:, 1], matrix[:3, :3] @ [1, 1.5, 3], rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(center, (matrix @ [2, 3.5, 6, 1])[:3], rtol=1e-5)
    local = np.linalg.inv(matrix[:3, :3]) @ axes
    np.testing.assert_allclose(local[:, ::2].T @ local[:, ::2], 0.25 * np.eye(2), atol=1e-5)
    np.testing.assert_allclose(local[:, 1] @ local[:, ::2], 0, atol=1e-5)
    quads = arrays.quads[(arrays.quads["shape"] & 3) == 1]
    assert len(quads) == (2 if emissive and caps else 0)
    for quad_, way in zip(quads, (1, -1), strict=False):
        assert quad_["shape"] & ShapeBit.ROUND
        middle = quad_["origin"] + (quad_["u"] + quad_["v"]) / 2
        np.testing.assert_allclose(middle, center + way * axes[:, 1], rtol=1e-5, atol=1e-5)
        outward = way * np.linalg.inv(matrix[:3, :3]).T @ [2, 3, 6]
        np.testing.assert_allclose(quad_["normal"], outward / np.linalg.norm(outward), atol=1e-5)


@pytest.mark.parametrize(("field", "value"), [("axis", [0, 0, 0]), ("radius", 0), ("radius", -1), ("base", [0, 1])])
def test_a_cylinder_has_a_length_and_a_radius(field, value):
    pipe = {"type": "cylinder", "base": [0, 0, 0], "axis": [0, 1, 0], "radius": 1, "material": "grey"}
    with pytest.raises(InvalidDocument) as refused:
        packed({**pipe, field: value})
    assert [error.pointer for error in refused.value.errors] == [f"/shapes/0/{field}"]
