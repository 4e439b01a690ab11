"""Tables of colours on the device: views of OpenColorIO against its own processor."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import Lut, Picture, Renderer
from gpu.picture.display import srgb
from service import displays
from service.colorimetry import decode_srgb
from service.formats.images import encoders
from service.worker.view import frames
from tests.rendering import document, picture

SIDE = 96
ACES2 = displays.SHORT["aces2"][0]


@pytest.fixture(scope="module")
def canvas(gpu: Renderer) -> Picture:
    """A picture whose size is that of the colours that are shown in its place."""
    return picture(gpu, document([]), 1, width=SIDE, height=SIDE, max_bounces=0)


@pytest.fixture(scope="module")
def colors() -> np.ndarray:
    """Radiance of all saturations from 0.002 to 128, opaque; the first row is black and greys."""
    rng = np.random.default_rng(2)
    grey = np.exp2(rng.uniform(-9, 7, (SIDE, SIDE, 1)))
    out = np.ones((SIDE, SIDE, 4), np.float32)
    out[..., :3] = grey * (1 - rng.uniform(0, 1, (SIDE, SIDE, 1)) * rng.uniform(0, 1, (SIDE, SIDE, 3)))
    out[0, :, :3] = np.linspace(0, 4, SIDE)[:, None]
    return out


def test_names_are_those_of_the_library() -> None:
    import OpenImageIO as oiio

    config = oiio.ColorConfig(displays.CONFIGURATION)
    assert not config.geterror() and displays.SOURCE in config.getColorSpaceNames()
    there = {name: tuple(config.getViewNames(name)) for name in config.getDisplayNames()}
    del there["Display P3 HDR - Display"]
    assert there == {name: row.views for name, row in displays.DISPLAYS.items()}
    assert all(displays.mistake(name) is None for name in displays.names())


@pytest.mark.parametrize(
    ("view", "mean", "most"),  # errors in steps of 8 bits
    [
        (ACES2, 0.09, 2.2),
        (displays.SHORT["aces2"][1], 0.09, 2.2),
        (("Rec.2100-PQ - Display", "ACES 2.0 - HDR 1000 nits (Rec.2020)"), 0.09, 1.2),
        (("sRGB - Display", "Un-tone-mapped"), 0.09, 0.3),
        (("P3-D65 - Display", "Un-tone-mapped"), 0.1, 6.0),
    ],
)
@pytest.mark.parametrize("exposure", [0.0, -1.5])
def test_views_are_the_librarys(
    canvas: Picture, colors: np.ndarray, view: tuple[str, str], mean: float, most: float, exposure: float
) -> None:
    table = frames.view_table(*view)
    exact = np.clip(frames.exact(colors[..., :3] * 2**exposure, *view), 0, 1)
    floats = canvas.display(tone_map=table, exposure=exposure, dtype="f4", color=colors)
    error = np.abs(floats[..., :3] - exact).max(axis=-1) * 255
    assert error.mean() < mean and error.max() < most
    assert np.abs(canvas.display(tone_map=table, exposure=exposure, color=colors) / 255 - floats).max() < 0.51 / 255


def test_greys_stay_grey_and_in_order(canvas: Picture, colors: np.ndarray) -> None:
    shown = canvas.display(tone_map=frames.view_table(*ACES2), dtype="f4", color=colors)[0, :, :3]
    assert np.ptp(shown, axis=1).max() < 2e-3 and (np.diff(shown[:, 1]) > 0).all() and shown[0].max() < 1e-3


@pytest.mark.parametrize("tone_map", ["linear", "reinhard", "agx"])
def test_curves_in_the_primaries_of_p3(canvas: Picture, colors: np.ndarray, tone_map: str) -> None:
    """Curves run in those of the screen; what was fitted for Rec.709 runs there, and its result is converted."""
    matrix = np.linalg.inv(encoders.xyz_matrix(encoders.PRIMARIES["p3"])) @ encoders.xyz_matrix(
        encoders.PRIMARIES["rec709"]
    )
    radiance = colors[..., :3].astype(float)
    if tone_map == "agx":
        narrow = canvas.display(tone_map=tone_map, dtype="f4", color=colors)[..., :3]
        expected = decode_srgb(narrow) @ matrix.T
    else:
        wide = radiance @ matrix.T
        expected = wide if tone_map == "linear" else wide / (1 + wide)
    shown = canvas.display(tone_map=tone_map, dtype="f4", color=colors, p3=True)[..., :3]
    np.testing.assert_allclose(shown, srgb(np.clip(expected, 0, 1)), atol=5e-5)


def test_a_view_is_baked_once() -> None:
    assert frames.view_table(*ACES2) is frames.view_table(*ACES2)


@pytest.mark.parametrize("radiance", [0.0, 1e20, 3e38])
def test_views_end_in_their_limits(canvas: Picture, colors: np.ndarray, radiance: float) -> None:
    lit = np.broadcast_to(np.float32([radiance, 0, radiance, 1]), colors.shape)
    for exposure in (-60.0, 60.0):
        shown = canvas.display(tone_map=frames.view_table(*ACES2), exposure=exposure, dtype="f4", color=lit)
        assert np.isfinite(shown).all() and (shown >= 0).all() and (shown <= 1).all()


@pytest.mark.parametrize("side", [2, 17])
def test_a_cube_is_interpolated_in_tetrahedra(canvas: Picture, colors: np.ndarray, side: int) -> None:
    """Between sorted axes: each vertex is reached from the one before along the axis that has most left."""
    table = np.random.default_rng(side).random((side, side, side, 3)).astype(np.float32)
    shown = canvas.display(tone_map="reinhard", dtype="f4", color=colors)[..., :3].reshape(-1, 3)
    through = canvas.display(tone_map="reinhard", dtype="f4", color=colors, lut=Lut(f"cube{side}", table))
    at = shown.astype(float) * (side - 1)
    low = np.minimum(at.astype(int), side - 2)
    left = at - low
    order = np.argsort(-left, axis=1)
    weights = np.take_along_axis(left, order, 1)
    expected = table[low[:, 2], low[:, 1], low[:, 0]] * (1 - weights[:, :1])
    for k in range(3):
        low[np.arange(len(low)), order[:, k]] += 1
        step = weights[:, k] - (weights[:, k + 1] if k < 2 else 0)
        expected += table[low[:, 2], low[:, 1], low[:, 0]] * step[:, None]
    np.testing.assert_allclose(through[..., :3].reshape(-1, 3), expected, atol=1e-4)


def test_curves_hold_at_the_ends_of_their_domain(canvas: Picture, colors: np.ndarray) -> None:
    curve = np.float32([[0.2, 0, 1], [0.4, 1, 0], [0.9, 0.5, 0.5]])
    lut = Lut("curves", curve, (0.25, 0, 0), (0.75, 1, 2))
    shown = canvas.display(tone_map="reinhard", dtype="f4", color=colors)[..., :3]
    through = canvas.display(tone_map="reinhard", dtype="f4", color=colors, lut=lut)[..., :3]
    places = [np.linspace(low, high, 3) for low, high in zip(lut.low, lut.high, strict=True)]
    expected = np.stack([np.interp(shown[..., k], places[k], curve[:, k]) for k in range(3)], axis=-1)
    np.testing.assert_allclose(through, expected, atol=1e-4)


def test_a_cube_follows_a_view(canvas: Picture, colors: np.ndarray) -> None:
    """Both tables are in one buffer; the cube here turns the channels round."""
    axis = np.linspace(0, 1, 5, dtype=np.float32)
    blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
    turned = Lut("turned", np.stack([green, blue, red], axis=-1))
    view = frames.view_table(*ACES2)
    shown = canvas.display(tone_map=view, dtype="f4", color=colors)
    through = canvas.display(tone_map=view, dtype="f4", color=colors, lut=turned)
    np.testing.assert_allclose(through[..., :3], shown[..., [1, 2, 0]], atol=1e-4)
