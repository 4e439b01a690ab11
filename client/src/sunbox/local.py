"""`render` in this process, where the server's package is installed: no server runs, the bits are those of the
command line."""

from __future__ import annotations

import asyncio
import weakref
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib.metadata import entry_points
from typing import Any

from sunbox import files
from sunbox.async_job import AsyncPicture
from sunbox.client import Picture, run
from sunbox.errors import SunboxError, from_problem

GROUP, NAME = "sunbox.renderers", "local"  # the entry point of a package that renders in this process


def render(scene: Any, **settings: Any) -> Picture:
    """The picture of a scene: a dict, or a path to its JSON file. Files are named by path. Ctrl-C ends it. Raises
    SunboxError as `Client.render` does, and RuntimeError where the package `sunbox-server` is not installed."""
    _engine()
    return Picture(run(_rendered(scene, settings)))


async def _rendered(scene: Any, settings: dict[str, Any]) -> AsyncPicture:
    document, folder = files.read_scene(scene)
    interrupt = _engine().Interrupt()
    try:
        made = await _on_gl_thread(lambda: _renderer().render(document, settings, folder, interrupt))
    except asyncio.CancelledError:
        _engine().stop(interrupt)
        raise

    async def fetch(format: str, view: dict[str, Any]) -> bytes:
        encoded: bytes = await _on_gl_thread(lambda: made.encoded(format, view))
        return encoded

    picture = AsyncPicture(fetch, made.status)
    weakref.finalize(picture, _thread().submit, made.close).atexit = False  # the process' end frees all of it
    return picture


async def _on_gl_thread(call: Any) -> Any:
    engine = _engine()
    try:
        return await asyncio.get_running_loop().run_in_executor(_thread(), call)
    except engine.ServiceError as error:
        status, document = engine.as_problem(error)
        problem: SunboxError = from_problem(document, status)
    raise problem


@cache
def _thread() -> ThreadPoolExecutor:
    """The one that has the OpenGL context."""
    return ThreadPoolExecutor(1, thread_name_prefix="sunbox-gl")


@cache
def _renderer() -> Any:
    return _engine().LocalRenderer()


@cache
def _engine() -> Any:
    """The server's package: LocalRenderer, Interrupt, stop, ServiceError and as_problem. This package knows that one
    by its entry point alone."""
    cause = None
    for entry in entry_points(group=GROUP, name=NAME):
        try:
            return entry.load()
        except ImportError as error:
            cause = error
    raise RuntimeError(
        "sunbox.render needs the package sunbox-server, which sunbox.Client does not: "
        "pip install ./client . in a checkout of Sunbox."
    ) from cause
