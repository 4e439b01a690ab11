"""Streams whose documents grow, whose updates nobody sees and whose messages pile up take their share, not more."""

from __future__ import annotations

import asyncio
import json
from contextvars import copy_context
from typing import Any, cast

import numpy as np
import pytest

from service.config import Config
from service.formats import Assets
from service.pack import CacheBudget, PackCache
from service.problems import InvalidDocument, TooLarge, TooManyRequests
from service.renderers import replay_log
from service.renderers.local.supervisor import Supervisor
from service.server.requests.request_reader import RequestReader
from service.server.streams import protocol
from service.server.streams.edit_session import EditSession
from service.server.streams.stream import WAITING_CHARACTERS, Stream
from service.system.shares import CALLER
from tests.serving import SCENE, SMALL

KIB = 1 << 10
GREY = {"type": "diffuse", "albedo": 0.5}


def reader(**limits: Any) -> RequestReader:
    return RequestReader(Config(_env_file=None, **limits), cast(Assets, None))  # type: ignore[call-arg]


def say(client: EditSession, generation: int, kind: str = "update", **message: Any) -> None:
    client.take(protocol.parse(json.dumps({"type": kind, "generation": generation, **message})))  # type: ignore[arg-type]


def started(of: RequestReader) -> EditSession:
    client = EditSession(of, 1)
    say(client, 1, "start", scene=SCENE, settings=SMALL)
    return client


def materials(prefix: str, count: int, what: Any = GREY) -> dict[str, Any]:
    return {"materials": {f"{prefix}{i}": what for i in range(count)}}


def test_a_scene_does_not_grow_for_ever() -> None:
    client = started(reader(max_stream_memory=8 * 256 * KIB))
    with pytest.raises(TooLarge, match="SUNBOX_MAX_STREAM_MEMORY"):
        for generation in range(2, 20):
            say(client, generation, scene=materials(f"{generation}-", 100))
    version = client.version
    assert version is not None and 200 < len(version.scene.materials) < 1000
    # The last good scene is there and can be edited, and what is deleted gives its room back.
    say(client, 30, scene=materials("2-", 100, None))
    say(client, 31, scene=materials("31-", 90))
    assert client.version is not None and client.version.generation == 31


def test_what_is_refused_does_not_count() -> None:
    client = started(reader(max_stream_memory=8 * 256 * KIB))
    for generation in range(2, 40):
        with pytest.raises(InvalidDocument):
            say(client, generation, scene=materials(f"{generation}-", 100, {"type": "unknown"}))
    say(client, 40, scene=materials("40-", 100))


def test_all_scenes_together_have_a_bound() -> None:
    """And a caller a share, so that the streams of one refuse no other one's."""
    of = reader(max_stream_memory=8 * 16 * KIB)

    def crowd(caller: str) -> list[EditSession]:
        """As many streams of a caller as there may be, and the one that was refused."""
        CALLER.set(caller)
        clients: list[EditSession] = []
        with pytest.raises(TooManyRequests, match="SUNBOX_MAX_STREAM_MEMORY") as refused:
            for _ in range(200):
                clients.append(EditSession(of, 1))
                say(clients[-1], 1, "start", scene=SCENE, settings=SMALL)
        assert refused.value.retry_after
        return clients

    first, second = copy_context().run(crowd, "first"), copy_context().run(crowd, "second")
    assert len(first) > len(second) > 3
    second[0].close()
    copy_context().run(lambda: (CALLER.set("second"), say(second[-1], 2, "start", scene=SCENE, settings=SMALL)))
    for client in (*first, *second):
        client.close()
    copy_context().run(crowd, "third")


def test_versions_that_nobody_has_seen_are_not_all_kept() -> None:
    """While a renderer compiles, updates go on; it may go back to the first one, and to the last ones."""
    client = started(reader())
    client.works = 1
    for generation in range(2, 50):
        say(client, generation, scene={"camera": {"vfov": generation}})
        client.pack_pending()
    kept = [generation for generation, _ in client._states.items()]
    assert len(kept) == replay_log.MOST and kept[0] == 1 and kept[-1] == 49
    assert client.failed(49, 1) is None and client.version is not None and client.version.generation == 1


def test_caches_share_their_bytes() -> None:
    class Thing:
        def __init__(self) -> None:
            self.array = np.zeros(1000, np.uint8)

    budget = CacheBudget(4500)
    first, second = PackCache(budget=budget), PackCache(budget=budget)
    for i in range(4):
        first.get(i, Thing)
    for i in range(3):
        second.get(i, Thing)
    assert (first.bytes, second.bytes) == (4000, 1000)  # the newest is kept in any case, others where there is room
    first.get("new", Thing)
    assert first.bytes + second.bytes <= 4500
    del first
    for i in range(4):
        second.get(-i, Thing)
    assert second.bytes == 4000


def test_messages_of_many_values_are_refused_before_they_are_parsed() -> None:
    with pytest.raises(TooLarge, match="assets"):
        protocol.parse("[" + "[]," * 349_000 + "[]]")
    mesh = {"type": "mesh", "material": "ball", "faces": [[0, 1, 2]], "vertices": [[0.1, 0.2, 0.3]] * 50_000}
    text = json.dumps({"type": "update", "generation": 1, "scene": {"shapes": [mesh]}})
    assert len(text) > 800 * KIB and protocol.parse(text)  # an honest one of the same size


def test_large_messages_wait_in_the_network() -> None:
    """Behind another one; as values they take thirty times what their texts do."""

    class Quiet:
        def open(self, stream: Stream, client: str = "") -> int:
            return 1

        def send(self, message: object) -> None: ...

    async def run() -> None:
        stream = Stream(cast(Supervisor, Quiet()), reader())
        large = json.dumps({"type": "update", "generation": 1, "scene": {"title": "x" * WAITING_CHARACTERS}})
        await asyncio.wait_for(stream.hear('{"type": "ping"}'), 10)
        hearing = asyncio.create_task(stream.hear(large))
        while len(stream._inbox) < 2:
            await asyncio.sleep(0.001)
        await asyncio.sleep(0)
        assert not hearing.done()
        stream._inbox.popleft()
        stream._stir()
        await asyncio.wait_for(hearing, 10)
        stream._executor.close()

    asyncio.run(run())
