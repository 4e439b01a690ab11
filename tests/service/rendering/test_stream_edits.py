"""What updates do on the stream, against a real server, and those that are refused."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from tests.serving import ENDLESS, PATIENCE_S, SCENE, SMALL, Client, Picture, Server
from tests.serving import client as opened
from tests.streams import RAW, pictures, rises

UNKNOWN = "sha256:" + "0" * 64


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as connected:
        yield connected


def test_nothing_of_an_older_generation_after_an_update_was_taken(client: Client) -> None:
    client.start(settings=ENDLESS)
    client.frame()
    for generation in range(2, 12):
        roughness = {"materials": {"ball": {"roughness": generation / 12}}}
        client.say("update", generation=generation, scene=roughness)
        client.say("ping")
        client.until("pong")
        frames = [client.frame() for _ in range(2)]
        assert all(frame.generation == generation for frame in frames)
        assert frames[0].samples <= frames[1].samples


def test_a_drag_is_seen_while_it_lasts(client: Client) -> None:
    """Sixty updates a second, faster than frames: none of them may stop all its predecessors' frames."""
    client.start(settings={**ENDLESS, "width": 256, "height": 256})
    client.frame()
    seen: list[Picture] = []
    generation, until = 1, time.monotonic() + PATIENCE_S
    while len({frame.generation for frame in seen}) < 5:
        assert time.monotonic() < until
        generation += 1
        camera = {"camera": {"position": [np.sin(generation / 30), 0, 4]}}
        client.say("update", generation=generation, scene=camera)
        seen += pictures(client.silence(1 / 60))
    while seen[-1].generation < generation:
        seen.append(client.frame())
    assert rises(seen)


def test_an_update_patches_and_starts_again(client: Client) -> None:
    client.start(view=RAW)
    before = client.finished()[1].array()
    client.say("update", generation=2, scene={"environment": None, "lights": []})
    done, dark = client.finished()
    assert done["generation"] == 2 and before.max() > 0.1 and not dark.array()[..., :3].any()
    client.say("update", generation=3, scene={"environment": SCENE["environment"], "lights": SCENE["lights"]})
    assert np.array_equal(client.finished()[1].array(), before)


def test_names_and_what_nothing_wears_leave_the_picture_as_it_is(client: Client) -> None:
    """A material gets another name, which a patch puts at the end, and another one comes that no shape wears."""
    ball, floor = (SCENE["materials"][name] for name in ("ball", "floor"))
    client.start(settings=ENDLESS, view={**RAW, "aov": "material_id"})
    while (before := client.frame()).samples < 8:
        pass
    film = {"type": "openpbr", "thin_film_weight": 1, "subsurface_weight": 0.5}
    names = {"ball": "Gold", "floor": "floor"}
    shapes = [{**each, "material": names[each["material"]]} for each in SCENE["shapes"]]
    patch = {"materials": {"ball": None, "spare": film, "Gold": ball}, "shapes": shapes}
    client.say("update", generation=2, scene=patch)
    after = client.frame(generation=2)
    assert after.samples >= before.samples
    numbers = {"floor": 1, "spare": 2, "Gold": 3}
    was, now = (each.array()[..., 0] for each in (before, after))
    assert set(np.unique(was)) >= {1, 2} and np.array_equal(now == numbers["Gold"], was == 1)
    assert np.array_equal(now == numbers["floor"], was == 2)
    client.say("update", generation=3, scene={"materials": {"floor": {**floor, "albedo": 0.2}}})
    assert client.frame(generation=3).samples < after.samples, "that is seen"


def test_limits_do_not_start_again(client: Client) -> None:
    client.start()
    client.finished()
    client.say("update", generation=2, settings={"max_samples": 500})
    done, frames = client.until("done")
    assert done["generation"] == 2 and done["samples"] == 500
    assert frames and all(frame.samples >= 8 for frame in frames)
    client.say("update", generation=3, settings={"seed": 5})
    assert client.frame(generation=3).samples < 500


def test_size_may_change(client: Client) -> None:
    client.start()
    client.finished()
    client.say("update", generation=2, settings={"width": 50, "quality": "draft"})
    done, last = client.finished()
    assert (last.width, last.height) == (50, 24) and done["samples"] == 8


