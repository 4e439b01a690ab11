"""The editor's own arithmetic, module by module, in the browser that runs it."""

from __future__ import annotations

import base64
import math
import random
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page

from service import displays
from service.document.transform import Transform
from service.formats import images
from tests.web.modules import call


def document(chance: random.Random, depth: int = 3) -> Any:
    kind = chance.choice(["object", "object", "array", "leaf"]) if depth else "leaf"
    if kind == "object":
        typed = {"type": chance.choice("ab")} if chance.random() < 0.4 else {}
        return typed | {key: document(chance, depth - 1) for key in chance.sample("xyzw", chance.randint(0, 3))}
    if kind == "array":
        return [document(chance, depth - 1) for _ in range(chance.randint(0, 2))]
    return chance.choice([0, 1.5, "s", True, "~/"])


def without_lost_types(before: Any, after: Any) -> bool:
    """False where a type appears or vanishes on an object that stays: no document of ours does that."""
    if not (isinstance(before, dict) and isinstance(after, dict)):
        return True
    return ("type" in before) == ("type" in after) and all(
        without_lost_types(before[key], after[key]) for key in before.keys() & after.keys()
    )


def test_a_diff_leads_from_one_document_to_the_other(page: Page) -> None:
    chance = random.Random(3)
    pairs = [({"r": document(chance)}, {"r": document(chance)}) for _ in range(300)]
    pairs = [pair for pair in pairs if without_lost_types(*pair)]
    assert len(pairs) > 100
    results = page.evaluate(
        """async (pairs) => {
        const { merge, diff } = await import(new URL("lib/patch.js", location));
        return pairs.map(([from, to]) => {
            const patch = diff(from, to);
            return { merged: patch === undefined ? from : merge(from, patch), none: patch === undefined };
        });
    }""",
        [list(pair) for pair in pairs],
    )
    for (before, after), result in zip(pairs, results, strict=True):
        assert result["merged"] == after
        assert result["none"] == (before == after)


def test_a_diff_is_small(page: Page) -> None:
    before = {"materials": {"a": {"type": "disney", "roughness": 1, "metallic": 0}, "b": {"type": "diffuse"}}}
    after = {"materials": {"a": {"type": "disney", "roughness": 0.3}, "b": {"type": "diffuse"}}}
    changed = call(page, "lib/patch.js", "diff", before, after)
    assert changed == {"materials": {"a": {"roughness": 0.3, "metallic": None}}}
    other = {"materials": {"a": {"type": "diffuse"}, "b": {"type": "diffuse"}}}
    assert call(page, "lib/patch.js", "diff", before, other) == {"materials": {"a": {"type": "diffuse"}}}
    assert call(page, "lib/patch.js", "diff", before, before) == "undefined"


def test_pointers(page: Page) -> None:
    name = "a/b~c"
    place = call(page, "lib/patch.js", "pointer", "materials", name, "albedo")
    assert place == "/materials/a~1b~0c/albedo"
    assert call(page, "lib/patch.js", "put", {"materials": {name: {}}}, place, 0.5) == {
        "materials": {name: {"albedo": 0.5}}
    }
    assert call(page, "lib/patch.js", "at", {"materials": {name: {"albedo": 0.25}}}, place) == 0.25


@pytest.mark.parametrize("byte", [0, 1, 10, 11, 128, 254, 255])
def test_srgb_there_and_back(page: Page, byte: int) -> None:
    text = f"#{byte:02x}8001"
    linear = call(page, "lib/color.js", "linear", text)
    encoded = byte / 255
    assert math.isclose(linear[0], encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4)
    assert call(page, "lib/color.js", "hex", linear) == text


CAMERA: dict[str, Any] = {"position": [1.0, 2.0, 5.0], "target": [0.0, 1.0, 0.0], "up": [0.0, 1.0, 0.0], "vfov": 40}


def test_orbiting_keeps_the_distance_and_the_poles(page: Page) -> None:
    distance = math.dist(CAMERA["position"], CAMERA["target"])
    for right, down in [(0.3, 0), (0, 0.2), (-2, 5), (1, -5)]:
        moved = call(page, "document/camera.js", "orbit", CAMERA, right, down)
        assert math.isclose(math.dist(moved["position"], CAMERA["target"]), distance, rel_tol=1e-5)
        height = (moved["position"][1] - 1) / distance
        assert abs(height) < math.cos(math.radians(1.9)), "the view must keep an up"
    right = call(page, "document/camera.js", "orbit", CAMERA | {"position": [0, 1, 5]}, 0.1, 0)
    assert right["position"][0] < 0, "the content follows the hand to the right"


