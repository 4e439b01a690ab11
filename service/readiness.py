"""Able to render now: a small picture is asked for, and looked at."""

from __future__ import annotations

import asyncio
import time
from typing import Any

from service.pack import Packed
from service.problems import ServiceError, Unavailable
from service.rendering.executors import packing
from service.rendering.ipc.messages import Failed, Frame, FromRenderer, StopRule, Update, View, Want
from service.rendering.renderers import Renderers
from service.rendering.requests.request_reader import RequestReader

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 0, 3], "target": [0, 0, 0]},
    "environment": {"type": "constant", "radiance": 1},
    "materials": {"white": {"type": "diffuse", "albedo": 0.5}},
    "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "white"}],
}
SETTINGS = {"width": 8, "height": 8}
PATIENCE_S = 10.0
GOOD_S = 5.0  # how long an answer holds: whoever asks all the time costs nobody anything
SOFTWARE = "The renderer runs on the processor, and SUNBOX_REQUIRE_GPU asks for a GPU: {renderer}"


class Readiness:
    def __init__(self, renderers: Renderers, reader: RequestReader, require_gpu: bool) -> None:
        self._renderers = renderers
        self._reader = reader
        self._require_gpu = require_gpu
        self._packed: Packed | None = None
        self._good_until = 0.0
        self._renderer: dict[str, Any] | None = None  # that the last picture came from
        self._asking = asyncio.Lock()

    async def check(self) -> None:
        """Raises Unavailable, saying why."""
        async with self._asking:  # who comes meanwhile gets the answer that is being made
            renderer = await self._renderers.ready(0)
            if self._require_gpu and renderer.get("software"):
                raise Unavailable(SOFTWARE.format(renderer=renderer["renderer"]), 30)
            if renderer is not self._renderer or time.monotonic() >= self._good_until:
                await self._picture()
                self._renderer, self._good_until = renderer, time.monotonic() + GOOD_S

    async def _picture(self) -> None:
        probe = _Probe(asyncio.get_running_loop().create_future())
        try:
            if self._packed is None:
                self._packed = await packing(lambda: self._reader.pack(self._reader.scene(SCENE)))
            settings = self._reader.settings(SETTINGS).for_gpu()
            task = self._renderers.open(probe, "server")
        except ServiceError as error:
            raise Unavailable(f"Nothing can be rendered: {error}") from None
        try:
            stop = StopRule(max_samples=1)
            await self._renderers.send_scene(Update(task, 1, self._packed.arrays, settings, stop, interactive=True))
            self._renderers.send(Want(task, 1, View()))
            await asyncio.wait_for(probe.seen, PATIENCE_S)
        except TimeoutError:
            raise Unavailable(f"The renderer has not rendered anything for {PATIENCE_S:g} s.") from None
        finally:
            self._renderers.drop(task)


class _Probe:
    def __init__(self, seen: asyncio.Future[None]) -> None:
        self.seen = seen

    def heard(self, message: FromRenderer) -> None:
        if self.seen.done():
            return
        if isinstance(message, Failed):
            self.seen.set_exception(Unavailable(f"The renderer failed: {message.detail}"))
        elif isinstance(message, Frame):
            # A white sphere under a white sky: the middle of the picture is neither black nor clear.
            fine = bool((message.pixels[4, 4] > 0).all())
            if fine:
                self.seen.set_result(None)
            else:
                self.seen.set_exception(Unavailable("The renderer gives black pictures."))

    def again(self) -> None:
        """Another renderer is asked: the picture comes from that one."""

    def lost(self, detail: str) -> None:
        if not self.seen.done():
            self.seen.set_exception(Unavailable(detail))
