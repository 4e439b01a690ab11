"""The rules of the stream, against a real server: frames, acknowledgements, pauses, ends, closing."""

from __future__ import annotations

import io
from collections.abc import Iterator

import pytest
from PIL import Image
from websockets.exceptions import ConnectionClosed

from tests.serving import ENDLESS, Client, Server
from tests.serving import client as opened
from tests.streams import pictures, rises


@pytest.fixture
def client(server: Server) -> Iterator[Client]:
    with opened(server) as connected:
        yield connected


def test_hello_says_what_info_says(server: Server) -> None:
    stream = Client(server.url)
    with stream:
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
    assert last.elapsed_s > 0 and last.eta_s == 0 and done["caustics"] == "paths"
    assert not pictures(client.silence())


def test_done_says_that_caustics_were_traced_from_the_lights(client: Client) -> None:
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "glass"}
    floor = {"type": "quad", "origin": [-4, -1, 4], "u": [8, 0, 0], "v": [0, 0, -8], "material": "floor"}
    glass = {"type": "principled", "transmission": 1, "roughness": 0}
    scene = {
        "version": 1,
        "camera": {"position": [0, 1, 6], "target": [0, 0, 0]},
        "materials": {"glass": glass, "floor": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [ball, floor],
        "lights": [{"type": "point", "position": [1, 4, 1], "intensity": 20}],
    }
    client.start(scene=scene)
    assert client.finished()[0]["caustics"] == "light"


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
    assert third.samples > second.samples + 1, "rendering must go on while frames wait for acknowledgements"
    assert not client.silence(0.3), "the first frame still holds its credit"
    client.say("ack", seq=first.seq)
    client.say("ack", seq=first.seq)  # twice is no harm, and no credit
    fourth = client.frame()
    assert fourth.samples >= third.samples and not client.silence(0.3)


def test_done_needs_no_credit_and_the_last_frame_follows(client: Client) -> None:
    client.acknowledges = False
    client.start(settings={"width": 32, "height": 24, "time_limit": 1.5})
    done, frames = client.until("done")
    assert len(frames) == 2 and frames[-1].samples < done["samples"]
    assert not client.silence(0.2)
    client.say("ack", seq=frames[0].seq)
    assert client.frame().samples == done["samples"]


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
    assert limit == "time_limit" or last.noise <= value


def test_two_streams_share(server: Server) -> None:
    settings = {**ENDLESS, "width": 64, "height": 64}
    with opened(server) as one, opened(server) as other:
        one.start(settings=settings)
        other.start(settings=settings)
        one.frame(), other.frame()
        samples = (0, 0)
        while max(samples) < 100:
            samples = one.frame().samples, other.frame().samples
        assert min(samples) > 0.2 * max(samples)


def test_too_large_a_message_closes(server: Server) -> None:
    with opened(server) as stream:
        with pytest.raises(ConnectionClosed) as closed:  # perhaps before it has sent it all
            stream.socket.send('{"type": "ping", "padding": "' + "x" * (1 << 20) + '"}')
            stream.until("never")
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009
