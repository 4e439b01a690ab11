"""Messages between the server and the renderer: whole, in order, in shared memory, and nobody waits."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gpu import SceneEdit
from service.ipc import channel
from service.ipc.messages import Frame, Progress, StopRule, Update, View, Want
from service.ipc.server_end import Channel


@pytest.fixture
def ends() -> Iterator[tuple[socket.socket, socket.socket]]:
    ours, theirs = channel.pair()
    with ours, theirs:
        yield ours, theirs


def through(ends: tuple[socket.socket, socket.socket], message: Any) -> Any:
    channel.send(ends[0], message)
    return channel.receive(ends[1], wait=True)


def open_descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def test_small_message_needs_no_memory(ends: tuple[socket.socket, socket.socket]) -> None:
    want = Want(3, 7, View(exposure=1.5), anyway=True)
    assert channel.encode(want)[1] == ()
    assert through(ends, want) == want


@pytest.mark.parametrize("shape", [(0, 4), (1, 1, 4), (37, 61, 3), (1024, 1024, 4)])
@pytest.mark.parametrize("dtype", [np.uint8, np.float32])
def test_arrays_arrive_bit_for_bit(
    ends: tuple[socket.socket, socket.socket], shape: tuple[int, ...], dtype: type[np.generic]
) -> None:
    pixels = np.random.default_rng(1).integers(0, 255, shape).astype(dtype)
    frame = through(ends, Frame(1, 2, 3, pixels, Progress(4), 1.0, False))
    assert frame.pixels.dtype == dtype and np.array_equal(frame.pixels, pixels)
    assert frame.progress == Progress(4)
    if pixels.size:
        with pytest.raises(ValueError, match="read-only"):
            frame.pixels[:] = 0


def test_structured_arrays_and_others_share_one_memory(ends: tuple[socket.socket, socket.socket]) -> None:
    records = np.zeros(
        5, np.dtype({"names": ["a", "b"], "formats": ["<f4", ("<f4", (3,))], "offsets": [0, 16], "itemsize": 32})
    )
    records["b"] = np.arange(15).reshape(5, 3)
    sent = {
        "records": records,
        "empty": records[:0],
        "strided": np.arange(20)[::2],
        "bytes": np.arange(7, dtype=np.uint8),
    }
    got = through(ends, sent)
    assert all(np.array_equal(got[name], sent[name]) for name in sent) and got["records"].dtype == records.dtype


def test_a_long_message_travels_in_memory(ends: tuple[socket.socket, socket.socket]) -> None:
    sent = ["x" * 3_000_000, np.arange(10)]
    text, numbers = through(ends, sent)
    assert text == sent[0] and np.array_equal(numbers, sent[1])


def test_descriptors_are_given_back(ends: tuple[socket.socket, socket.socket]) -> None:
    before = open_descriptors()
    for _ in range(20):
        through(ends, np.zeros(1000))
    assert open_descriptors() == before


def test_the_end_of_the_other_end_is_heard(ends: tuple[socket.socket, socket.socket]) -> None:
    channel.send(ends[0], "last words")
    with pytest.raises(BlockingIOError):
        channel.receive(ends[0])
    ends[0].close()
    assert channel.receive(ends[1]) == "last words"
    with pytest.raises(channel.Closed):
        channel.receive(ends[1], wait=True)
    with pytest.raises(channel.Closed):
        channel.send(ends[1], np.zeros(3))


def test_the_event_loop_sends_more_than_the_socket_holds() -> None:
    """Nobody listens at first: everything waits in line, and arrives in order."""

    async def exchange() -> list[int]:
        ours, theirs = channel.pair()
        sender = Channel(ours, lambda message: None, lambda: None)
        for number in range(2000):
            sender.send((number, b"." * 1000))
        got: list[int] = []
        done = asyncio.Event()

        def take(message: tuple[int, bytes]) -> None:
            got.append(message[0])
            if len(got) == 2000:
                done.set()

        receiver = Channel(theirs, take, lambda: None)
        await asyncio.wait_for(done.wait(), 10)
        sender.close()
        receiver.close()
        return got

    assert asyncio.run(exchange()) == list(range(2000))


def test_the_event_loop_hears_of_the_other_end_once() -> None:
    async def exchange() -> int:
        ours, theirs = channel.pair()
        lost = []
        alone = Channel(ours, lambda message: None, lambda: lost.append(True))
        theirs.close()
        alone.send("nobody hears this")
        await asyncio.sleep(0.05)
        alone.send(np.zeros(100))
        alone.close()
        return len(lost)

    assert asyncio.run(exchange()) == 1


def edit(**parts: Any) -> SceneEdit:
    """An edit whose parts are words in place of arrays."""
    return SceneEdit(**parts)


def test_updates_are_joined() -> None:
    whole = Update(1, 1, scene="first", settings={"seed": 1}, stop=StopRule(10), interactive=True)
    camera = Update(1, 2, edit=edit(camera="left"))
    stop = Update(1, 3, stop=StopRule(20))
    joined = whole.then(camera).then(stop)
    assert joined == Update(1, 3, "first", {"seed": 1}, StopRule(20), edit=edit(camera="left"), interactive=True)
    again = joined.then(Update(1, 4, scene="second", interactive=True))
    assert again == Update(1, 4, "second", {"seed": 1}, StopRule(20), interactive=True)
    assert joined.restarts and not stop.restarts


def test_what_two_updates_moved_is_joined() -> None:
    first = edit(environment=(0.0, 1.0), environment_map="dusk", moved={"lights": "a", "nodes": "b"})
    turned, moved = edit(environment=(0.5, 2.0)), edit(moved={"lights": "c"})
    joined = Update(1, 1, edit=first).then(Update(1, 2, edit=turned)).then(Update(1, 3, edit=moved))
    assert joined == Update(1, 3, edit=edit(
        environment=(0.5, 2.0), environment_map="dusk", moved={"lights": "c", "nodes": "b"}
    ))  # fmt: skip
