"""What the first client would have to wait for, done before it comes: modules, the builder's code, kernels."""

from __future__ import annotations

import asyncio
import logging
import time
from functools import partial
from typing import Any

from service.pack import warm_builder
from service.problems import ServiceError
from service.rendering.executors import packing
from service.rendering.ipc.messages import Failed, Frame, FromRenderer, StopRule, Update, View, Want
from service.rendering.renderers import Renderers
from service.rendering.requests.request_reader import RequestReader

SETTINGS = {"width": 64, "height": 64}

log = logging.getLogger(__name__)


class FirstFrame:
    """A first picture that nobody asked for: `document` in the default settings, as a stream would have it."""

    def __init__(self, renderers: Renderers, reader: RequestReader, document: Any) -> None:
        self._renderers = renderers
        self._reader = reader
        self._document = document
        self._seen = asyncio.Event()

    async def run(self) -> None:
        """Leaves nothing behind, and no error either: who comes later meets it himself."""
        began = time.monotonic()
        try:
            packed = await packing(lambda: self._reader.pack(self._reader.scene(self._document)))
            settings = await packing(partial(self._reader.settings, SETTINGS))
            task = self._renderers.open(self, "server")
        except ServiceError as error:
            log.warning("did not warm up error=%s", error)
            return
        try:
            stop = StopRule(max_samples=1)
            await self._renderers.send_scene(
                Update(task, 1, packed.arrays, settings.for_gpu(), stop, interactive=True)
            )
            self._renderers.send(Want(task, 1, View()))
            await self._seen.wait()
            log.info("warmed up seconds=%.2f", time.monotonic() - began)
        finally:
            self._renderers.drop(task)
        await packing(warm_builder)
        log.info("loaded the builder seconds=%.2f", time.monotonic() - began)

    def heard(self, message: FromRenderer) -> None:
        if isinstance(message, Frame | Failed):
            self._seen.set()

    def again(self) -> None:
        """A first picture is a first picture."""

    def lost(self, detail: str) -> None:
        self._seen.set()
