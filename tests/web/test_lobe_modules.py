"""The arithmetic of the lobe's panel: directions, scales, files, and the material without its textures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from playwright.sync_api import Page

from tests.web.modules import call


def test_textures_are_replaced_by_their_mean_times_the_factor(page: Page) -> None:
    script = """async () => {
        const { plain, texturesOf } = await import(new URL("lobe/material.js", location));
        const fields = [
            { name: "base_color", title: "Base colour", widget: "color", min: 0, max: 1 },
            { name: "roughness", title: "Roughness", widget: "slider", min: 0, max: 1 },
            { name: "metallic", title: "Metallic", widget: "slider", min: 0, max: 1 },
            { name: "normal_map", title: "Normal map", widget: "texture" },
        ];
        const material = {
            type: "principled", metallic: 0.25, base_color: { texture: "wood", factor: [1, 0.5, 4] },
            roughness: { texture: "wood", channel: "g", factor: 0.5 }, normal_map: { texture: "bumps", scale: 2 },
        };
        const mean = (texture, reads) => (reads === "color" ? [0.2, 0.4, 0.6, 1] : [0.1, 0.3, 0.5, 1]);
        return [plain(material, fields, mean), texturesOf(material, fields), material.base_color.texture];
    }"""
    plain, used, before = page.evaluate(script)
    assert plain["material"] == {
        "type": "principled", "metallic": 0.25, "base_color": [0.2, 0.2, 1], "roughness": 0.15,
    }  # fmt: skip
    assert plain["replaced"] == ["Base colour", "Roughness", "Normal map"]
    assert used == [
        {"texture": "wood", "reads": "color"},
        {"texture": "wood", "reads": "g"},
    ]
    assert before == "wood", "the document itself stays as it is"


@pytest.mark.parametrize("incidence", [0, 37.5, 89.5, 135])
def test_a_sweep_goes_round_and_is_dense_at_the_mirror(page: Page, incidence: float) -> None:
    angles = np.array(call(page, "lobe/directions.js", "sweep", incidence))
    assert (np.diff(angles) > 0).all() and np.diff(angles).max() <= 2.1
    assert angles.min() >= -180 and angles.max() <= 180
    assert np.abs(np.abs(angles) - 90).min() > 0.01, "no direction lies in the surface"
    assert np.isclose(angles, incidence).any()
    assert (np.abs(angles - incidence) < 0.4).sum() >= 5
    directions = np.array([call(page, "lobe/directions.js", "inPlane", float(angle)) for angle in angles[::20]])
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)


def test_a_curve_is_refined_where_it_jumps(page: Page) -> None:
    angles, heights = [0, 10, 20, 30, 30.01], [0, 0.001, 0.9, 0.95, 0.1]
    new = call(page, "lobe/directions.js", "refined", angles, heights, 0.02, 1)
    assert new == pytest.approx([10 + 10 / 3, 10 + 20 / 3]), "the largest jump first, none where it is fine enough"
    assert len(call(page, "lobe/directions.js", "refined", angles, heights, 0.02, 9)) == 4


def test_half_angles_and_directions_agree(page: Page) -> None:
    for half, difference in [(10, 20), (45, 60), (80, 5), (0.5, 89)]:
        found = call(page, "lobe/directions.js", "ofHalf", half, difference)
        wo, wi = (
            np.array(call(page, "lobe/directions.js", "direction", found["theta"], side * found["apart"] / 2))
            for side in (-1, 1)
        )
        middle = (wo + wi) / np.linalg.norm(wo + wi)
        assert math.degrees(math.acos(middle[2])) == pytest.approx(half, abs=1e-3)
        assert math.degrees(math.acos(wo @ middle)) == pytest.approx(difference, abs=1e-3)
        apart = call(page, "lobe/slice.js", "apartAt", found["theta"], half)
        assert apart == pytest.approx(found["apart"], abs=1e-6)


def test_the_slice_reads_between_its_rows(page: Page) -> None:
    script = """async () => {
        const { lookUp } = await import(new URL("lobe/slice.js", location));
        const rows = Array.from({ length: 36 }, (_, i) => ((i + 0.5) / 36) * 89.8);
        // A value that is the half angle in red and the angle to the normal in green.
        const values = rows.map((theta) => Array.from({ length: 40 }, (_, j) => [theta * (j / 39) ** 2, theta, 0]));
        return [[20, 30], [3, 70], [60, 60]].map(([h, d]) => lookUp(values, h, d));
    }"""
    for (half, difference), (red, green, _) in zip([(20, 30), (3, 70), (60, 60)], page.evaluate(script), strict=True):
        theta = math.degrees(math.acos(math.cos(math.radians(half)) * math.cos(math.radians(difference))))
        assert red == pytest.approx(half, abs=0.1) and green == pytest.approx(theta, abs=1e-6)


@pytest.mark.parametrize(("power", "expected"), [(0, 1.0), (2, 0.5)])
def test_the_furnace_is_the_mean_under_uniform_light(page: Page, power: int, expected: float) -> None:
    """An albedo mu^n gives 2 / (n + 2)."""
    angles = [*range(0, 90, 5), 87, 88.5, 89.5]
    values = [math.cos(math.radians(angle)) ** power for angle in angles]
    number = call(page, "lobe/albedo.js", "furnace", values, [0.01] * len(values))
    assert number["value"] == pytest.approx(expected, abs=1e-4)
    assert 0 < number["error"] < 0.01, "independent errors add as squares"


@pytest.mark.parametrize(
    ("given", "expected"), [(0, "0"), (0.05, "0.05"), (20, "20"), (1e-4, "10⁻⁴"), (25000, "2.5·10⁴"), (1e6, "10⁶")]
)
def test_ticks_are_written_short(page: Page, given: float, expected: str) -> None:
    assert call(page, "lobe/plot.js", "tickText", given) == expected


def test_ticks_are_round_and_inside(page: Page) -> None:
    assert call(page, "lobe/plot.js", "ticks", 0, 1.05, 5) == [0, 0.2, 0.4, 0.6, 0.8, 1]
    assert call(page, "lobe/plot.js", "ticks", 0, 90, 6) == [0, 20, 40, 60, 80]
    assert call(page, "lobe/plot.js", "decades", 1e-4, 100, 4) == [1e-4, 0.01, 1, 100]
    assert call(page, "lobe/plot.js", "niceCeiling", 3.1) == 5


def test_a_logarithmic_scale_reaches_down_to_the_faint_part(page: Page) -> None:
    values = [0.2] * 90 + [3000.0]
    scale = call(page, "lobe/values.js", "scaleOf", values, True)
    assert scale == {"most": 10000, "decades": 6}
    shares = [call(page, "lobe/values.js", "share", value, scale) for value in (0.2, 3000, 0)]
    assert 0.1 < shares[0] < 0.3 and 0.8 < shares[1] < 1 and shares[2] == 0
    linear = call(page, "lobe/values.js", "scaleOf", values, False)
    assert call(page, "lobe/values.js", "share", 3000, linear) == pytest.approx(0.6)


def test_numbers_leave_as_comma_separated_values(page: Page) -> None:
    text = call(page, "lobe/files.js", "csv", {"columns": ["theta_deg", "f_r"], "rows": [[0, 1 / 3], [0.5, None]]})
    assert text == "theta_deg,f_r\r\n0,0.3333333\r\n0.5,\r\n"


def test_only_the_newest_work_is_done_and_none_starves(page: Page) -> None:
    script = """async () => {
        const { Latest } = await import(new URL("lobe/latest.js", location));
        const latest = new Latest();
        const done = [];
        const job = (name) => async (isStale) => {
            await new Promise((resolve) => setTimeout(resolve, 10));
            done.push([name, isStale()]);
        };
        const all = latest.want(job(1));
        latest.want(job(2));
        latest.want(job(3));
        await all;
        return done;
    }"""
    assert page.evaluate(script) == [[1, True], [3, False]]


def faces(page: Page, thetas: int, phis: int) -> list[list[int]]:
    found: list[list[int]] = call(page, "lobe/solid.js", "faces", thetas, phis)
    return found


def test_the_solid_is_closed_but_for_its_rim(page: Page) -> None:
    """Every edge belongs to two faces, except those of the last ring."""
    thetas, phis = 4, 6
    edges: dict[tuple[int, int], int] = {}
    for face in faces(page, thetas, phis):
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            edge = (min(a, b), max(a, b))
            edges[edge] = edges.get(edge, 0) + 1
    rim = {edge for edge, count in edges.items() if count == 1}
    assert len(rim) == phis and all(min(edge) > (thetas - 1) * phis for edge in rim)
    assert set(edges.values()) == {1, 2}
