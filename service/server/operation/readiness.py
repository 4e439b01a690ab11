"""Whether the service can render now: it renders a small picture and looks at it."""

from __future__ import annotations

import asyncio
import time
from functools import partial
from typing import Any

from service.pack import Packed
from service.problems import ServiceError, Unavailable
from service.renderers.protocol import Renderers
from service.server.first_frame import first_frame
from service.server.http.downloads import Downloads
from service.server.requests.request_reader import RequestReader
from service.system.executors import packing, writing

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 0, 3], "target": [0, 0, 0]},
    "environment": {"type": "constant", "radiance": 1},
    "materials": {"grey": {"type": "diffuse", "albedo": 0.5}},
    "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "grey"}],
}
SETTINGS = {"width": 8, "height": 8}
ANSWER = bytes(4 * 8 * 8)
PATIENCE_S = 10.0
GOOD_S = 5.0  # how long an answer is reused, so that frequent checks take no time from renders
SOFTWARE = "The renderer runs on the processor, and SUNBOX_REQUIRE_GPU asks for a GPU: {renderer}"


class Readiness:
    def __init__(
        self, renderers: Renderers, reader: RequestReader, require_gpu: bool, downloads: Downloads | None = None
    ) -> None:
        self._renderers = renderers
        self._reader = reader
        self._require_gpu = require_gpu
        self._downloads = downloads
        self._packed: Packed | None = None
        self._good_until = 0.0
        self._renderer: dict[str, Any] | None = None  # the one that rendered the last picture
        self._asking = asyncio.Lock()

    async def check(self) -> None:
        """Return if a picture can be rendered and answered now. Raises Unavailable with the reason if not."""
        async with self._asking:  # a concurrent check gets the same answer
            renderer = await self._renderers.ready(0)
            if self._require_gpu and renderer.get("software"):
                raise Unavailable(SOFTWARE.format(renderer=renderer["renderer"]), 30)
            if renderer is not self._renderer or time.monotonic() >= self._good_until:
                await self._render()
                if self._downloads is not None:  # an answer needs memory, or the disk where there is none
                    await writing(partial(self._downloads.write, lambda file: file.write(ANSWER), len(ANSWER)))
                self._renderer, self._good_until = renderer, time.monotonic() + GOOD_S

    async def _render(self) -> None:
        """Raises Unavailable if no picture can be rendered, or a wrong one is."""
        try:
            if self._packed is None:
                self._packed = await packing(lambda: self._reader.pack(self._reader.scene(SCENE), owner=""))
            settings = self._reader.settings(SETTINGS).for_gpu()
        except ServiceError as error:
            raise Unavailable(f"Nothing can be rendered: {error}") from None
        frame = await first_frame(self._renderers, self._packed, settings, PATIENCE_S)
        # A grey sphere under a white sky: the middle of the picture is neither black nor transparent.
        if not (frame.pixels[4, 4] > 0).all():
            raise Unavailable("The renderer gives black pictures.")
