"""Numbers that stand in two places because neither may import the other: these tests fail when only one changes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from gpu import RenderSettings, footprint, layout
from gpu.layout import ShapeKind
from gpu.picture import display
from service import colorimetry, pack
from service.document import numbers
from service.formats.read.gltf import json_view
from service.pack.lights import light_bounds
from tests.documents import packed

ROOT = Path(__file__).parent.parent


def test_the_server_counts_a_picture_s_bytes_as_the_renderer_takes_them() -> None:
    """The server counts the denoised picture as well, and a copy of it that is on its way: a vec4 a pixel each."""
    settings = RenderSettings(1920, 1080)
    pixels = settings.width * settings.height
    taken = (footprint.picture_bytes(settings, guided=True) - footprint.FIXED_BYTES) / pixels
    assert taken + 2 * 16 == pack.RENDERED_PIXEL_BYTES == 176
    assert footprint.picture_bytes(RenderSettings(1920, 1080, adaptive=True)) < footprint.picture_bytes(settings)
    without = (footprint.picture_bytes(settings) - footprint.FIXED_BYTES) / pixels
    assert without == pack.SAVED_PIXEL_BYTES == 96


def test_luminance_has_the_same_weights_in_the_renderer() -> None:
    assert tuple(colorimetry.LUMINANCE) == layout.LUMINANCE


def test_the_renderer_encodes_srgb_as_the_service() -> None:
    values = np.linspace(0, 1, 10_001)
    np.testing.assert_array_equal(display.srgb(values), colorimetry.encode_srgb(values))


def test_gltf_files_have_the_ranges_of_scenes() -> None:
    """Parsers of files do not load service.document: that takes a quarter of a second."""
    assert (json_view.LARGEST, json_view.BRIGHTEST) == (numbers.LARGEST, numbers.BRIGHTEST)


@pytest.mark.parametrize("angles", [(20, 60), (0, 5), (30, 30), (0.01, 90)])
def test_the_lights_tree_bounds_a_spot_as_its_shader_fades_it(angles: tuple[float, float]) -> None:
    """`spot.glsl` is compared with these angles in tests/shaders/test_lights.py."""
    spot = {"type": "spot", "position": [1, 2, 3], "direction": [0, 0, -5], "intensity": 1,
            "inner_angle": angles[0], "outer_angle": angles[1]}  # fmt: skip
    arrays = packed(lights=[spot]).arrays
    shapes = {
        ShapeKind.SPHERE: arrays.spheres, ShapeKind.QUAD: arrays.quads, ShapeKind.BOX: arrays.boxes,
        ShapeKind.ELLIPSOID: arrays.ellipsoids, ShapeKind.TRIANGLE: arrays.triangles,
    }  # fmt: skip
    bounds = light_bounds.bounds(arrays.lights, shapes, np.ones(1))
    inner, outer = np.cos(np.radians(angles))
    np.testing.assert_allclose(bounds.axis, [[0, 0, -1]], atol=1e-6)
    # A rim is at least a thousandth of the cone wide, so that its inverse fits into float32.
    np.testing.assert_allclose(bounds.normals, inner, atol=2e-3 * (1 - outer))
    np.testing.assert_allclose(np.arccos(bounds.beyond), np.radians(angles[1] - angles[0]), atol=0.02)
    np.testing.assert_allclose(bounds.solid_angle, np.pi * (2 - inner - outer), rtol=2e-3)


def test_one_module_of_the_browser_knows_the_field_of_view() -> None:
    """Others write it into a camera of their own, or name the field; what it means stands in one place."""
    for path in sorted((ROOT / "web").rglob("*.js")):
        if path == ROOT / "web/document/camera.js":
            continue
        code = re.sub(r"//.*", "", path.read_text())
        assert not re.findall(r"\bvfov\b(?!: [0-9.]+ )", code), path
        assert not re.findall(r"Math\.tan\([^;]*(?:fov|field)", code), path
