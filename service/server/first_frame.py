"""The first frame of a scene that no client asked for: readiness looks at it, and a start is warmed up by it."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Iterable
from functools import partial
from typing import Any

from service.ipc.messages import Foresee, Frame, FromRenderer, StopRule, Update, View, Want
from service.pack import Packed, warm_builder, warm_light_tree
from service.problems import Internal, ServiceError, Unavailable
from service.renderers.ask import ask
from service.renderers.protocol import Renderers
from service.server.requests.request_reader import RequestReader
from service.system.executors import packing

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
