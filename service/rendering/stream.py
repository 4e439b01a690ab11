"""One client at the stream: its messages in order, its frames, its errors. Knows of its socket only that it sends."""

from __future__ import annotations

import asyncio
import json
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, cast

from service.problems import Conflict, Internal, MalformedJson, ServiceError, answer, problem
from service.rendering import protocol
from service.rendering.engine import Engine
from service.rendering.flow import Flow
from service.rendering.job import error_of
from service.rendering.live import Live
from service.rendering.messages import Done, Failed, Frame, FromRenderer, Pause, Resume, Stop, Update
from service.rendering.reading import Reader
from service.rendering.threads import encoding, packing
from service.scene import load_json

LOST = 4500  # close code
WAITING = 64  # messages to take, or to send; more of them wait in the network
SMALL = 16 * 1024  # characters of JSON that are parsed faster than a thread is woken

log = logging.getLogger(__name__)

Edit = protocol.Start | protocol.Update
ORDERS: dict[str, Callable[[int], Pause | Resume | Stop]] = {"pause": Pause, "resume": Resume, "stop": Stop}


class Socket(Protocol):
    async def send_text(self, data: str) -> None: ...

    async def send_bytes(self, data: bytes) -> None: ...

    async def close(self, code: int = 1000, reason: str | None = None) -> None: ...


@dataclass(frozen=True)
class _Closing:
    code: int
    reason: str


class Stream:
    """`hear` takes what the client says; `run` works until it is cancelled or has closed the socket."""

    def __init__(self, engine: Engine, reader: Reader, socket: Socket) -> None:
        self._engine = engine
        self._socket = socket
        self._task = engine.open(self)
        self._flow = Flow(self._task, engine.send)
        self._live = Live(reader, self._task)
        self._inbox: deque[protocol.Message | ServiceError] = deque()
        self._outbox: deque[dict[str, Any] | Frame | _Closing] = deque()
        self._stirred = asyncio.Event()  # one of them has changed
        # Held while a frame goes out and while an update is taken: a slow client gets no old frame after its update.
        self._writing = asyncio.Lock()

    async def hear(self, text: str | None) -> None:
        """Takes one message; None stands for what is no text. Waits while too many are still to be dealt with."""
        try:
            message: protocol.Message | ServiceError = await _parsed(text)
            if isinstance(message, protocol.Ack):  # it is about frames, not about the picture, and may overtake
                self._flow.acknowledge(message.seq)
                return
        except ServiceError as error:
            message = error
        self._inbox.append(message)
        self._stir()
        while len(self._inbox) > WAITING:
            await self._stirring()

    async def run(self) -> None:
        handling = asyncio.create_task(self._handle_all())
        sending = asyncio.create_task(self._send_all())
        try:
            done, _ = await asyncio.wait({handling, sending}, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            handling.cancel()
            sending.cancel()
            self._flow.close()
            self._engine.drop(self._task)
            await asyncio.gather(handling, sending, return_exceptions=True)

    def heard(self, message: FromRenderer) -> None:
        if isinstance(message, Frame):
            if self._flow.welcome(message):
                self._post(message)
        elif isinstance(message, Done):
            if message.generation == self._flow.generation:
                progress = message.progress
                said = {"generation": message.generation, "reason": message.reason}
                self._post({"type": "done", **said, "samples": progress.samples, "noise": progress.noise})
        elif isinstance(message, Failed):
            self._live.forget()
            self._flow.fail()
            self._refuse(error_of(message), message.generation)

    def lost(self, detail: str) -> None:
        self._refuse(Internal(detail), self._flow.generation)
        self._post(_Closing(LOST, detail))

    async def _handle_all(self) -> None:
        while True:
            while not self._inbox or len(self._outbox) > WAITING:
                await self._stirring()
            message = self._inbox.popleft()
            self._stir()
            if isinstance(message, ServiceError):
                self._refuse(message, self._flow.generation)
            elif isinstance(message, Edit):
                await self._flow.settled()
                await self._take(message)
            else:
                self._obey(message)

    async def _take(self, message: Edit) -> None:
        """Takes an update and those that follow it at once; of these only the last need be seen."""
        while True:
            try:
                await self._tell(await packing(partial(self._live.take, message)))
                if isinstance(message, protocol.Start) and message.view is not None:
                    self._flow.look(message.view.over(self._flow.view))
            except ServiceError as error:
                self._refuse(error, message.generation)
            if not self._inbox or not isinstance(self._inbox[0], Edit):
                break
            message = cast(Edit, self._inbox.popleft())
        self._stir()
        try:
            await self._tell(await packing(self._live.settle))
        except ServiceError as error:
            self._refuse(error, message.generation)

    async def _tell(self, update: Update | None) -> None:
        if update is None:
            return
        if update.scene is not None:
            await self._engine.send_scene(update)
        else:
            self._engine.send(update)
        async with self._writing:
            self._flow.update(update.generation)

    def _obey(self, message: protocol.Message) -> None:
        if isinstance(message, protocol.ViewMessage):
            self._flow.look(message.over(self._flow.view))
        elif message.type == "ping":
            self._post({"type": "pong"})
        elif self._live.version is None:
            self._refuse(Conflict(f"Nothing was started yet: send start before {message.type}."), None)
        else:
            self._engine.send(ORDERS[message.type](self._task))

    async def _send_all(self) -> None:
        while True:
            while not self._outbox:
                await self._stirring()
            item = self._outbox.popleft()
            self._stir()
            if isinstance(item, Frame):
                await self._send_frame(item)
            elif isinstance(item, _Closing):
                return await self._socket.close(item.code, item.reason)
            else:
                await self._socket.send_text(json.dumps(item, allow_nan=False))

    async def _send_frame(self, frame: Frame) -> None:
        view, seq = self._flow.view, self._flow.next_seq
        data = await encoding(lambda: protocol.frame_bytes(frame, view, seq))
        async with self._writing:
            if self._flow.welcome(frame):
                self._count(data)
                self._flow.sent(frame)
                await self._socket.send_bytes(data)

    def _count(self, data: bytes) -> None:
        statistics = self._engine.statistics
        statistics.frames += 1
        statistics.frame_bytes += len(data)
        if (waited_s := self._flow.waited_s) is not None:
            statistics.first_frame_s.add(waited_s)

    def _refuse(self, error: ServiceError, generation: int | None) -> None:
        self._engine.statistics.errors[answer(error).type] += 1
        self._post({"type": "error", "generation": generation, "problem": problem(error)})

    def _post(self, item: dict[str, Any] | Frame | _Closing) -> None:
        self._outbox.append(item)
        self._stir()

    def _stir(self) -> None:
        self._stirred.set()

    async def _stirring(self) -> None:
        self._stirred.clear()
        await self._stirred.wait()


async def _parsed(text: str | None) -> protocol.Message:
    if text is None:
        raise MalformedJson("A message is JSON text, not bytes.")
    document = load_json(text) if len(text) < SMALL else await packing(partial(load_json, text))
    return protocol.parse(document)
