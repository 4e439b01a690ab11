"""One renderer in the gateway: carries messages between its supervisor's socket and its actor."""

from __future__ import annotations

import asyncio
import logging
import re
import socket
from collections import deque
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, Protocol

from service.ipc import channel
from service.ipc.messages import Failed, FromRenderer, ToRenderer, Unable, Update
from service.ipc.server_end import Channel
from service.ipc.task_control import Drop, TakeCheckpoint
from service.problems import MISTAKE
from service.renderers.local.process import NoPlace
from service.renderers.ray.actor import difference
from service.renderers.ray.carriage import LARGE, Scenes, size, stored
from service.renderers.ray.control import ProcessEnded
from service.system.background import Background

SILENCE_S = 30.0  # without an answer from an actor, which gives one every 5 s, until it is given up
PLACING_S = 4.0  # that Ray may take to place an actor before the reason is asked for; then between two times
FAREWELL_S = 3.0  # for the renderer to end by itself
FLUSH_S = 2.0  # for the server to take the last messages
DRAIN_S = 3.0  # for the checkpoints of a node that is about to go
MOST_WAITING = 64  # messages in either direction; the side that sends them waits when there are more
MOST_TOGETHER = 256  # small messages in one call

log = logging.getLogger(__name__)


class Unfit(Exception):
    """A node can't run a renderer of this server; the text says why."""


class Actors(Protocol):
    """The actors of the cluster, by the numbers of their renderers."""

    scenes: Scenes
    options: dict[str, Any]  # of a renderer's process
    threads: int | None  # of one that renders on processors

    def actor(self, number: int, anew: bool = False) -> Any:
        """The handle of a renderer's actor, made if there is none yet; `anew`: Ray has given up the last one."""

    def placing(self, number: int) -> str:
        """Why an actor has no place yet; "" where it has one, and begins there."""

    def restart(self, number: int) -> None:
        """Have Ray restart an actor that does not answer, or that shall leave its node."""


