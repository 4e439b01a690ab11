"""The rules of the stream, against a real server."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed

from tests.serving import ENDLESS, SCENE, SMALL, Client, Picture, Server
from tests.serving import client as opened

RAW = {"format": "rgba32f"}
UNKNOWN = "sha256:" + "0" * 64


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as connected:
        yield connected


def pictures(heard: list[Any]) -> list[Picture]:
    return [message for message in heard if isinstance(message, Picture)]


def rises(frames: list[Picture]) -> bool:
    """Whether generation, then scale, then samples never fall, and the numbers are consecutive."""
    keys = [(frame.generation, frame.scale, frame.samples) for frame in frames]
    numbers = [frame.seq for frame in frames]
    return keys == sorted(keys) and numbers == list(range(numbers[0], numbers[0] + len(numbers)))


def test_hello_says_what_info_says(server: Server) -> None:
    stream = Client(server.url)
    with stream.socket:
        hello = stream.hear()
        assert isinstance(hello, dict) and hello.pop("type") == "hello"
        assert len(hello.pop("session")) >= 32
        assert hello == server.http.get("/v1/info").json()
        assert stream.socket.subprotocol == "sunbox.v1"


def test_a_picture_from_start_to_done(client: Client) -> None:
    client.start()
    done, last = client.finished()
    assert done["reason"] == "max_samples" and done["generation"] == 1 and done["samples"] == 8
    assert last.samples == 8 and last.scale == 1 and last.noise == done["noise"] > 0
    assert last.mime == "image/jpeg" and (last.width, last.height) == (32, 24)
    assert Image.open(io.BytesIO(last.image)).size == (32, 24)
    assert last.elapsed_s > 0 and last.eta_s == 0
    assert not pictures(client.silence())


def test_frames_rise(client: Client) -> None:
    client.start(settings=ENDLESS)
    frames = [client.frame() for _ in range(6)]
    assert rises(frames) and frames[-1].samples > frames[0].samples
    assert frames[0].noise is None or frames[0].samples > 1


def test_never_more_than_two_unacknowledged(client: Client) -> None:
    client.acknowledges = False
    client.start(settings=ENDLESS)
    first, second = client.frame(), client.frame()
    assert not client.silence(0.6), "a third frame without a credit"
    client.say("ack", seq=second.seq)
    third = client.frame()
    assert third.samples > 3 * second.samples, "rendering must go on while frames wait for acknowledgements"
    assert not client.silence(0.3), "the first frame still holds its credit"
    client.say("ack", seq=first.seq)
    client.say("ack", seq=first.seq)  # twice is no harm, and no credit
    fourth = client.frame()
    assert fourth.samples >= third.samples and not client.silence(0.3)


def test_done_needs_no_credit_and_the_last_frame_follows(client: Client) -> None:
    client.acknowledges = False
    client.start(settings={"width": 32, "height": 24, "time_limit": 0.6})
    done, frames = client.until("done")
    assert len(frames) == 2 and frames[-1].samples < done["samples"]
    assert not client.silence(0.2)
    client.say("ack", seq=frames[0].seq)
    assert client.frame().samples == done["samples"]


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
    for step in range(60):
        camera = {"camera": {"position": [np.sin(step / 30), 0, 4]}}
        client.say("update", generation=2 + step, scene=camera)
        seen += pictures(client.silence(1 / 60))
    assert len({frame.generation for frame in seen}) >= 5
    while seen[-1].generation < 61:
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


@pytest.mark.parametrize(
    ("text", "status"),
    [
        ("{", 400),
        ('{"type": "ping", "type": "ping"}', 400),
        ("[]", 422),
        ('{"type": "hurry"}', 422),
        ('{"type": "ack"}', 422),
        ('{"type": "ack", "seq": 99}', 422),
        ('{"type": "update", "generation": 1.5}', 422),
        ('{"type": "view", "exposure": 61}', 422),
        ('{"type": "view", "exposure": NaN}', 422),
        ('{"type": "view", "format": "gif"}', 422),
        ('{"type": "pause"}', 409),
    ],
)
def test_nonsense_is_refused_and_the_stream_goes_on(client: Client, text: str, status: int) -> None:
    client.socket.send(text)
    assert client.until("error")[0]["problem"]["status"] == status
    client.start()
    assert client.finished()


def test_bytes_are_refused(client: Client) -> None:
    client.socket.send(b"\0\1")
    assert client.until("error")[0]["problem"]["status"] == 400


def test_pause_and_resume(client: Client) -> None:
    client.start(settings=ENDLESS)
    client.frame()
    client.say("pause")
    paused = pictures(client.silence(0.5))
    assert not pictures(client.silence(0.4)), "frames after a pause"
    client.say("resume")
    frame = client.frame()
    assert frame.generation == 1 and frame.samples > max([p.samples for p in paused], default=0)
    client.say("pause")
    client.silence(0.4)
    views = []
    for exposure in (1, 2):
        client.say("view", exposure=exposure)
        views.append(client.frame())
        client.silence(0.2)
    bright, brighter = views
    assert bright.samples == brighter.samples and bright.image != brighter.image
    assert bright.elapsed_s == brighter.elapsed_s, "a pause is no rendering time"


def test_an_update_while_paused_sends_one_frame(client: Client) -> None:
    client.start(settings=ENDLESS)
    client.frame()
    client.say("pause")
    client.silence(0.3)
    client.say("update", generation=2, scene={"materials": {"ball": {"roughness": 0.9}}})
    first = client.frame(generation=2)
    assert first.samples == 1
    assert not client.silence(0.4), "more than one first frame"
    client.say("resume")
    assert client.frame().samples > 1


def test_stop_is_followed_by_done(client: Client) -> None:
    client.start(settings=ENDLESS)
    client.frame()
    client.say("stop")
    done, last = client.finished()
    assert done["reason"] == "stopped" and done["samples"] == last.samples > 0
    assert not pictures(client.silence(0.3))
    client.say("update", generation=2, settings={"seed": 2, "max_samples": 4})
    assert client.finished()[0]["reason"] == "max_samples"


@pytest.mark.parametrize(("limit", "value"), [("time_limit", 1.0), ("target_noise", 0.2)])
def test_other_reasons_to_be_done(client: Client, limit: str, value: float) -> None:
    client.start(settings={"width": 64, "height": 64, limit: value})
    done, last = client.finished()
    assert done["reason"] == limit
    assert last.elapsed_s <= 1.1 * value + 0.1 if limit == "time_limit" else last.noise <= value


@pytest.mark.parametrize(
    ("view", "mime"),
    [
        ({"format": "png"}, "image/png"),
        ({"format": "webp", "quality": 50}, "image/webp"),
        ({"format": "jpeg", "aov": "normal"}, "image/jpeg"),
        ({"format": "png", "aov": "depth", "exposure": 2}, "image/png"),
        ({"tone_map": "aces", "exposure": -1.5}, "image/jpeg"),
    ],
)
def test_a_view_is_answered_when_done(client: Client, view: dict[str, Any], mime: str) -> None:
    client.start()
    done, before = client.finished()
    client.say("view", **view)
    frame = client.frame()
    assert frame.mime == mime and frame.samples == done["samples"] and frame.seq == before.seq + 1
    image = Image.open(io.BytesIO(frame.image))
    assert image.size == (32, 24) and frame.image != before.image
    assert not client.silence(0.2)


def test_a_view_keeps_what_it_does_not_name(client: Client) -> None:
    client.start(view={"format": "png"})
    client.finished()
    client.say("view", exposure=1)
    assert client.frame().mime == "image/png"


def test_a_deep_png_holds_what_eight_bits_round(client: Client) -> None:
    client.start()
    client.finished()
    client.say("view", format="png")
    flat = np.asarray(Image.open(io.BytesIO(client.frame().image)), float)
    client.say("view", bits=16)
    deep = client.frame().image
    assert deep[24] == 16, "the header's bit depth"
    # Pillow reads the upper eight of sixteen bits.
    apart = np.abs(np.asarray(Image.open(io.BytesIO(deep)).convert("RGBA"), float) - flat)
    assert apart.max() <= 1 and apart.max() > 0


def test_raw_frames_are_linear_and_never_exposed(client: Client) -> None:
    client.start(view=RAW)
    color = client.finished()[1].array()
    client.say("view", exposure=3)
    assert np.array_equal(client.frame().array(), color)
    client.say("view", aov="albedo")
    albedo = client.frame().array()
    assert albedo.max() <= 1 and (albedo[..., 3] == 1).all() and not np.array_equal(albedo, color)


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


def test_a_heavy_scene_is_first_seen_small(client: Client, server: Server) -> None:
    scene = server.http.get("/v1/presets/scenes/sphere-field").json()
    client.start(scene=scene, settings={"width": 384, "height": 256, "max_samples": 3})
    frames: list[Picture] = []
    while not frames or frames[-1].scale < 1:
        frames.append(client.frame())
    client.say("update", generation=2, scene={"camera": {"vfov": 50}})
    frames.append(client.frame(generation=2))
    assert frames[0].scale < 1 and frames[-1].scale < 1
    assert all((f.width, f.height) == (round(384 * f.scale), round(256 * f.scale)) for f in frames)
    while frames[-1].scale < 1:
        frames.append(client.frame(generation=2))
    assert rises(frames)


def test_two_streams_share(server: Server) -> None:
    settings = {**ENDLESS, "width": 64, "height": 64}
    with opened(server) as one, opened(server) as other:
        one.start(settings=settings)
        other.start(settings=settings)
        samples = {}
        for name, stream in (("one", one), ("other", other)):
            stream.frame()
            time.sleep(0.5)
            samples[name] = max(frame.samples for frame in pictures(stream.silence(0.5)))
        assert min(samples.values()) > 0.2 * max(samples.values())


def test_max_fps(client: Client) -> None:
    client.start(settings=ENDLESS, view={"max_fps": 5})
    client.frame()
    assert 2 <= len(pictures(client.silence(1.2))) <= 7


def test_too_large_a_message_closes(server: Server) -> None:
    with opened(server) as stream:
        with pytest.raises(ConnectionClosed) as closed:  # perhaps before it has sent it all
            stream.socket.send('{"type": "ping", "padding": "' + "x" * (1 << 20) + '"}')
            stream.until("never")
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009


@pytest.mark.parametrize("origin", ["http://example.com", "null", "http://127.0.0.1:1"])
def test_foreign_origins_are_closed(server: Server, origin: str) -> None:
    stream = Client(server.url, origin=origin)
    with stream.socket, pytest.raises(ConnectionClosed) as closed:
        stream.until("hello")
    assert closed.value.rcvd is not None and closed.value.rcvd.code == 4403


def test_own_origin_is_welcome(server: Server) -> None:
    stream = Client(server.url, origin=server.url)
    with stream.socket:
        assert stream.until("hello")
