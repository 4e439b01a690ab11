"""One client's stream: its messages in order, its frames, its errors. It outlives its connections."""

from __future__ import annotations

import asyncio
import json
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol, cast

from service.ipc.messages import (
    Done,
    Failed,
    Frame,
    FromRenderer,
    Loaded,
    Update,
)
from service.ipc.task_control import Hold, Pause, Resume, Stop
from service.problems import MISTAKE, Conflict, Internal, MalformedJson, ServiceError, answer, problem
from service.renderers.protocol import Renderers
from service.server.renders.status import error_of
from service.server.requests.request_reader import RequestReader
from service.server.streams import protocol
from service.server.streams.edit_session import EditSession
from service.server.streams.flow_control import FlowControl
from service.system.executors import ClientExecutor, encoding

TAKEN_UP, LOST = 4409, 4500  # close codes
WAITING = 64  # messages to take, or to send; more of them wait in the network
WAITING_CHARACTERS = 256 * 1024  # of messages behind another one: as values they are 30 times larger
SMALL = 16 * 1024  # characters of JSON that are parsed faster than a thread is woken
STALLED_S = 30.0  # a client that takes nothing for so long is gone: its network may never say so
CLOSING_S = 1.0  # for the reason to reach a client that reads slowly

log = logging.getLogger(__name__)

Edit = protocol.Start | protocol.Update
ORDERS: dict[str, Callable[[int], Pause | Resume | Stop]] = {"pause": Pause, "resume": Resume, "stop": Stop}


class Socket(Protocol):
    async def send_text(self, data: str) -> None: ...

    async def send_bytes(self, data: bytes) -> None: ...

    async def close(self, code: int = 1000, reason: str | None = None) -> None: ...


@dataclass(frozen=True)
class Closing:
    code: int
    reason: str


@dataclass(frozen=True)
class _Heard:
    message: protocol.Message | ServiceError | Failed
    characters: int = 0  # that it was parsed from


class Attendance:
    """One connection to a stream."""

    def __init__(self, socket: Socket) -> None:
        self.socket = socket
        self.over: asyncio.Future[Closing] = asyncio.get_running_loop().create_future()

    def end(self, closing: Closing) -> None:
        if not self.over.done():
            self.over.set_result(closing)


