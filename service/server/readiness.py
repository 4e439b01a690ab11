"""Readiness: an earlier server's work is taken up while this one answers health already; whether a picture can be
rendered now; and the first frame of a scene that no client asked for, by which readiness is known and a start is
warmed up.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Coroutine, Iterable
from functools import partial
from typing import Any

from service.ipc.messages import Foresee, Frame, FromRenderer, StopRule, Update, View, Want
from service.pack import Packed, warm_builder, warm_light_tree
from service.problems import Internal, ServiceError, Unavailable
from service.renderers.ask import ask
from service.renderers.protocol import Renderers
from service.server.http.downloads import Downloads
from service.server.requests.request_reader import RequestReader
from service.system.background import Background
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


RETRY_S = 2


class Loading:
    """For the event loop."""

    def __init__(self) -> None:
        self.failed = False  # the server is to end: it would answer that there is nothing
        self.tasks = Background()  # of the start, which end with the server
        self._done = asyncio.Event()

    def start(self, work: Coroutine[Any, Any, None]) -> None:
        async def load() -> None:
            await work
            self._done.set()

        self.tasks.start("loading of what is stored", load(), self._fail)

    def check(self) -> None:
        """Raise Unavailable before it is done."""
        if not self._done.is_set():
            raise Unavailable("The server is still loading its stored renders.", RETRY_S)

    async def wait(self, seconds: float) -> None:
        """Return when it is done. Raises Unavailable after that time."""
        if not self._done.is_set():
            try:
                async with asyncio.timeout(seconds):
                    await self._done.wait()
            except TimeoutError:
                self.check()

    def _fail(self, error: Exception) -> None:
        self.failed = True


# A stream's kernel does not depend on its size, and of a picture so small there are no first looks meanwhile.
WARM_UP_SETTINGS = {"width": 16, "height": 16}

log = logging.getLogger(__name__)


async def first_frame(
    renderers: Renderers, packed: Packed, settings: dict[str, Any], patience_s: float | None = None
) -> Frame:
    """The frame of the first sample, rendered as a stream's; nothing stays behind in the renderer.

    `settings` are the arguments of gpu.RenderSettings. Raises Unavailable where there is no renderer, where it fails,
    and where it gives no frame within `patience_s`.
    """
    update = Update(0, 1, packed.arrays, settings, StopRule(max_samples=1), interactive=True)
    try:
        return await ask(renderers, update, Want(0, 1, View()), answer=Frame, kind="server", patience_s=patience_s)
    except TimeoutError:
        raise Unavailable(f"The renderer has not rendered anything for {patience_s:g} s.") from None
    except Internal as error:
        raise Unavailable(f"The renderer failed: {error.detail}") from None


async def warm_up(renderers: Renderers, reader: RequestReader, document: Any) -> bool:
    """Do what the first client would have to wait for: import modules, compile kernels; whether that succeeded.

    `document` is the scene that a client is likely to begin with. An error is logged and not raised: a client that
    comes later meets it as well.
    """
    began = time.monotonic()
    try:
        packed = await packing(partial(_packed, reader, document))
        settings = await packing(partial(reader.settings, WARM_UP_SETTINGS))
        # As many at a time as there are renderers: each gets one, as each one makes it busier than the others.
        frames = [first_frame(renderers, packed, settings.for_gpu()) for _ in renderers.members]
        for error in await asyncio.gather(*frames, return_exceptions=True):
            if isinstance(error, BaseException):
                raise error
    except ServiceError as error:
        log.warning("did not warm up", {"error": error})
        return False
    log.info("warmed up", {"seconds": round(time.monotonic() - began, 2)})
    return True


async def foresee(
    renderers: Renderers, reader: RequestReader, shown: Any, edits: Iterable[Any], others: Iterable[Any]
) -> None:
    """Compile the builders' code, and without hurry the kernels of scenes to which a client may change from the one
    that is `shown` first: by `edits` of it, or to `others`.

    An error is logged and not raised.
    """
    await packing(warm_builder)
    await packing(warm_light_tree)
    log.debug("loaded the builders")
    task = renderers.open(_Deaf(), "server")
    try:
        settings = (await packing(partial(reader.settings, WARM_UP_SETTINGS))).for_gpu()
        first = (await packing(partial(_packed, reader, shown))).arrays
        for document in edits:
            packed = await packing(partial(_packed, reader, document))
            renderers.send(Foresee(task, packed.arrays, settings, before=first))
        for document in others:
            packed = await packing(partial(_packed, reader, document))
            renderers.send(Foresee(task, packed.arrays, settings))
    except ServiceError as error:
        log.warning("did not foresee scenes", {"error": error})
    finally:
        renderers.drop(task)


def _packed(reader: RequestReader, document: Any) -> Packed:
    return reader.pack(reader.scene(document), owner="")


class _Deaf:
    """A Listener where nothing is answered."""

    def heard(self, message: FromRenderer) -> None: ...

    def again(self) -> None: ...

    def lost(self, detail: str) -> None: ...
