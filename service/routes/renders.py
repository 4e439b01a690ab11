"""Pictures: asked for in one shot, or started, watched, looked at and cancelled."""

from __future__ import annotations

import asyncio
import contextlib
import time
from dataclasses import replace
from enum import IntEnum
from functools import partial
from typing import Annotated, Any, BinaryIO, get_args

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from service import images, recipe, views
from service.downloads import Downloads, FileAnswer, Written, disconnected, present
from service.problems import Conflict, FieldError, InvalidDocument, Unavailable
from service.rendering.executors import packing, writing
from service.rendering.ipc.messages import View
from service.rendering.jobs.job import Job
from service.rendering.requests.request_parser import ParsedRequest, unfolded
from service.routes import answers
from service.routes.errors import GONE
from service.state import STARTING_S, AppState, app_state, caller, owner
from service.views import AOVS, DEFAULT_TONE_MAP, LEAST_EXPOSURE, MOST_EXPOSURE, Aov, AovOrAll, FileFormat, ToneMap

router = APIRouter(prefix="/v1", tags=["renders"])

LONGEST_WAIT_S = 600.0  # many proxies cut idle connections long before
Wait = Annotated[float, Query(ge=0, le=LONGEST_WAIT_S, allow_inf_nan=False, description="s")]
Saving = Annotated[
    bool,
    Query(
        description="Have measured what this render's kernel saves beside the one with everything on. That happens "
        "once, while nothing is being rendered; the other kernel may have to be compiled for it, in spare time (17 s "
        "of a core by llvmpipe). Answers bring it from then on."
    ),
]
FILES = answers.files(*(images.FORMATS[name].mime for name in get_args(FileFormat)))


class Bits(IntEnum):
    EIGHT = 8
    SIXTEEN = 16


