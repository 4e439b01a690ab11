"""Renderers that render nothing: they note what they are sent, and report what a test has them report."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from service.config import Config
from service.document import parse_scene, parse_settings
from service.document.quality import resolve
from service.ipc import channel
from service.ipc.messages import Done, Progress, Ready, Restore, SavedPicture, Unable, Update
from service.pack import Packed, pack
from service.problems import Unavailable
from service.renderers.local.process import Cause
from service.renderers.local.supervisor import Supervisor
from service.renderers.statistics import Statistics
from tests.documents import Shelf
from tests.serving import PATIENCE_S, SCENE

SETTINGS = resolve(parse_settings({"width": 4, "height": 4, "max_samples": 8}, "", Config()))
PACKED = pack(parse_scene(SCENE), Shelf())


class Renderers:
    """Takes tasks, and notes what is sent to them."""

    def __init__(self) -> None:
        self.statistics = Statistics()
        self.hopeless = False
        self.opened, self.sent = 0, list[Any]()
        self.clients = list[str]()

    def open(self, listener: Any, kind: str, client: str) -> int:
        if self.hopeless:
            raise Unavailable("nothing renders")
        self.clients.append(client)
        self.opened += 1
        return self.opened

    def drop(self, task: int) -> None:
        self.sent.append(("drop", task))

    def send(self, message: Any) -> None:
        self.sent.append(message)

    def stored(self, task: int, picture: SavedPicture, read: Callable[[], Restore]) -> None:
        self.sent.append(("stored", read()))

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        self.sent.append((update, restore))


class Quick(Renderers):
    """Ends each render as soon as it has the scene."""

    def __init__(self) -> None:
        super().__init__()
        self.listeners = dict[int, Any]()

    def open(self, listener: Any, kind: str, client: str) -> int:
        task = super().open(listener, kind, client)
        self.listeners[task] = listener
        return task

    async def send_scene(self, update: Update, restore: Restore | None = None) -> None:
        done = Done(update.task, 1, "max_samples", Progress(8, None, 1.0), [], None)
        asyncio.get_running_loop().call_later(0.01, self.listeners[update.task].heard, done)


async def load(document: bytes, count: Callable[[int], None]) -> Packed:
    return PACKED


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(10):
        while not condition():
            await asyncio.sleep(0.005)


class Fake:
    """A renderer's process: `told` is what it was sent, and a test has it report by `say(message)` and `lose()`, for
    the reason `cause`."""

    cause: Cause = "crashed"

    def __init__(self, driver: str, received: Callable[[Any], None], lost: Callable[[], None], lifeline: Any) -> None:
        self.began = self.lived_s = 0.0
        self.ready = self.unable = False
        self.task, self.id = 0, 4711
        self.link, self.told = self, list[Any]()
        self.say, self.lose = received, lost
        able = driver != ""
        word = Ready({"renderer": driver, "version": ""}) if able else Unable("There is no such device.")
        asyncio.get_running_loop().call_soon(received, word)
        if not able:
            asyncio.get_running_loop().call_soon(lost)

    def send(self, message: Any) -> None:
        self.told.append(message)

    def send_encoded(self, message: channel.Encoded) -> None:
        self.told.append(channel.decode(*message))

    def heard(self, kind: Any) -> list[int]:
        """The tasks of the messages of that kind, in order."""
        return [message.task for message in self.told if isinstance(message, kind)]

    def close(self) -> None: ...

    def watch(self, excused: bool = False) -> None: ...

    async def end(self, patience_s: float) -> Any:
        return self.cause


class FakeProcesses:
    """Begins a fake after the other; `now` is the one there is. With the driver "" they cannot render."""

    def __init__(self, driver: str = "fake", cause: Cause = "crashed") -> None:
        self.began = 0
        self._driver, self._cause = driver, cause
        self.now: Fake

    def __call__(self, *given: Any) -> Any:
        self.began += 1
        self.now = Fake(self._driver, *given)
        self.now.cause = self._cause
        return self.now


def with_fake_processes(test: Callable[[Supervisor], Awaitable[None]], processes: FakeProcesses) -> None:
    """Run a test with a supervisor whose processes are fakes."""

    async def run() -> None:
        supervisor = Supervisor(start=processes)
        supervisor.start()
        try:
            async with asyncio.timeout(PATIENCE_S):
                await test(supervisor)
        finally:
            await supervisor.close()

    asyncio.run(run())