def test_panning_follows_the_hand(page: Page) -> None:
    camera = CAMERA | {"position": [0.0, 1.0, 5.0]}
    moved = call(page, "document/camera.js", "pan", camera, 0.5, 0.25)
    height = 2 * 5 * math.tan(math.radians(20))
    assert moved["target"] == pytest.approx([-0.5 * height, 1 + 0.25 * height, 0])
    assert moved["position"] == pytest.approx([-0.5 * height, 1 + 0.25 * height, 5])


def test_the_picture_fills_its_box_within_an_area(page: Page) -> None:
    size = call(page, "document/picture-view.js", "pictureSize", {"width": 1200, "height": 800}, 2, 512 * 512)
    assert size["width"] * size["height"] == pytest.approx(512 * 512, rel=0.01)
    assert size["width"] / size["height"] == pytest.approx(1.5, rel=0.01)
    box = {"width": 1091, "height": 825}
    size = call(page, "document/picture-view.js", "pictureSize", box, 1, 512 * 512)
    left_over = box["width"] - box["height"] * size["width"] / size["height"]
    assert abs(left_over) < 0.25, "no line of a pixel beside the picture"
    assert call(page, "document/picture-view.js", "pictureSize", {"width": 300, "height": 200}, 1, 512 * 512) == {
        "width": 300,
        "height": 200,
    }


def test_the_final_frame_is_always_in_the_picture(page: Page) -> None:
    stage, camera = {"width": 866, "height": 727}, {"type": "perspective"}
    for width, height, is_whole in ((1920, 1080, False), (866, 727, True), (1080, 1080, True), (1080, 1920, True)):
        frame = {"width": width, "height": height}
        assert call(page, "document/picture-view.js", "fillsBox", stage, frame, camera) is is_whole, frame
    assert not call(page, "document/picture-view.js", "fillsBox", stage, stage, {"type": "panorama"})
    areas = [
        call(page, "document/picture-view.js", "liveArea", {"software": software}, denoised)
        for software, denoised in ((True, False), (True, True), (False, False))
    ]
    assert areas == [512 * 512, 768 * 768, 1920 * 1080]


def test_a_preset_costs_what_this_scene_takes_and_before_that_what_the_list_says(page: Page) -> None:
    cost = {
        "seconds": 24.0, "noise": 0.039, "size": 512, "missing_light": 0.0004,
        "worst_missing_light": {"share": 0.0296, "scene": "glass"},
    }  # fmt: skip
    preset = {"max_samples": 256, "max_bounces": 8, "cost": cost}

    def price(live: Any) -> Any:
        at = {"live": live, "size": {"width": 1024, "height": 512}}
        return call(page, "forms/quality.js", "priceOf", preset, at)

    listed = {"seconds": 48.0, "noise": 0.039, "isListed": True}
    assert price(None) == listed, "twice the pixels"
    live = {"samples": 64, "scale": 1, "elapsed_s": 10, "noise": 0.08, "width": 256, "height": 256}
    assert price(live | {"scale": 0.25}) == listed, "a preview tells nothing of the picture's price"
    assert price(live) == {"seconds": 320.0, "noise": 0.04, "isListed": False}
    assert call(page, "forms/quality.js", "taken", preset).replace("\u00a0", " ") == (
        "256 samples, 8 bounces; beyond them under 0.05 %, in glass 3 %, of the listed scenes' light is missing"
    )
    presets = {name: {"max_samples": 4**i} for i, name in enumerate(["a", "b", "c", "d", "e"], 2)}
    assert call(page, "forms/quality.js", "words", presets, "c") == {"b": "Fast", "c": "Clean", "e": "Reference"}


def test_a_size_is_found_by_its_name_and_keeps_a_shape(page: Page) -> None:
    def sizes(name: str, *arguments: Any) -> Any:
        return call(page, "renders/sizes.js", name, *arguments)

    here = {"width": 900, "height": 700}
    assert sizes("sizeOf", "4k", here) == {"width": 3840, "height": 2160}
    assert sizes("sizeOf", "window", here, {"width": 5, "height": 4}) == {"width": 5, "height": 4}
    assert sizes("withSide", "custom", here, "width", 64) == {"width": 64, "height": 700}
    assert sizes("withSide", "2:3", here, "width", 64) == {"width": 64, "height": 96}
    assert sizes("withSide", "2:3", here, "height", 96) == {"width": 64, "height": 96}
    assert sizes("choiceOf", {"width": 1080, "height": 1920}, "custom") == "story"
    assert sizes("choiceOf", {"width": 64, "height": 96}, "2:3") == "2:3"
    assert sizes("choiceOf", {"width": 65, "height": 90}, "2:3") == "custom"
    assert sizes("choiceOf", here, "window", here) == "window" and sizes("choiceOf", here, "hd", here) == "custom"