class Lane:
    """Begins when it is made; `run` returns when the renderer has ended, or its supervisor closed the socket."""

    def __init__(self, number: int, end: socket.socket, actors: Actors) -> None:
        self.number, self._actors = number, actors
        self._incoming: deque[ToRenderer] = deque()
        self._news = asyncio.Event()
        self._behind: dict[int, list[ToRenderer]] = {}  # by task, behind a large message of it that is under way
        self._tasks: set[int] = set()
        self._paused = False
        self._loss = "node lost"  # why, when the actor is lost
        self._over = asyncio.Event()  # the supervisor has closed its end
        self._carrying = Background()
        self._link = Channel(end, self._received, self._over.set)

    async def run(self) -> None:
        work = asyncio.ensure_future(self._work())
        over = asyncio.ensure_future(self._over.wait())
        try:
            await asyncio.wait({work, over}, return_when=asyncio.FIRST_COMPLETED)
            if work.done():
                self._link.send(work.result())
                await self._flush()
        finally:
            for task in (work, over):
                task.cancel()
            await asyncio.gather(work, over, self._carrying.close(), return_exceptions=True)
            self._link.close()
            self._actors.scenes.forget_all(self)

    def close(self) -> None:
        self._over.set()

    def release(self) -> None:
        """End as one that is not needed now; the caller ends the actor."""
        self._loss = "released"

    def leave(self) -> None:
        """Leave the node, which is about to go: renders are saved, and Ray restarts the actor elsewhere."""
        if self._loss == "node lost":
            self._loss = "drained"
            log.warning("a node is being drained", {"renderer": self.number, "tasks": len(self._tasks)})
            for task in self._tasks:
                self._received(TakeCheckpoint(task))
            asyncio.get_running_loop().call_later(DRAIN_S, self._actors.restart, self.number)

    async def _work(self) -> ProcessEnded:
        """Carry messages until the renderer has ended; why it did."""
        from ray.exceptions import RayActorError, RayError

        try:
            actor = await self._begun()
            sending = asyncio.ensure_future(self._send_all(actor))
            hearing = asyncio.ensure_future(self._hear_all(actor))
            try:
                done, _ = await asyncio.wait({sending, hearing}, return_when=asyncio.FIRST_COMPLETED)
                for each in done:
                    if (error := each.exception()) is not None:
                        raise error
                return hearing.result()
            finally:
                sending.cancel()
                hearing.cancel()
                if self._over.is_set():
                    with suppress(Exception):
                        async with asyncio.timeout(FAREWELL_S + 1):
                            await _answer(actor.end.remote(FAREWELL_S))
        except Unfit as error:
            self._link.send(Unable(str(error)))
            return ProcessEnded("crashed")
        except TimeoutError:
            log.error("an actor did not answer", {"renderer": self.number, "seconds": round(SILENCE_S)})
            self._actors.restart(self.number)
        except RayActorError as error:
            log.warning("an actor was lost", {"renderer": self.number, "error": _said(error)})
        except RayError as error:
            log.error("Ray failed", {"renderer": self.number, "error": _said(error)})
            self._actors.restart(self.number)
        return ProcessEnded(self._loss)

    async def _begun(self) -> Any:
        """The actor with a renderer that has just been started. Raises Unfit, RayActorError."""
        from ray.exceptions import RayActorError

        actor = self._actors.actor(self.number)
        try:
            there = await self._placed(actor)
        except RayActorError:  # Ray has given it up, as it does when somebody kills it for good
            if self._loss == "released":
                raise
            actor = self._actors.actor(self.number, anew=True)
            try:
                there = await self._placed(actor)
            except RayActorError as error:
                raise Unfit(f"SUNBOX_RAY: a node of the cluster can't run Sunbox: {_said(error)}") from None
        if (why := difference(there["host"], there["version"])) is not None:
            raise Unfit(why)
        await _answer(actor.begin.remote(self._actors.options, self._actors.threads))
        return actor

    async def _placed(self, actor: Any) -> dict[str, Any]:
        # Ray retries this one call: it waits for an actor that Ray restarts.
        answer = asyncio.ensure_future(_answer(actor.describe.options(max_task_retries=-1).remote()))
        while not (await asyncio.wait({answer}, timeout=PLACING_S))[0]:
            if why := await asyncio.to_thread(self._actors.placing, self.number):
                self._link.send(NoPlace(why))
        there: dict[str, Any] = await answer
        return there

    def _received(self, message: ToRenderer) -> None:
        self._incoming.append(message)
        self._news.set()
        if len(self._incoming) >= MOST_TOGETHER and not self._paused:
            self._paused = True
            self._link.pause_reading()

    async def _send_all(self, actor: Any) -> None:
        """Pass messages on, in order for each task: what follows a large one of its task waits for that one only."""
        while True:
            await self._news.wait()
            self._news.clear()
            together, large = list[ToRenderer](), list[ToRenderer]()
            while self._incoming:
                message = self._incoming.popleft()
                if message.task in self._behind:
                    self._behind[message.task].append(message)
                elif (isinstance(message, Update) and message.scene is not None) or size(message) >= LARGE:
                    self._behind[message.task] = []
                    large.append(message)
                else:
                    together.append(message)
            if self._paused:
                self._paused = False
                self._link.resume_reading()
            if together:
                self._note(together)
                await _answer(actor.take.remote(together))
            for message in large:
                self._carrying.start(
                    "large message", self._carry(actor, message), partial(self._not_carried, message)
                )

    def _not_carried(self, message: ToRenderer, _: Exception) -> None:
        """An error of the server kept a large message from the renderer; what waits behind it goes on."""
        if isinstance(message, Update):
            self._link.send(Failed(message.task, message.generation, MISTAKE))
        self._incoming.extendleft(reversed(self._behind.pop(message.task, [])))
        self._news.set()

    def _note(self, messages: list[ToRenderer]) -> None:
        for message in messages:
            if isinstance(message, Drop):
                self._tasks.discard(message.task)
                self._actors.scenes.forget((self, message.task))

    async def _carry(self, actor: Any, message: ToRenderer) -> None:
        """Pass a large message on, and then let those go on that wait behind it."""
        from ray.exceptions import RayError

        with suppress(RayError):  # the actor is lost, which `_hear_all` is told too
            if isinstance(message, Update) and message.scene is not None:
                self._tasks.add(message.task)
                scene = await self._actors.scenes.put((self, message.task), message.scene)
                await _answer(actor.take_large.remote(replace(message, scene=None), scene))
            else:
                await _answer(actor.take_large.remote(await stored(message), None))
        self._incoming.extendleft(reversed(self._behind.pop(message.task)))
        self._news.set()

    async def _hear_all(self, actor: Any) -> ProcessEnded:
        while True:
            async with asyncio.timeout(SILENCE_S):
                messages = await _answer(actor.hear.remote())
            last: ProcessEnded | None = (
                messages.pop() if messages and isinstance(messages[-1], ProcessEnded) else None
            )
            for encoded in await asyncio.to_thread(_encoded, messages):
                self._link.send_encoded(encoded)
            if last is not None:
                return last
            while self._link.backlog > MOST_WAITING:
                await asyncio.sleep(0.01)

    async def _flush(self) -> None:
        until = asyncio.get_running_loop().time() + FLUSH_S
        while self._link.backlog and asyncio.get_running_loop().time() < until:
            await asyncio.sleep(0.01)


def _encoded(messages: list[FromRenderer]) -> list[channel.Encoded]:
    return [channel.encode(message) for message in messages]


async def _answer(reference: Any) -> Any:
    return await reference


def _said(error: Exception) -> str:
    """Ray's error in one line: of a traceback from a node the last, with the node's address."""
    lines = [line.strip() for line in re.sub(r"\x1b\[\d+m", "", str(error)).splitlines() if line.strip()]
    if len(lines) < 2:
        return "".join(lines)[:300]
    node = re.search(r"\bip=([0-9a-f.:]+)", lines[0])
    return lines[-1][:300] + (f" (on {node[1]})" if node else "")
