"""Frames with a guess in them: who asked for them gets them after an edit, and nothing else ever has one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from tests.serving import SCENE, Client, Picture, Server
from tests.serving import client as opened

# A white room, in which paths take as many bounces as they may: so slow that a first look is small.
ROOM = {
    **SCENE,
    "materials": {**SCENE["materials"], "wall": {"type": "diffuse", "albedo": 0.95}},
    "shapes": [*SCENE["shapes"], {"type": "sphere", "center": [0, 0, 0], "radius": 20, "material": "wall"}],
}
BOUNCES = (2, 4, 8, 16, 32, 64)
ASKS = {"format": "jpeg", "prior": True}
DARK = {"materials": {"ball": {"base_color": [0.05, 0.05, 0.05]}}}


@pytest.fixture(scope="module")
def large(server: Server) -> dict[str, int]:
    """Settings of a picture of which a first look is small here: twice the bounces of the first of which it is."""
    for bounces, more in pairwise(BOUNCES):
        settings = {"width": 640, "height": 480, "max_samples": 1 << 20, "max_bounces": bounces}
        with opened(server) as client:
            client.start(generation=1, scene=ROOM, settings=settings, view={"format": "jpeg"})
            at_rest(client, 1)
            client.say("update", generation=2, scene=DARK)
            if client.frame(2).scale < 1.0:
                return settings | {"max_bounces": more}
    pytest.fail(f"a first look is whole with {BOUNCES[-2]} bounces")


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as connected:
        yield connected


def at_rest(client: Client, generation: int) -> Picture:
    """The first frame of a picture that is worth keeping."""
    while True:
        frame = client.frame(generation)
        if frame.scale == 1.0 and frame.samples >= 20:
            return frame


def frames_to(client: Client, generation: int, samples: int) -> list[Picture]:
    frames = []
    while not frames or frames[-1].scale < 1.0 or frames[-1].samples < samples:
        frames.append(client.frame(generation))
    return frames


def test_a_guess_fades_as_samples_come(client: Client, large: dict[str, int]) -> None:
    client.start(generation=1, scene=ROOM, settings=large, view=ASKS)
    assert "prior" not in at_rest(client, 1).header
    client.say("update", generation=2, scene=DARK)
    frames = frames_to(client, 2, 70)
    first, whole = frames[0], (large["width"], large["height"])
    assert first.scale < 1.0 and first.prior and (first.width, first.height) == whole
    has = ["prior" in frame.header for frame in frames]
    assert has == sorted(has, reverse=True) and not has[-1]
    assert all((frame.width, frame.height) == whole for frame in frames if frame.header.get("prior"))


def test_nobody_else_gets_one(client: Client, large: dict[str, int]) -> None:
    client.start(generation=1, scene=ROOM, settings=large, view={"format": "jpeg"})
    at_rest(client, 1)
    client.say("update", generation=2, scene=DARK)
    first = client.frame(2)
    assert first.scale < 1.0 and "prior" not in first.header and first.width < large["width"]


def test_a_moved_camera_sees_the_old_picture(client: Client, large: dict[str, int]) -> None:
    client.start(generation=1, scene=ROOM, settings=large, view=ASKS)
    generation = 1
    at_rest(client, generation)
    while True:  # the depth is traced once the picture is good enough, and its kernel is compiled
        generation += 1
        client.say("update", generation=generation, scene={"camera": {"position": [0.4, 0.1 * generation, 4]}})
        first = client.frame(generation)
        if "prior" in first.header:
            break
        assert generation < 100
        at_rest(client, generation)
    assert first.scale < 1.0 and first.prior and first.width == large["width"]


def test_where_everything_has_changed_there_is_none(client: Client, large: dict[str, int]) -> None:
    client.start(generation=1, scene=ROOM, settings=large, view=ASKS)
    at_rest(client, 1)
    client.say("update", generation=2, settings={"seed": 5})
    assert "prior" not in client.frame(2).header


def test_what_is_captured_has_none(client: Client, large: dict[str, int], server: Server) -> None:
    client.start(generation=1, scene=ROOM, settings={**large, "max_samples": 24}, view=ASKS)
    client.finished()
    client.say("update", generation=2, scene=DARK)
    done, last = client.finished()
    assert done["generation"] == 2 and "prior" not in last.header
    client.say("view", format="rgba32f")
    raw = client.frame(2)
    scene = {
        **ROOM,
        "materials": {**ROOM["materials"], "ball": ROOM["materials"]["ball"] | DARK["materials"]["ball"]},
    }
    body = {"scene": scene, "settings": {**large, "max_samples": 24}}
    answer = server.http.post("/v1/render?format=npy", json=body)
    assert answer.status_code == 200
    whole = np.frombuffer(answer.content[-raw.array().nbytes :], np.float32).reshape(raw.array().shape)
    np.testing.assert_array_equal(raw.array(), whole)
