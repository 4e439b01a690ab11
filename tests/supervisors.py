"""A supervisor with a renderer's process of its own, for as long as one test takes; scenes for it, and ears."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, Protocol

from gpu import RenderSettings
from service.config import NICENESS
from service.document import parse_scene
from service.ipc.messages import FromRenderer, StopRule, View
from service.pack import pack
from service.renderers.local.process import Options
from service.renderers.local.supervisor import Supervisor
from tests.documents import Shelf
from tests.serving import AHEAD, PATIENCE_S, SCENE

SIZE = {"width": 32, "height": 32}
ENDLESS = StopRule()
LINEAR = View(encoding="linear")
SCENES: dict[str, Any] = {
    "plain": SCENE,
    "rich": {
        **SCENE,
        "environment": {"type": "sky", "sun_elevation": 30, "sun_azimuth": 0},
        "textures": {"t": {"type": "checker", "a": 0.1, "b": 0.8}},
        "materials": {
            "ball": {"type": "principled"},
            "floor": {"type": "diffuse", "albedo": {"texture": "t"}},
        },
    },
}
SETTINGS = {name: RenderSettings(32, 32, max_bounces=2, adaptive=name == "rich") for name in SCENES}


class Ears:
    """Listens to tasks, and has their messages in order; `lost` and `again` are among them as text."""

    def __init__(self) -> None:
        self.messages: asyncio.Queue[FromRenderer | str] = asyncio.Queue()

    def heard(self, message: FromRenderer) -> None:
        self.messages.put_nowait(message)

    def again(self) -> None:
        self.messages.put_nowait("again")

    def lost(self, detail: str) -> None:
        self.messages.put_nowait(detail)

    async def next(self, kind: Any) -> Any:
        """The next message of that kind, of whichever task."""
        while True:
            message = await asyncio.wait_for(self.messages.get(), PATIENCE_S)
            if isinstance(message, kind):
                return message

    async def next_of(self, task: int, *kinds: type) -> Any:
        """The next message of these kinds about `task`. AssertionError where a renderer is lost first."""
        while True:
            message: Any = await asyncio.wait_for(self.messages.get(), PATIENCE_S)
            assert not isinstance(message, str), message
            if message.task == task and isinstance(message, kinds):
                return message


class Rendering(Protocol):
    """Runs a test with the supervisor of a renderer, which stores renders as often as `checkpoint_s` says."""

    def __call__(self, test: Callable[[Supervisor], Awaitable[None]], checkpoint_s: float = 2.0) -> None: ...


def renderer_options(**given: Any) -> Options:
    """Options of a renderer's process, which compiles ahead what the session's servers do unless `ahead` is given,
    and is as nice as theirs."""
    return Options(**{"ahead": os.environ[AHEAD], "nice": NICENESS, **given})


def with_supervisor(test: Callable[[Supervisor], Awaitable[None]], checkpoint_s: float = 2.0, **options: Any) -> None:
    async def run() -> None:
        supervisor = Supervisor(renderer_options(checkpoint_s=checkpoint_s, **options))
        supervisor.start()
        try:
            await supervisor.ready(PATIENCE_S)
            await test(supervisor)
        finally:
            await supervisor.close()

    asyncio.run(run())


def settings(side: int = 32, **others: Any) -> dict[str, Any]:
    return {"width": side, "height": side, **others}


def arrays_of(name: str) -> Any:
    """One of `SCENES`, packed."""
    return pack(parse_scene(SCENES[name]), Shelf()).arrays


def compile_helpers(parent: int | None, priority: str = "now") -> list[int]:
    """Ids of the processes of `parent` that compile with that priority: `now` is what somebody waits for."""
    found = []
    for path in Path("/proc").glob("[0-9]*"):
        try:
            of = int((path / "stat").read_text().rsplit(")", 1)[1].split()[1])
            command = (path / "cmdline").read_bytes()
            if of == parent and b"compile_main" in command and b"--priority\0" + priority.encode() in command:
                found.append(int(path.name))
        except OSError:
            continue
    return found