def test_a_bar_never_goes_back_and_the_time_left_does_not_jump(page: Page) -> None:
    script = """async (statuses) => {
        const { Advance } = await import(new URL("renders/advance.js", location));
        const advance = new Advance();
        return statuses.map((status, now) => {
            const usual = { state: "running", noise: null, elapsed_s: now, settings: { max_samples: 100 } };
            advance.take({ ...usual, ...status }, now);
            return [advance.share, advance.left(now)];
        });
    }"""
    chance = random.Random(3)
    taken = [min(100, i) for i in range(60)]
    statuses = [{"samples": n, "eta_s": (100 - n) * chance.uniform(0.5, 2)} for n in taken]
    statuses[30]["samples"] = 12  # the server was restarted, and goes on from what it had stored
    shown = page.evaluate(script, statuses)
    shares, lefts = zip(*shown, strict=True)
    assert list(shares) == sorted(shares) and shares[-1] == 0.59
    estimates = [status["eta_s"] for status in statuses]
    leaps = [abs(b - a) for a, b in pairwise(estimates)]
    steps = [abs(b - a) for a, b in pairwise(lefts)]
    assert max(steps) < 0.1 * max(leaps) and max(steps) < 9, "seconds, from one second to the next"
    assert lefts[-1] == pytest.approx(1.25 * 41, rel=0.4), "and it says what the estimates say in the mean"
    timed = {"samples": 8, "eta_s": None, "settings": {"time_limit": 4}}
    done = {"state": "done", "samples": 9, "eta_s": 0}
    assert page.evaluate(script, [timed, timed, done]) == [[0, None], [0.25, None], [1, None]]
    assert page.evaluate(script, [{"samples": 0, "eta_s": None}]) == [[0, None]]


def test_a_file_is_named_by_scene_size_and_samples(page: Page) -> None:
    def name(title: str) -> Any:
        return call(
            page, "document/file-name.js", "pictureFile", title, {"width": 8, "height": 6, "samples": 1}, "png"
        )

    assert name("Sphere on a floor") == "Sphere-on-a-floor-8x6-1.png"
    assert name("../Übung: rund/eckig ") == "Übung-rund-eckig-8x6-1.png"
    assert name("…") == "scene-8x6-1.png"


def test_a_matrix_is_told_as_move_turn_and_scale(page: Page) -> None:
    chance = random.Random(5)
    cases = [Transform(), Transform(rotate=(0, 90, 0)), Transform(rotate=(30, -90, 0)), Transform(scale=(1, 1, -2))]
    for _ in range(40):
        turn = tuple(chance.choice([chance.uniform(-180, 180), 0, 90, -90, 180]) for _ in range(3))
        size = tuple(chance.choice([-1, 1]) * 10 ** chance.uniform(-3, 2) for _ in range(3))
        cases.append(Transform(translate=tuple(chance.uniform(-9, 9) for _ in range(3)), rotate=turn, scale=size))
    for case in cases:
        matrix = case.matrix4()
        told = call(page, "document/transforms.js", "parts", matrix.astype(np.float32).reshape(-1).tolist())
        again = Transform(**{name: tuple(values) for name, values in told.items()}).matrix4()
        assert np.abs(again - matrix).max() < 2e-6 * np.abs(matrix).max(), case
    assert call(page, "document/transforms.js", "parts", cases[3].matrix4().reshape(-1).tolist()) == {
        "translate": [0, 0, 0], "rotate": [0, 0, 0], "scale": [1, 1, -2],
    }  # fmt: skip


