"""How a stream's frames look, against a real server: formats, exposure, layers, how often."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.serving import ENDLESS, Client, Server
from tests.serving import client as opened
from tests.streams import RAW, pictures


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as connected:
        yield connected


@pytest.mark.parametrize(
    ("view", "mime"),
    [
        ({"format": "png"}, "image/png"),
        ({"format": "webp", "quality": 50}, "image/webp"),
        ({"format": "jpeg", "aov": "normal"}, "image/jpeg"),
        ({"format": "png", "aov": "depth", "exposure": 2}, "image/png"),
        ({"tone_map": "aces", "exposure": -1.5}, "image/jpeg"),
        ({"tone_map": "aces2"}, "image/jpeg"),
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


def test_frames_for_wide_screens_say_so(client: Client) -> None:
    client.start(view={"format": "jpeg", "color_space": "display_p3"})
    _, frame = client.finished()
    assert "icc_profile" in Image.open(io.BytesIO(frame.image)).info
    client.say("view", color_space="srgb")
    assert "icc_profile" not in Image.open(io.BytesIO(client.frame().image)).info


def test_frames_go_through_a_cube(client: Client, server: Server) -> None:
    client.start(view={"format": "png"})
    _, frame = client.finished()
    plain = np.asarray(Image.open(io.BytesIO(frame.image)), int)
    client.say("view", lut="sha256:" + "0" * 64)
    assert client.until("error")[0]["problem"]["errors"][0]["pointer"] == "/lut"
    cube = server.http.post("/v1/assets", content=b"LUT_1D_SIZE 2\n1 1 1\n0 0 0\n").json()
    client.say("view", lut=cube["id"])
    turned = np.asarray(Image.open(io.BytesIO(client.frame().image)), int)
    assert np.abs(255 - plain[..., :3] - turned[..., :3]).max() <= 1


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


def test_max_fps(client: Client) -> None:
    client.start(settings=ENDLESS, view={"max_fps": 5})
    client.frame()
    assert 2 <= len(pictures(client.silence(1.2))) <= 7
