"""What is on its way to a client when its scene changes is not sent any more."""

from __future__ import annotations

import asyncio
import json
from typing import Any, cast

import numpy as np

from service.config import Config
from service.ipc.messages import Frame, Progress, Want
from service.renderers.statistics import Statistics
from service.server.requests.request_reader import RequestReader
from service.server.streams.stream import Stream
from tests.service.rendering.fakes import until


class Renderers:
    """Notes what frames are asked for."""

    def __init__(self) -> None:
        self.statistics = Statistics()
        self.wants = list[Want]()

    def open(self, stream: Stream, client: str = "") -> int:
        return 1

    def send(self, message: object) -> None:
        if isinstance(message, Want):
            self.wants.append(message)

    def frame(self, generation: int) -> Frame:
        """The answer to the last of them."""
        return Frame(1, self.wants[-1].serial, generation, np.zeros((1, 1, 4), np.uint8), Progress(), 1.0, False)


class Socket:
    def __init__(self) -> None:
        self.generations = list[int]()  # of the frames that were sent

    async def send_bytes(self, data: bytes) -> None:
        length = int.from_bytes(data[:4], "little")
        self.generations.append(json.loads(data[4 : 4 + length])["generation"])


def test_a_frame_that_is_being_encoded_when_its_scene_changes_is_dropped() -> None:
    async def run() -> None:
        renderers, socket = Renderers(), Socket()
        stream = Stream(cast(Any, renderers), RequestReader(Config(), cast(Any, None)))
        sending = asyncio.create_task(stream.attend(stream.attach(cast(Any, socket))))
        stream._flow.update(1, 0.0)
        stream.heard(renderers.frame(1))
        await until(lambda: len(renderers.wants) == 2)
        stream._flow.acknowledge(1)
        stream.heard(renderers.frame(1))
        stream._flow.update(2, 0.0)  # before another thread has encoded it
        await until(lambda: len(renderers.wants) == 3)
        stream.heard(renderers.frame(2))
        await until(lambda: 2 in socket.generations)
        assert socket.generations == [1, 2]
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
        stream._flow.close()
        stream._executor.close()

    asyncio.run(run())