def test_a_skewing_matrix_can_only_be_moved(page: Page) -> None:
    skewed = [1, 0.5, 0, 3, 0, 1, 0, 4, 0, 0, 1, 5, 0, 0, 0, 1]
    assert call(page, "document/transforms.js", "parts", skewed) is None
    assert call(page, "document/transforms.js", "shown", {"matrix": skewed}) == {"translate": [3, 4, 5]}
    moved = call(page, "document/transforms.js", "changed", {"matrix": skewed}, "translate", [7, 8, 9])["matrix"]
    assert moved == [1, 0.5, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9, 0, 0, 0, 1]


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ({"type": "sphere", "center": [1, 2, 3], "radius": 1}, {"center": [2, 2, 1]}),
        ({"type": "disk", "center": [1, 2, 3], "normal": [0, 1, 0], "radius": 1}, {"center": [2, 2, 1]}),
        ({"type": "cylinder", "base": [1, 2, 3], "axis": [0, 1, 0], "radius": 1}, {"base": [2, 2, 1]}),
        ({"type": "box", "min": [0, 0, 0], "max": [1, 1, 1]}, {"min": [1, 0, -2], "max": [2, 1, -1]}),
        ({"type": "quad", "origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 0, 1]}, {"origin": [1, 0, -2]}),
        ({"type": "mesh", "asset": "a"}, {"transform": {"translate": [1, 0, -2]}}),
        (
            {"type": "sphere", "center": [1, 2, 3], "radius": 1, "transform": {"translate": [4, 0, 0], "scale": 2}},
            {"transform": {"translate": [5, 0, -2], "scale": 2}},
        ),
    ],
)
def test_shapes_are_moved(page: Page, shape: dict[str, Any], expected: dict[str, Any]) -> None:
    assert call(page, "document/moving.js", "moved", shape, [1, 0, -2]) == shape | expected


NUMBERS = {
    "0.35": 0.35, "0,35": 0.35, ",5": 0.5, "1e-3": 0.001, "\u22122": -2, "1/3": 0.333333333333, "50%": 0.5,
    "12,5 %": 0.125, "2*(1+.5)-1": 2, "16 777 216": 16777216, "1,000": 1, "-0,25": -0.25,
    "abc": None, "": None, "1,234.5": None, "1,2,3": None, "1/0": None, "2 3": None, "5 m": None,
    "(1": None, "1e": None,
}  # fmt: skip


@pytest.mark.parametrize("text", NUMBERS)
def test_numbers_are_read_as_people_write_them(page: Page, text: str) -> None:
    assert call(page, "lib/number.js", "parseNumber", text) == NUMBERS[text]


def test_a_number_may_say_its_own_unit_and_no_share_of_it(page: Page) -> None:
    assert call(page, "lib/number.js", "parseNumber", "30\u00b0", "\u00b0") == 30
    assert call(page, "lib/number.js", "parseNumber", "50%", "\u00b0") is None
    for text, unit, number in (
        ("1 + 20 cm", "m", 1.2),
        ("3mm / 2", "m", 0.0015),
        ("3.14159265359 rad", "\u00b0", 180),
        ("1,5 min", "s", 90),
        ("2 W/(m\u00b2 sr)", "W/(m\u00b2 sr)", 2),
        ("512 px", "pixels", 512),
    ):
        assert call(page, "lib/number.js", "parseNumber", text, unit) == pytest.approx(number), text
    for text, unit in (("2 cm", ""), ("2 furlongs", "m"), ("2 cm", "\u00b0"), ("cm", "m")):
        assert call(page, "lib/number.js", "parseNumber", text, unit) is None, text


def test_colours_are_read_as_people_write_them(page: Page) -> None:
    blue = call(page, "lib/color.js", "parseColor", "#00aaff")
    assert blue == pytest.approx([0, 0.401978, 1], abs=1e-5)
    for text in ("#0af", "0af", "00AAFF", " rgb(0, 170, 255) ", "rgb(0 170 255)", "hsl(200 100% 50%)"):
        assert call(page, "lib/color.js", "parseColor", text) == blue, text
    assert call(page, "lib/color.js", "parseColor", "white") == [1, 1, 1]
    for text in ("", "blau", "0.2 0.4 0.6", "#0a", "rgb(0 0 0 / 50%)", "inherit", "url(x)"):
        assert call(page, "lib/color.js", "parseColor", text) is None, text


TRIPLES = ["0.2 0.4 0.6", "0,2 0,4 0,6", "0.2, 0.4, 0.6", "0.2,0.4,0.6", "0,2; 0,4; 0,6", "20% 2/5 .6"]


@pytest.mark.parametrize("text", TRIPLES)
def test_colours_are_three_numbers_however_parted(page: Page, text: str) -> None:
    assert call(page, "lib/number.js", "parseTriple", text) == [0.2, 0.4, 0.6]


def test_a_scene_is_added_under_free_names(page: Page) -> None:
    paint = {"type": "diffuse", "albedo": {"texture": "wood", "factor": 0.5}}
    scene = {"materials": {"paint": {"type": "diffuse"}}, "textures": {"wood": {"asset": "a"}}, "shapes": []}
    other = {
        "materials": {"paint": paint, "paint-2": {"type": "diffuse", "normal_map": {"texture": "bumps"}}},
        "textures": {"wood": {"asset": "b"}, "bumps": {"asset": "c"}},
        "shapes": [
            {"type": "mesh", "asset": "m", "material": "paint"},
            {"type": "mesh", "asset": "n", "material": "paint-2"},
        ],
    }
    taken = call(page, "document/merging.js", "adapted", other, scene)
    assert taken["textures"] == {"wood-2": {"asset": "b"}, "bumps": {"asset": "c"}}
    assert taken["materials"] == {
        "paint-2": paint | {"albedo": {"texture": "wood-2", "factor": 0.5}},
        "paint-3": {"type": "diffuse", "normal_map": {"texture": "bumps"}},
    }
    assert [shape["material"] for shape in taken["shapes"]] == ["paint-2", "paint-3"]


