"""Sunbox for programs: scenes in, pictures out, over HTTP and WebSocket.

client           Client, Job, Batch, Picture, Stream: calls that wait
async_client     AsyncClient: the same calls to await; all that talks to a server is here and below
async_job        a render on the server, and its picture
async_batch      renders of one scene that differ along axes
async_stream     a scene that is edited while frames of it arrive
transport        requests, retries, uploads; refusals as exceptions
errors           the exceptions
files            the files that a scene names, and arrays in it
frames           a frame of a stream
lobes            what a BSDF answers, as arrays
verdicts         whether two pictures differ beyond noise
exports          scenes as files for other programs
merge            merge patches (RFC 7386)
progress         a line while a render goes on
view             View: a live picture in a notebook
live             a stream that is edited, and watched no faster than somebody looks
background       an event loop in a thread of its own
document         the scene's document as types, generated from a server's schema
mcp              `sunbox-mcp`: tools for agents, by the Model Context Protocol
agent_tools      the eight tools
agent_scenes     the scenes that they work on: documents and names, no files
agent_work       renders and batches that the same question goes on with
agent_answers    what they answer with
generate         writes `document`
local            `render` in this process

Nothing is imported before it is asked for: `import sunbox` costs a program that only may render next to nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sunbox.async_batch import AsyncBatch
    from sunbox.async_client import AsyncClient
    from sunbox.async_job import AsyncJob, AsyncPicture
    from sunbox.async_stream import AsyncStream
    from sunbox.client import Batch, Client, Job, Picture, Stream
    from sunbox.errors import Failed, NotFound, Refused, SunboxError, Unreachable
    from sunbox.exports import Exported
    from sunbox.frames import Frame
    from sunbox.lobes import Albedo, Bsdf, SpecularLobe
    from sunbox.local import render
    from sunbox.verdicts import Region, Verdict
    from sunbox.view import View

_PLACES = {
    "async_batch": ("AsyncBatch",),
    "async_client": ("AsyncClient",),
    "async_job": ("AsyncJob", "AsyncPicture"),
    "async_stream": ("AsyncStream",),
    "client": ("Batch", "Client", "Job", "Picture", "Stream"),
    "errors": ("Failed", "NotFound", "Refused", "SunboxError", "Unreachable"),
    "exports": ("Exported",),
    "frames": ("Frame",),
    "lobes": ("Albedo", "Bsdf", "SpecularLobe"),
    "local": ("render",),
    "verdicts": ("Region", "Verdict"),
    "view": ("View",),
}
_MODULE = {name: module for module, names in _PLACES.items() for name in names}

__all__ = [
    "Albedo",
    "AsyncBatch",
    "AsyncClient",
    "AsyncJob",
    "AsyncPicture",
    "AsyncStream",
    "Batch",
    "Bsdf",
    "Client",
    "Exported",
    "Failed",
    "Frame",
    "Job",
    "NotFound",
    "Picture",
    "Refused",
    "Region",
    "SpecularLobe",
    "Stream",
    "SunboxError",
    "Unreachable",
    "Verdict",
    "View",
    "render",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE:
        raise AttributeError(f"module 'sunbox' has no attribute {name!r}")
    return getattr(import_module(f"sunbox.{_MODULE[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
