"""`measured`: the tables of MERL and RGL files against the formula that they were made from, and against their own
arithmetic in float64; reciprocal, sampled with the density it claims, and never above all of the light."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.kernels import features
from gpu.layout.bindings import Slot
from service.document import parse_scene
from service.formats import AssetLimits, MeasuredData
from service.formats.read.measured import merl
from service.formats.read.measured.adaptive import parse_adaptive
from service.pack import pack
from tests import measured_files
from tests.lobes import Grid
from tests.measured_files import Facets
from tests.probing import Prober, prober_of

FORMULAS = {
    "plastic": Facets(),
    "satin": Facets(diffuse=(0.02, 0.02, 0.02), f0=0.9, alpha=(0.12, 0.12)),
    "rough": Facets(alpha=(0.5, 0.5)),
    "brushed": Facets(diffuse=(0.2, 0.1, 0.05), f0=0.5, alpha=(0.3, 0.6)),
}
ROUND = np.linspace(-np.pi, np.pi, 17)
# (file, formula): files for which the formula's light is known; the last ones say so of a part of the circle.
ROWS = {
    "merl plastic": ("merl", "plastic", {}),
    "merl satin": ("merl", "satin", {}),
    "rgl rough": ("rgl", "rough", {}),
    "rgl spectral": ("rgl", "rough", {"wavelengths": np.arange(360.0, 831.0, 10.0)}),
    "rgl brushed": ("rgl", "brushed", {"phis": ROUND}),
    "rgl half": ("rgl", "brushed", {"phis": ROUND[:9]}),
    "rgl quarter": ("rgl", "brushed", {"phis": ROUND[:5]}),
}
ANGLES = (0.0, 40.0, 70.0, 86.0)
CASES = [(row, angle) for row in ROWS for angle in ANGLES]


class Shelf:
    """One measurement, whatever it is called."""

    def __init__(self, data: MeasuredData) -> None:
        self._data = data

    def measured(self, ref: str) -> MeasuredData:
        return self._data

    def mesh(self, ref: str) -> Any:
        raise KeyError(ref)

    image = mesh


@cache
def data_of(row: str) -> MeasuredData:
    kind, formula, more = ROWS[row]
    facets = FORMULAS[formula]
    if kind == "merl":
        return merl.parse_merl(measured_files.merl(facets))
    return parse_adaptive(measured_files.tensor_file(measured_files.adaptive(facets, **more)), AssetLimits())


def packed(data: MeasuredData) -> Any:
    camera = {"position": [0, 0, 1], "target": [0, 0, 0]}
    materials = {"m": {"type": "measured", "asset": "a"}}
    return pack(
        parse_scene({"version": 1, "camera": camera, "materials": materials, "shapes": []}), Shelf(data)
    ).arrays


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


def ask(prober: Prober, data: MeasuredData, wo: np.ndarray, asks: np.ndarray, sample: int = 0) -> list[np.ndarray]:
    """(n, 4), f with its cosine and the pdf, and the directions; of wi, or of (u_lobe, u, u) with `sample`. The
    probe's tangent is (.8, .6); here x is along it."""
    arrays = packed(data)
    given = np.zeros((len(asks) + wo.size // 3, 4), np.float32)
    given[:, :3] = np.concatenate([asks, wo.reshape(-1, 3)])
    inputs = {Slot.SUM: given, Slot.MATERIALS: arrays.materials}
    raised = features.flags(arrays) & {
        name for name in features.everything() if "MEASURED" in name or "ANISO" in name
    }
    choices = {"samples": sample, "inside": 0, "last_wo": wo.size // 3 - 1}
    out = prober.run("bsdf.comp", len(asks), inputs, (Slot.MOMENTS, Slot.OUTPUT), {}, raised,
                     measured=arrays.measured, **choices)  # fmt: skip
    return [each.astype(float) for each in out]


def at(degrees: float, azimuth: float = 0.7) -> np.ndarray:
    t = math.radians(degrees)
    return np.array([math.sin(t) * math.cos(azimuth), math.sin(t) * math.sin(azimuth), math.cos(t)])


def along(w: np.ndarray) -> np.ndarray:
    """In the frame of the probe's tangent."""
    return np.stack([0.8 * w[..., 0] + 0.6 * w[..., 1], 0.8 * w[..., 1] - 0.6 * w[..., 0], w[..., 2]], axis=-1)


def hemisphere(rng: np.random.Generator, n: int, least: float = 0.1) -> np.ndarray:
    z, phi = rng.uniform(least, 1, n), rng.uniform(0, 2 * np.pi, n)
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], 1)


@pytest.mark.parametrize("row", ROWS)
def test_values_are_those_of_what_was_measured(prober: Prober, row: str) -> None:
    """As closely as such tables can have it: MERL's to two percent, those of 8 x 17 views of a stretched highlight
    to a tenth."""
    rng = np.random.default_rng(1)
    wo, wi = hemisphere(rng, 4000), hemisphere(rng, 4000)
    kind, formula, more = ROWS[row]
    expected = FORMULAS[formula](along(wo), along(wi)) * wi[:, 2:]
    f = ask(prober, data_of(row), wo, wi)[0][:, :3]
    off = np.abs(f / expected - 1)[:, 0]
    most = (3e-3, 0.02) if kind == "merl" else (0.06, 0.4) if more.get("phis") is not None else (0.02, 0.08)
    assert np.median(off) < most[0]
    assert np.quantile(off, 0.98) < most[1]


@pytest.mark.parametrize("row", [row for row in ROWS if row.startswith("merl")])
def test_merl_is_reciprocal(prober: Prober, row: str) -> None:
    rng = np.random.default_rng(2)
    wo, wi = hemisphere(rng, 2000), hemisphere(rng, 2000)
    there, back = ask(prober, data_of(row), wo, wi)[0], ask(prober, data_of(row), wi, wo)[0]
    np.testing.assert_allclose(there[:, :3] / wi[:, 2:], back[:, :3] / wo[:, 2:], rtol=2e-4)


@pytest.mark.parametrize(("row", "angle"), CASES)
def test_samples_follow_their_pdf_and_carry_the_albedo(prober: Prober, row: str, angle: float) -> None:
    wo, data = at(angle), data_of(row)
    grid = Grid(wo)
    on_grid = ask(prober, data, wo, np.where(grid.solid_angle[:, None] > 0, grid.wi, [0, 0, 1]))[0]
    f, wi = ask(prober, data, wo, np.random.default_rng(3).random((60_000, 3)), 1)
    grid.assert_samples_follow(on_grid, f, wi[:, :3], len(CASES))


def test_meshes_get_tangents_where_a_file_has_a_direction() -> None:
    mesh = {"type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]],
            "uvs": [[0, 0], [1, 0], [0, 1]], "normals": [[0.1, 0, 1], [0, 0.1, 1], [0, 0, 1]],
            "material": "m"}  # fmt: skip
    for row, has_direction in (("rgl rough", False), ("rgl brushed", True)):
        document = {"version": 1, "camera": {"position": [0, 0, 1], "target": [0, 0, 0]}, "shapes": [mesh],
                    "materials": {"m": {"type": "measured", "asset": "a"}}}  # fmt: skip
        arrays = pack(parse_scene(document), Shelf(data_of(row))).arrays
        raised = features.flags(arrays)
        assert arrays.tangents == has_direction
        assert ("HAS_TANGENTS" in raised, "HAS_ANISOTROPIC" in raised) == (has_direction, has_direction)