@pytest.mark.parametrize("gamut", ["srgb", "p3"])
def test_a_canvas_keeps_what_the_screen_shows(page: Page, gamut: str) -> None:
    """A red beyond sRGB's stays on the canvas of a wide screen; what is read from it is sRGB in any case."""
    features = [{"name": "color-gamut", "value": gamut}]
    page.context.new_cdp_session(page).send("Emulation.setEmulatedMedia", {"features": features})
    page.reload()
    red = np.zeros((8, 8, 3), np.uint8) + np.uint8([255, 0, 0])
    picture = base64.b64encode(images.encode(red, "png", encoding=displays.DISPLAY_P3)).decode()
    found = page.evaluate(
        """async (picture) => {
        const { Viewport } = await import(new URL("picture/viewport.js", location));
        const { viewOf } = await import(new URL("document/picture-view.js", location));
        const canvas = document.createElementNS("http://www.w3.org/1999/xhtml", "canvas");
        const bytes = Uint8Array.from(atob(picture), (each) => each.charCodeAt(0));
        const painted = new Promise((painted) => {
            const header = { seq: 0, width: 8, height: 8, scale: 1, mime: "image/png" };
            const view = { aov: "color", format: "png" };
            const viewport = new Viewport(canvas, { painted: () => painted(viewport), names: () => [] });
            viewport.show(header, bytes, view, () => {});
        });
        const srgb = (await painted).pixel({ x: 0.5, y: 0.5 });
        const wide = canvas.getContext("2d").getImageData(4, 4, 1, 1, { colorSpace: "display-p3" }).data;
        const asked = viewOf({ layer: "color" }, {}, {});
        return { srgb, wide: [...wide], asked: asked.color_space };
    }""",
        picture,
    )
    assert found["srgb"] == [255, 0, 0, 255]
    assert (found["wide"][0] > 250) == (gamut == "p3")
    assert found["asked"] == {"p3": "display_p3", "srgb": "srgb"}[gamut]


def test_values_that_stand_together_come_and_go_together(page: Page) -> None:
    partner = {"name": "conductor_k", "example": [3, 2, 2]}
    pair = call(page, "document/materials.js", "paired", {"type": "p"}, "conductor_eta", [1, 1, 1], partner)
    assert pair == {"type": "p", "conductor_eta": [1, 1, 1], "conductor_k": [3, 2, 2]}
    other = call(
        page, "document/materials.js", "paired", pair | {"conductor_k": [9, 9, 9]}, "conductor_eta", 2, partner
    )
    assert other == {"type": "p", "conductor_eta": 2, "conductor_k": [9, 9, 9]}
    assert call(page, "document/materials.js", "paired", other, "conductor_eta", None, partner) == {"type": "p"}


def test_nothing_blurred_follows_on_a_sharp_picture_unless_somebody_acts(page: Page) -> None:
    seen = """async (steps) => {
        const { LastPicture } = await import("/panels/last-picture.js");
        const stage = document.createElement("div");
        const image = document.createElement("img");
        image.hidden = steps.includes("nothing kept");
        const picture = new LastPicture(image, stage);
        return steps.map((step) => {
            if (typeof step === "object") picture.painted(step);
            else if (step === "done") picture.end();
            else dispatchEvent(new Event(step));
            return stage.classList.contains("live");
        });
    }"""
    preview, noisy, clean = {"scale": 0.25, "noise": 0.01}, {"scale": 1, "noise": 0.3}, {"scale": 1, "noise": 0.19}
    first = {"scale": 1, "noise": None}
    for name, (steps, expected) in {
        "it waits until it is clean": ([preview, first, noisy, clean, noisy], [0, 0, 0, 1, 1]),
        "whoever touches the page sees it": ([preview, "pointerdown"], [0, 1]),
        "a touch before it": (["keydown", preview], [0, 1]),
        "all its samples": (["done", first, "done"], [0, 0, 1]),
        "nothing kept": (["nothing kept", preview], [0, 1]),
    }.items():
        assert page.evaluate(seen, steps) == [bool(each) for each in expected], name