class ImageQuery(BaseModel):
    """How an image is written. EXR, npy and HDR hold linear values; exposure and tone map are for the others."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    format: FileFormat = "png"
    bits: Bits = Bits.EIGHT
    aov: AovOrAll = "color"
    exposure: Annotated[float, Field(ge=LEAST_EXPOSURE, le=MOST_EXPOSURE)] = 0.0
    tone_map: ToneMap = DEFAULT_TONE_MAP

    def view(self) -> View:
        if self.bits == Bits.SIXTEEN and 16 not in images.FORMATS[self.format].bits:
            raise InvalidDocument([FieldError("/bits", f"16 is for png; a {self.format} file has its own")])
        if self.aov == "all" and self.format != "exr":
            raise InvalidDocument([FieldError("/aov", "all is for exr: no other format holds more than one")])
        return View(self.aov, self.exposure, self.tone_map, images.FORMATS[self.format].encoding(self.bits))


@router.post(
    "/render",
    summary="Render and return the image",
    description="Waits for the render's end; closing the connection cancels it.",
    openapi_extra=answers.RENDER_BODY,
    response_class=Response,
    responses=FILES | answers.problems(400, 413, 415, 422, 429, 503),
)
async def render(request: Request, query: Annotated[ImageQuery, Query()]) -> Response:
    view = query.view()
    job = await _job(request)
    app_state(request).renders.submit(job, listed=False)
    try:
        await _finished_or_gone(request, job)
        if not job.finished.is_set():
            return Response(status_code=GONE)
        if job.state == "cancelled":
            raise Unavailable("The server is shutting down.")
        return await _image(request, job, query, view)
    finally:
        job.cancel()
        job.release()


@router.post(
    "/renders",
    status_code=202,
    summary="Start a render",
    openapi_extra=answers.RENDER_BODY,
    response_model=None,
    responses=answers.shaped(answers.Render, "It waits for its turn; `Location` leads to it.", 202)
    | answers.problems(400, 413, 415, 422, 429, 503),
)
async def start(request: Request, response: Response) -> dict[str, Any]:
    job = await _job(request)
    app_state(request).renders.submit(job)
    response.headers["location"] = f"renders/{job.id}"
    return job.status()


@router.get(
    "/renders",
    summary="One's own renders",
    response_model=None,
    responses=answers.shaped(list[answers.Render]),
)
async def renders(request: Request) -> list[dict[str, Any]]:
    return [job.status() for job in app_state(request).renders.all(owner(request))]


@router.get(
    "/renders/{id}",
    summary="How far it is",
    description="With `wait`, answers at the render's end, or after that many seconds; with `saving`, once that is "
    "measured as well.",
    response_model=None,
    responses=answers.shaped(answers.Render) | answers.problems(404, 410, 422),
)
async def status(request: Request, id: answers.RenderId, wait: Wait = 0, saving: Saving = False) -> dict[str, Any]:
    job = app_state(request).renders.get(id, owner(request))
    if saving:
        job.measure_kernel()
    if wait:
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(job.settled(saving), wait)
    return job.status()


@router.get(
    "/renders/{id}/image",
    summary="The image so far",
    response_class=Response,
    responses=FILES | answers.problems(404, 409, 410, 422),
)
async def image(request: Request, id: answers.RenderId, query: Annotated[ImageQuery, Query()]) -> Response:
    return await _image(request, app_state(request).renders.get(id, owner(request)), query, query.view())


@router.delete(
    "/renders/{id}",
    status_code=204,
    summary="Cancel; the image so far stays",
    responses=answers.problems(404, 410),
)
async def cancel(request: Request, id: answers.RenderId) -> None:
    app_state(request).renders.get(id, owner(request)).cancel()


async def _job(request: Request) -> Job:
    began = time.monotonic()
    own: AppState = app_state(request)
    async with own.bodies.taken(request) as body:
        own.renders.admit(owner(request))
        await own.renderers.able(STARTING_S)
        parsed: ParsedRequest = await own.bodies.parsed("request", body)
    packed = await packing(partial(own.reader.pack, parsed.scene))
    setup_s = time.monotonic() - began
    return Job(own.renderers, packed, parsed.settings, setup_s, owner(request), parsed.document)


async def _finished_or_gone(request: Request, job: Job) -> None:
    """Return when the job is finished, or the connection closed."""
    gone = asyncio.ensure_future(disconnected(request.receive))
    finished = asyncio.ensure_future(job.finished.wait())
    await asyncio.wait({gone, finished}, return_when=asyncio.FIRST_COMPLETED)
    gone.cancel()
    finished.cancel()


async def _image(request: Request, job: Job, query: ImageQuery, view: View) -> Response:
    downloads = app_state(request).downloads
    client = caller(request)
    key = (job.id, query.model_dump_json()) if job.state == "done" else None  # else it changes
    async with present(request.receive) as gone, downloads.turn(client):
        if gone():
            return Response(status_code=GONE)
        written = downloads.find(key)
        if written is None:
            downloads.admit(client, _most_bytes(job, query))
            written = await _written(downloads, job, query, view)
            downloads.keep(client, key, written)
    return FileAnswer(written.file, images.FORMATS[query.format].mime, {"cache-control": "no-store"}, held=written)


async def _written(downloads: Downloads, job: Job, query: ImageQuery, view: View) -> Written:
    layers: dict[str, np.ndarray] = {}
    samples = 0
    for aov in _aovs(query):
        layers[aov], progress = await job.image(replace(view, aov=aov))
        samples = samples or progress.samples
        if samples == 0:
            raise Conflict("There is no sample yet.")
    return await writing(lambda: downloads.write(partial(_write, layers, query, job, samples)))


def _aovs(query: ImageQuery) -> list[Aov]:
    return list(AOVS) if query.aov == "all" else [query.aov]


def _most_bytes(job: Job, query: ImageQuery) -> int:
    """About the bytes of a file that cannot be compressed."""
    format = images.FORMATS[query.format]
    channels = sum(len(images.LAYERS[aov]) for aov in _aovs(query))
    bits = query.bits if query.bits in format.bits else format.bits[0]
    return job.settings.width * job.settings.height * channels * bits // 8


def _write(layers: dict[str, np.ndarray], query: ImageQuery, job: Job, samples: int, file: BinaryIO) -> None:
    bits: views.Bits = 16 if query.bits == Bits.SIXTEEN else 8
    made_from = None
    if images.FORMATS[query.format].has_metadata:
        view = recipe.PictureView(aov=query.aov, exposure=query.exposure, tone_map=query.tone_map, bits=bits)
        made_from = recipe.write_text(unfolded(job.document), job.settings, samples, view)
    if query.aov == "all":
        images.write_layers(file, layers, made_from)
    else:
        images.write(file, layers[query.aov], query.format, bits=bits, metadata=made_from)