@pytest.mark.parametrize(
    ("patch", "pointer"),
    [
        ({"scene": {"materials": {"ball": {"roughness": 2}}}}, "/scene/materials/ball/roughness"),
        ({"scene": {"materials": {"ball": {"type": "lambert"}}}}, "/scene/materials/ball/type"),
        ({"scene": {"camera": {"position": [0, 0, float("nan")]}}}, "/scene/camera/position"),
        ({"scene": {"shapes": [{"type": "mesh", "asset": UNKNOWN, "material": "ball"}]}}, "/scene/shapes/0/asset"),
        ({"settings": {"width": 0}}, "/settings/width"),
        ({"settings": {"denoise": 1}}, "/settings/denoise"),
        ({"scenery": {}}, "/scenery"),
    ],
)
def test_a_bad_update_leaves_the_last_valid_scene(client: Client, patch: dict[str, Any], pointer: str) -> None:
    client.start(view=RAW)
    before = client.finished()[1].array()
    client.say("update", generation=2, **patch)
    error, frames = client.until("error")
    assert error["generation"] in (2, 1) and not frames
    problem = error["problem"]
    assert problem["status"] == 422 and problem["errors"][0]["pointer"] == pointer, problem
    client.say("view", exposure=0)
    frame = client.frame()
    assert frame.generation == 1 and np.array_equal(frame.array(), before)
    client.say("update", generation=2, settings={"seed": 1})
    assert client.finished()[0]["generation"] == 2


def test_a_bad_start_leaves_the_stream_open(client: Client) -> None:
    client.start(scene={"version": 1})
    error, _ = client.until("error")
    pointers = {entry["pointer"] for entry in error["problem"]["errors"]}
    assert error["generation"] == 1 and {"/scene/camera", "/scene/shapes"} < pointers
    client.say("update", generation=2, scene={})
    assert client.until("error")[0]["problem"]["status"] == 409
    client.start(generation=3)
    assert client.finished()[0]["generation"] == 3


def test_a_generation_must_rise(client: Client) -> None:
    client.start(generation=5)
    client.finished()
    for generation in (5, 4, -1):
        client.say("update", generation=generation, settings={"seed": 3})
        error, _ = client.until("error")
        assert error["problem"]["errors"][0]["pointer"] == "/generation"
    client.start(generation=5)
    assert client.until("error")
    assert not pictures(client.silence(0.2)), "a refused update changed something"


def test_edits_give_the_picture_of_a_new_start(client: Client) -> None:
    """Camera, materials, the environment's turn and shapes edited one by one, against all of it at once."""
    client.start(view=RAW, settings={**SMALL, "max_samples": 16})
    client.frame()
    patches: list[dict[str, Any]] = [
        {"camera": {"position": [1, 1, 4], "vfov": 50}},
        {"materials": {"ball": {"roughness": 0.2, "metallic": 1.0}}},
        {"environment": {"rotation": 40, "scale": 1.5}},
        {"materials": {"floor": {"albedo": [0.2, 0.4, 0.6]}}, "camera": {"aperture_radius": 0.05}},
        {"shapes": [{**SCENE["shapes"][0], "radius": 0.8}, SCENE["shapes"][1]]},
        {"materials": {"ball": {"clearcoat": 0.5}}, "environment": {"scale": 0.7}},
    ]
    whole = json.loads(json.dumps(SCENE))
    for generation, patch in enumerate(patches, 2):
        client.say("update", generation=generation, scene=patch)
        for key, value in patch.items():
            if key == "materials":
                for name, change in value.items():
                    whole[key][name].update(change)
            elif isinstance(value, dict):
                whole[key].update(value)
            else:
                whole[key] = value
    while client.until("done")[0]["generation"] <= len(patches):
        pass
    client.say("view", exposure=0)
    edited = client.frame()
    client.start(generation=20, scene=whole, settings={**SMALL, "max_samples": 16})
    done, fresh = client.finished()
    assert done["generation"] == 20 and edited.samples == fresh.samples == 16
    assert np.array_equal(edited.array(), fresh.array())


def test_a_heavy_picture_is_first_seen_small(client: Client) -> None:
    client.start(settings={"width": 1200, "height": 800, "max_samples": 3})
    frames: list[Picture] = []
    while not frames or frames[-1].scale < 1:
        frames.append(client.frame())
    client.say("update", generation=2, scene={"camera": {"vfov": 50}})
    frames.append(client.frame(generation=2))
    assert frames[0].scale < 1 and frames[-1].scale < 1
    assert all((f.width, f.height) == (round(1200 * f.scale), round(800 * f.scale)) for f in frames)
    while frames[-1].scale < 1:
        frames.append(client.frame(generation=2))
    assert rises(frames)
