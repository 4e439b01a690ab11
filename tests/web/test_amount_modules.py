"""Functions of the page's modules, called in the page: lengths, sliders over decades, sweeps, short numbers."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Page

from tests.web.modules import call

LENGTHS = {
    0.026: "26 mm",
    0.125: "12.5 cm",
    3.0: "3 m",
    0: "0 mm",
    0.00002: "0.02 mm",
    4e-6: "4 µm",
    0.0999: "99.9 mm",
}


@pytest.mark.parametrize("length", LENGTHS)
def test_lengths_are_told_in_the_unit_that_fits(page: Page, length: float) -> None:
    words = LENGTHS[length]
    assert call(page, "lib/lengths.js", "lengthWords", length) == words
    assert call(page, "lib/lengths.js", "parseLength", words, 1) == pytest.approx(length)


@pytest.mark.parametrize(
    ("text", "before", "length"),
    [
        ("30", 0.026, 0.03),
        ("30", 0.2, 0.3),
        ("30", None, 0.03),
        ("2,5 cm", 3, 0.025),
        ("1/8 in", None, 0.003175),
        ("1e-3 m", None, 0.001),
        ("50 %", 1, None),
        ("wide", 1, None),
    ],
)
def test_a_length_may_say_its_unit(page: Page, text: str, before: float | None, length: float | None) -> None:
    found = call(page, "lib/lengths.js", "parseLength", text, before)
    assert found is None if length is None else found == pytest.approx(length)


RANGE = """async ([ends, log]) => {
    const { span } = await import("/lib/span.js");
    const { fromShare, toShare, isLog, min } = span(ends, 0.01, false, log);
    const shares = [0, 0.01, 0.1, 0.3, 0.5, 0.7, 0.9, 1];
    return { isLog, min, values: shares.map(fromShare), back: shares.map((share) => toShare(fromShare(share))) };
}"""


def test_a_slider_of_lengths_goes_by_factors_and_has_a_place_for_zero(page: Page) -> None:
    found = page.evaluate(RANGE, [{"min": 0, "max": 1}, 1e-5])
    values = found["values"]
    assert found["isLog"] and values[:2] == [0, 0] and values[2] > 1e-5 and values[-1] == 1
    assert values[4] / values[3] == pytest.approx(values[5] / values[4], rel=0.02), "equal steps are equal factors"
    assert found["back"][2:] == pytest.approx([0.1, 0.3, 0.5, 0.7, 0.9, 1], abs=0.005)
    without = page.evaluate(RANGE, [{"min": 1e-4, "max": 5}, 1e-4])
    assert without["values"][0] == 1e-4 and without["back"][0] == 0, "where 0 is no value"


@pytest.mark.parametrize(
    ("value", "most", "text"),
    [
        (3.038e-16, 0.9, "0"),
        (-0.03354, 1, "-0.0335"),
        (0.03354, 1, "0.03354"),
        (-123.456, 200, "-123.5"),
        (1.2345e-5, 2e-5, "1.23e-5"),
        (0, 0, "0"),
    ],
)
def test_a_number_of_three_is_as_short_as_its_field(page: Page, value: float, most: float, text: str) -> None:
    assert call(page, "lib/format-text.js", "narrow", value, most) == text


def test_what_is_left_of_a_rounding_is_no_number(page: Page) -> None:
    assert call(page, "lib/vector.js", "tidy", [-0.8, 3.038e-16, 1.23456789]) == [-0.8, 0, 1.234568]
    assert call(page, "lib/vector.js", "tidy", [0, 0, 0]) == [0, 0, 0]
    assert call(page, "lib/vector.js", "tidy", [2e-16, 0, 1e-16]) == [2e-16, 0, 1e-16], "all of it is small"


VALUES = """async ([field, material, ends]) => {
    const { sweepValues, sweepEnds, sweepable, firstOf } = await import("/document/sweep.js");
    const own = [{ open: {}, name: "x", soft: {}, step: 0.01, ...field }];
    return {
        isOffered: sweepable(own, material).length === 1,
        ends: sweepEnds(own, material, own[0]),
        values: sweepValues(own, material, own[0], ends ?? undefined),
    };
}"""
LENGTH = {"widget": "amount", "unit": "m", "log": 1e-4, "soft": {"min": 1e-4, "max": 1}}


def swept(page: Page, field: dict[str, Any], x: Any = None, ends: dict[str, Any] | None = None) -> Any:
    return page.evaluate(VALUES, [field, {} if x is None else {"x": x}, ends])


def test_lengths_are_swept_by_factors(page: Page) -> None:
    found = swept(page, LENGTH)
    assert found["isOffered"] and found["ends"] == {"from": 1e-4, "to": 1}
    ratios = [b / a for a, b in zip(found["values"][:-1], found["values"][1:], strict=True)]
    assert len(found["values"]) == 7 and ratios == pytest.approx([ratios[0]] * 6, rel=0.02)
    between = swept(page, LENGTH, 0.02, {"from": 0.01, "to": 0.08})["values"]
    assert between == pytest.approx([0.01, 0.0141, 0.02, 0.0283, 0.04, 0.0566, 0.08], rel=0.01)
    triple = swept(page, {**LENGTH, "widget": "amounts", "soft": {"max": 1}}, [0.02, 0.01, 0])
    assert [0.02, 0.01, 0] in triple["values"] and [1, 0.5, 0] in triple["values"], "each channel keeps its share"


def test_a_sweep_goes_from_where_to_where_somebody_says(page: Page) -> None:
    plain = {"widget": "slider", "soft": {"min": 0, "max": 1}}
    assert swept(page, plain, 0.9, {"from": 0.1, "to": 0.4})["values"] == [0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4]
    assert 0.33 in swept(page, plain, 0.33, {"from": 0.1, "to": 0.4})["values"]


def test_colours_are_swept_round_the_present_one(page: Page) -> None:
    color = {"widget": "color"}
    red = [0.6, 0.05, 0.05]
    found = swept(page, color, red)
    assert found["isOffered"] and len(found["values"]) == 7 and found["values"][3] == red
    first, last = found["values"][0], found["values"][-1]
    assert first[2] > first[1] and last[1] > last[2], "from crimson or violet to orange or green"
    ends = {"from": [0, 0, 0.8], "to": [0.8, 0.6, 0]}
    chosen = swept(page, color, red, ends)["values"]
    assert chosen[0] == pytest.approx(ends["from"], abs=2e-3) and chosen[-1] == pytest.approx(ends["to"], abs=2e-3)
    bright = swept(page, color, [9, 6, 3])["values"]
    assert all(max(each) > 5 for each in bright), "a lamp stays as strong"


FIRST = """async ([material, touched]) => {
    const { firstOf } = await import("/document/sweep.js");
    const offered = ["base_color", "metallic", "ior", "roughness"].map((name) => ({ name, initial: 0.5 }));
    offered[0].widget = "color";
    return firstOf(offered, material, touched).name;
}"""


def test_a_sweep_begins_with_what_was_touched_last(page: Page) -> None:
    glass = {"base_color": 1, "ior": 1.5}
    assert page.evaluate(FIRST, [glass, "roughness"]) == "roughness"
    assert page.evaluate(FIRST, [glass, None]) == "ior", "else with what the material is about"
    assert page.evaluate(FIRST, [{}, "gone"]) == "metallic"