class Stream:
    """`hear` takes the client's messages, `attend` sends frames and answers; `run` works until it is cancelled."""

    def __init__(self, renderers: Renderers, reader: RequestReader, owner: str = "") -> None:
        """`owner`: of the key; all that one owner renders shares one part of the GPU's time,
        and it uses no other owner's assets."""
        self.ended: Closing | None = None  # for good, and why
        self._renderers = renderers
        self._task = renderers.open(self, client=owner)
        self._flow = FlowControl(self._task, renderers.send)
        self._live = EditSession(reader, self._task, owner)
        self._executor = ClientExecutor("stream")  # parses and packs for this client alone
        self._paused = False  # by the client
        self._done: dict[str, Any] | None = None  # the last `done` of the present generation
        self._attendance: Attendance | None = None
        self._inbox: deque[_Heard] = deque()
        self._outbox: deque[dict[str, Any] | Frame] = deque()
        self._speaking = False  # something of the outbox is being sent
        self._stirred = asyncio.Event()  # one of them has changed
        # Held while a frame goes out and while an update is taken: a slow client gets no old frame after its update.
        self._writing = asyncio.Lock()

    @property
    def attended(self) -> bool:
        return self._attendance is not None

    async def hear(self, text: str | None) -> None:
        """Take one message; None stands for one that is not text. Waits while too many are unhandled."""
        try:
            message: protocol.Message | ServiceError = await self._parsed(text)
            if isinstance(
                message, protocol.Ack
            ):  # acknowledgements concern frames, not the picture, and may overtake
                self._flow.acknowledge(message.seq)
                return
        except ServiceError as error:
            message = error
        self._inbox.append(_Heard(message, len(text or "")))
        self._stir()
        while self._is_full():
            await self._stirring()

    async def run(self) -> None:
        """Handle messages in order; when this returns, the stream has ended."""
        try:
            await self._handle_all()
        finally:
            self._flow.close()
            self._renderers.drop(self._task)
            self._executor.close()
            self._live.close()

    def attach(self, socket: Socket) -> Attendance:
        """Make this connection the client's; an earlier one is told so and closed."""
        if self._attendance is not None:
            self._attendance.end(Closing(TAKEN_UP, "This session was taken up by another connection."))
            self._leave()
        self._attendance = Attendance(socket)
        if self.ended is not None:
            self._attendance.end(self.ended)
        if self._done is not None:  # perhaps it was lost on its way to the connection before
            self._outbox = deque(said for said in self._outbox if said is not self._done)
            self._post(self._done)
        self._flow.attach()
        self._renderers.send(Pause(self._task) if self._paused else Resume(self._task))
        return self._attendance

    async def attend(self, attendance: Attendance) -> None:
        """Send frames and answers until cancelled, or until the connection was closed with its reason."""
        sending = asyncio.create_task(self._send_all(attendance.socket))
        try:
            either: set[asyncio.Future[Any]] = {sending, attendance.over}
            await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
            if sending.done():
                sending.result()
            else:
                closing = attendance.over.result()
                if closing is self.ended:  # what is still to be said is: why
                    said = asyncio.ensure_future(self._said())
                    await asyncio.wait({said, sending}, timeout=CLOSING_S, return_when=asyncio.FIRST_COMPLETED)
                await _stopped(sending)
                async with asyncio.timeout(CLOSING_S):
                    await attendance.socket.close(closing.code, closing.reason)
        except TimeoutError:
            return  # it takes nothing: the network's end of it is the server's business
        finally:
            await _stopped(sending)
            if self._attendance is attendance:
                self._leave()

    def _leave(self) -> None:
        """Pause the render until a client attends again."""
        self._attendance = None
        self._outbox = deque(item for item in self._outbox if not isinstance(item, Frame))
        self._flow.detach()
        self._renderers.send(Pause(self._task, away=True))

    def end(self, code: int, reason: str) -> None:
        """End the stream for good; the client is told so, now or when it comes back."""
        self.ended = Closing(code, reason)
        if self._attendance is not None:
            self._attendance.end(self.ended)

    def heard(self, message: FromRenderer) -> None:
        if isinstance(message, Frame):
            if not message.provisional:  # else every edit's documents are kept
                self._live.works = max(self._live.works, message.generation)
            if self._flow.welcome(message):
                self._post(message)
        elif isinstance(message, Done):
            if message.generation == self._flow.generation:
                progress = message.progress
                self._done = {
                    "type": "done",
                    "generation": message.generation,
                    "reason": message.reason,
                    "samples": progress.samples,
                    "noise": progress.noise,
                    "caustics": "light" if message.traces_caustics else "paths",
                }
                self._post(self._done)
        elif isinstance(message, Failed):
            self._refuse(error_of(message), message.generation)
            self._inbox.append(_Heard(message))
            self._stir()
        elif isinstance(message, Loaded):
            self._live.works = message.generation

    def again(self) -> None:
        """Another renderer begins the generation again, at one sample; the client sees nothing else of the loss."""

    def lost(self, detail: str) -> None:
        self._refuse(Internal(detail), self._flow.generation)
        self.end(LOST, detail)

    def died(self, error: Exception) -> None:
        """The task that runs it was ended by an error of the server."""
        self.lost(MISTAKE)

    async def _handle_all(self) -> None:
        while True:
            while not self._inbox or len(self._outbox) > WAITING:
                await self._stirring()
            message = self._inbox.popleft().message
            self._stir()
            if isinstance(message, ServiceError):
                self._refuse(message, self._flow.generation)
            elif isinstance(message, Failed):
                await self._fall_back(message)
            elif isinstance(message, Edit):
                await self._flow.idle()
                await self._take(message)
            elif isinstance(message, protocol.ViewMessage):
                try:
                    await self._look(message)
                except ServiceError as error:
                    self._refuse(error, self._flow.generation)
            else:
                self._obey(message)

    async def _take(self, message: Edit) -> None:
        """Takes an update and those that follow it at once; of these only the last need be seen."""
        began = asyncio.get_running_loop().time()
        while True:
            try:
                await self._tell(await self._executor.run(partial(self._live.take, message)), began)
                if isinstance(message, protocol.Start):
                    self._renderers.divide(self._task, message.renderers)
                    if message.view is not None:
                        await self._look(message.view)
            except ServiceError as error:
                self._refuse(error, message.generation)
            if not self._inbox or not isinstance(self._inbox[0].message, Edit):
                break
            message = cast(Edit, self._inbox.popleft().message)
        self._stir()
        if self._live.packs:  # threads that trace what is out of date would take the time from the one that packs
            self._renderers.send(Hold(self._task))
        try:
            await self._tell(await self._executor.run(self._live.pack_pending), began)
        except ServiceError as error:
            self._refuse(error, message.generation)

    async def _fall_back(self, failed: Failed) -> None:
        """Go back to the last scene that worked; a newer one is tried again."""
        try:
            update = await self._executor.run(partial(self._live.failed, failed.generation, failed.fallback))
        except ServiceError as error:
            return self._refuse(error, failed.generation)
        if update is not None:
            await self._tell(update, asyncio.get_running_loop().time())
        elif self._flow.generation is not None and self._flow.generation <= failed.generation:
            self._flow.fall_back(failed.fallback)

    async def _tell(self, update: Update | None, began: float) -> None:
        if update is None:
            return
        if update.is_large:
            await self._renderers.send_scene(update)
        else:
            self._renderers.send(update)
        if not self.attended:  # its task may not have been there to be paused
            self._renderers.send(Pause(self._task, away=True))
        async with self._writing:
            self._done = None
            self._flow.update(update.generation, began)

    async def _look(self, message: protocol.View) -> None:
        """Show the picture so. A view whose table of colours is not there changes nothing. Raises ServiceError."""
        view = message.over(self._flow.view)
        lut = None if view.lut is None else await self._executor.run(partial(self._live.lut, view.lut))
        self._flow.set_view(view, lut)

    def _obey(self, message: protocol.Message) -> None:
        if message.type == "ping":
            self._post({"type": "pong"})
        elif self._live.version is None:
            self._refuse(Conflict(f"Nothing was started yet: send start before {message.type}."), None)
        else:
            if message.type in ("pause", "resume"):
                self._paused = message.type == "pause"
            if message.type == "stop" or self.attended:
                self._renderers.send(ORDERS[message.type](self._task))

    async def _send_all(self, socket: Socket) -> None:
        """Send all that is due. Raises TimeoutError when the client takes nothing any more."""
        while True:
            while not self._outbox:
                await self._stirring()
            item, self._speaking = self._outbox.popleft(), True
            try:
                if isinstance(item, Frame):
                    await self._send_frame(socket, item)
                else:
                    async with asyncio.timeout(STALLED_S):
                        await socket.send_text(json.dumps(item, allow_nan=False))
            finally:
                self._speaking = False
                self._stir()

    async def _send_frame(self, socket: Socket, frame: Frame) -> None:
        view, seq = self._flow.view, self._flow.next_seq
        data = await encoding(lambda: protocol.frame_bytes(frame, view, seq))
        async with self._writing:
            if self._flow.welcome(frame):
                self._count(data)
                self._flow.sent(frame)
                async with asyncio.timeout(STALLED_S):
                    await socket.send_bytes(data)

    def _count(self, data: bytes) -> None:
        statistics = self._renderers.statistics
        statistics.frames += 1
        statistics.frame_bytes += len(data)
        if (waited_s := self._flow.waited_s) is not None:
            statistics.first_frame_s.add(waited_s)

    def _refuse(self, error: ServiceError, generation: int | None) -> None:
        self._renderers.statistics.errors[answer(error).type] += 1
        self._post({"type": "error", "generation": generation, "problem": problem(error)})

    def _post(self, item: dict[str, Any] | Frame) -> None:
        self._outbox.append(item)
        self._stir()

    def _is_full(self) -> bool:
        characters = sum(heard.characters for heard in self._inbox)
        return len(self._inbox) > WAITING or (len(self._inbox) > 1 and characters > WAITING_CHARACTERS)

    def _stir(self) -> None:
        self._stirred.set()

    async def _stirring(self) -> None:
        self._stirred.clear()
        await self._stirred.wait()

    async def _said(self) -> None:
        while self._outbox or self._speaking:
            await self._stirring()

    async def _parsed(self, text: str | None) -> protocol.Message:
        if text is None:
            raise MalformedJson("A message is JSON text, not bytes.")
        return protocol.parse(text) if len(text) < SMALL else await self._executor.run(partial(protocol.parse, text))


async def _stopped(task: asyncio.Task[None]) -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
