"""Frames, updates, broken connections."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import numpy as np
import pytest

import sunbox
from tests.serving import ENDLESS, SCENE, SMALL, Server


@pytest.fixture(scope="module")
def client(server: Server) -> Iterator[sunbox.Client]:
    with sunbox.Client(server.url) as client:
        yield client


def test_frames_get_better_until_done(client: sunbox.Client) -> None:
    with client.stream(SCENE, **SMALL) as stream:
        frames = list(stream)
    assert frames[-1].samples == 8 and stream.done["reason"] == "max_samples"
    assert [frame.samples for frame in frames] == sorted(frame.samples for frame in frames)
    assert np.array_equal(frames[-1].numpy(), client.render(SCENE, **SMALL).numpy())


def test_update_goes_on_after_the_end(client: sunbox.Client) -> None:
    with client.stream(SCENE, **SMALL) as stream:
        before = list(stream)[-1].numpy()
        stream.update({"materials": {"ball": {"base_color": [0, 1, 0]}}}, max_samples=4)
        after = list(stream)
    assert {frame.generation for frame in after} == {1} and after[-1].samples == 4
    assert not np.array_equal(before, after[-1].numpy())
    assert stream.scene["materials"]["ball"]["base_color"] == [0, 1, 0]


def test_refused_update_leaves_the_stream(client: sunbox.Client) -> None:
    with client.stream(SCENE, **SMALL) as stream:
        list(stream)
        stream.update({"camera": {"vfov": 500}})
        with pytest.raises(sunbox.Refused) as refused:
            next(stream)
        assert refused.value.pointer == "/scene/camera/vfov" and "vfov" not in stream.scene["camera"]
        stream.update({"scene": {"camera": {"vfov": 30}}})
        assert list(stream)[-1].samples == 8


def test_pictures_for_a_screen(client: sunbox.Client) -> None:
    with client.stream(SCENE, format="png", **SMALL) as stream:
        frame = list(stream)[-1]
        assert frame.mime == "image/png" and frame.numpy().dtype == np.uint8 and frame.image().size == (32, 24)
        stream.view(format="rgba32f")
        raw = next(stream)
        assert raw.numpy().shape == (24, 32, 4)
        with pytest.raises(ValueError, match="rgba32f"):
            raw.image()


def test_broken_connection_is_taken_up_again(server: Server) -> None:
    async def watched() -> list[tuple[int, int]]:
        heard = []
        async with sunbox.AsyncClient(server.url) as client, client.stream(SCENE, **ENDLESS) as stream:
            async for frame in stream:
                heard.append((frame.generation, frame.samples))
                if len(heard) == 3:
                    stream._socket.transport.abort()
                    await stream.update({"camera": {"vfov": 35}})
                if frame.generation == 1 and frame.samples >= 4:
                    return heard
        return []

    heard = asyncio.run(watched())
    assert heard[-1][0] == 1 and [generation for generation, _ in heard] == sorted(g for g, _ in heard)


def test_view_outlives_a_broken_connection(server: Server) -> None:
    async def watched() -> str:
        async with sunbox.AsyncClient(server.url) as client, client.stream(SCENE, **ENDLESS) as stream:
            await anext(stream)
            stream._socket.transport.abort()
            await asyncio.sleep(0.1)
            await stream.view(format="png")
            async for frame in stream:
                if frame.mime == "image/png":
                    return frame.mime
        return ""

    assert asyncio.run(asyncio.wait_for(watched(), 120)) == "image/png"


def test_forgotten_session_begins_again(server: Server) -> None:
    async def watched() -> tuple[float, int]:
        async with sunbox.AsyncClient(server.url) as client, client.stream(SCENE, **SMALL) as stream:
            await stream.update({"camera": {"vfov": 35}})
            async for _ in stream:
                pass
            stream._session = "forgotten"
            stream._socket.transport.abort()
            await stream.update(max_samples=16)
            frames = [frame async for frame in stream]
            return stream.scene["camera"]["vfov"], frames[-1].samples

    assert asyncio.run(watched()) == (35, 16)


def test_refused_connection_says_why(server: Server) -> None:
    async def opened() -> None:
        async with sunbox.AsyncClient("http://127.0.0.1:1", patience=0) as client, client.stream(SCENE):
            pass

    with pytest.raises(sunbox.Unreachable, match=r"127\.0\.0\.1:1"):
        asyncio.run(opened())
