"""Pictures: asked for in one shot, or started, watched, looked at and cancelled."""

from __future__ import annotations

import asyncio
import contextlib
from dataclasses import replace
from enum import IntEnum
from functools import partial
from typing import Annotated, Any, BinaryIO, get_args
from urllib.parse import urlencode

import numpy as np
from fastapi import APIRouter, Header, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from service import images, recipe, views
from service.downloads import Downloads, FileAnswer, Written, disconnected, present
from service.problems import Conflict, FieldError, InvalidDocument, Unavailable
from service.rendering.executors import writing
from service.rendering.ipc.messages import View
from service.rendering.jobs.job import Job
from service.rendering.jobs.store.record import State
from service.rendering.requests.request_parser import LONGEST_LABEL, unfolded
from service.routes import answers, events, submission
from service.routes.errors import GONE
from service.state import app_state, bodiless, caller, owner
from service.views import AOVS, DEFAULT_TONE_MAP, LEAST_EXPOSURE, MOST_EXPOSURE, Aov, AovOrAll, FileFormat, ToneMap

router = APIRouter(prefix="/v1", tags=["renders"])

LONGEST_WAIT_S = 600.0  # many proxies cut idle connections long before
Wait = Annotated[float, Query(ge=0, le=LONGEST_WAIT_S, allow_inf_nan=False, description="s")]
Saving = Annotated[
    bool,
    Query(
        description="Have measured what this render's kernel saves beside the one with everything on. That happens "
        "once, while nothing is being rendered; the other kernel may have to be compiled for it, in spare time (a "
        "minute and a half of a core by llvmpipe). Answers bring it from then on."
    ),
]
FLOAT_BYTES = 4  # of a number in a layer, as the renderer gives it
FILES = answers.files(*(images.FORMATS[name].mime for name in get_args(FileFormat)))


IdempotencyHeader = Annotated[str | None, Header(description="1 to 200 characters, the caller's own name for this.")]
MOST_LISTED = 200


class ListQuery(BaseModel):
    """Which of one's renders are listed."""

    model_config = ConfigDict(extra="forbid")
    label: Annotated[str | None, Field(max_length=LONGEST_LABEL, description="Exactly this label.")] = None
    state: State | None = None
    limit: Annotated[int, Field(ge=1, le=MOST_LISTED)] = 100
    after: Annotated[str | None, Field(description="The last id of the page before.")] = None


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
    job = await submission.one_shot(request)
    try:
        await _finished_or_gone(request, job)
        if not job.finished.is_set():
            return Response(status_code=GONE)
        if job.state == "cancelled":
            raise Unavailable("The server is shutting down.")
        return await _image(request, job, query, view)
    finally:
        app_state(request).renders.cancel(job)
        job.release()


@router.post(
    "/renders",
    status_code=202,
    summary="Start a render",
    description="It is stored before this answers, and outlives the server. `Idempotency-Key`: for 24 h the same key "
    "with the same body gives the same render, with another body 409.",
    openapi_extra=answers.LASTING_RENDER_BODY,
    response_model=None,
    responses=answers.shaped(answers.Render, "It waits for its turn; `Location` leads to it.", 202)
    | answers.problems(400, 409, 413, 415, 422, 429, 503),
)
async def start(request: Request, response: Response, idempotency_key: IdempotencyHeader = None) -> dict[str, Any]:
    status = await submission.submitted(request, idempotency_key)
    response.headers["location"] = f"renders/{status['id']}"
    return status


@router.get(
    "/renders",
    summary="One's own renders, the newest first",
    description="A page of them; `Link` with `rel=next` leads to the next page while there is one.",
    response_model=None,
    responses=answers.shaped(list[answers.Render]) | answers.problems(422),
)
async def renders(request: Request, response: Response, query: Annotated[ListQuery, Query()]) -> list[dict[str, Any]]:
    page = app_state(request).renders.page(owner(request), query.label, query.state, query.limit, query.after)
    if page.more:
        following = query.model_copy(update={"after": page.renders[-1].id})
        response.headers["link"] = f'<renders?{urlencode(following.model_dump(exclude_none=True))}>; rel="next"'
    return [job.status() for job in page.renders]


@router.get(
    "/renders/{id}",
    summary="How far it is",
    description="With `wait`, answers at the render's end, or after that many seconds; with `saving`, once that is "
    "measured as well.",
    response_model=None,
    responses=answers.shaped(answers.Render) | answers.problems(404, 410, 422),
)
async def status(request: Request, id: answers.RenderId, wait: Wait = 0, saving: Saving = False) -> dict[str, Any]:
    renders = app_state(request).renders
    job = renders.get(id, owner(request))
    with renders.looking(job):
        if saving:
            await job.measure_kernel()
        if wait:
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(job.settled(saving), wait)
    return job.status()


@router.get(
    "/renders/{id}/events",
    summary="Its progress as server-sent events",
    description="`progress` at most ten times a second and once `done`, each with the status as data; then the "
    "answer ends. When the server ends, it ends without `done`.",
    response_class=Response,
    responses=answers.EVENTS | answers.problems(404, 410),
)
async def progress(request: Request, id: answers.RenderId) -> Response:
    return events.answer(app_state(request).renders.get(id, owner(request)), bodiless(request))


@router.get(
    "/renders/{id}/image",
    summary="The image so far",
    response_class=Response,
    responses=FILES | answers.problems(404, 409, 410, 422, 503),
)
async def image(request: Request, id: answers.RenderId, query: Annotated[ImageQuery, Query()]) -> Response:
    renders = app_state(request).renders
    job = renders.get(id, owner(request))
    with renders.looking(job):
        return await _image(request, job, query, query.view())


@router.delete(
    "/renders/{id}",
    status_code=204,
    summary="Cancel; the image so far stays",
    responses=answers.problems(404, 410),
)
async def cancel(request: Request, id: answers.RenderId) -> None:
    renders = app_state(request).renders
    job = renders.get(id, owner(request))
    renders.cancel(job)
    await job.recorded()


async def _finished_or_gone(request: Request, job: Job) -> None:
    """Return when the job is finished, or the connection closed."""
    gone = asyncio.ensure_future(disconnected(request.receive))
    finished = asyncio.ensure_future(job.finished.wait())
    await asyncio.wait({gone, finished}, return_when=asyncio.FIRST_COMPLETED)
    gone.cancel()
    finished.cancel()


async def _image(request: Request, job: Job, query: ImageQuery, view: View) -> Response:
    own, downloads = app_state(request), app_state(request).downloads
    client = caller(request)
    key = (job.id, query.model_dump_json()) if job.state == "done" else None  # else it changes
    async with present(request.receive) as gone, downloads.turn(client):
        if gone():
            return Response(status_code=GONE)
        written = downloads.find(key)
        if written is None:
            downloads.admit(client, _most_bytes(job, query))
            with own.memory.held("pictures", _texels(job, query) * FLOAT_BYTES):
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
    document = await job.document()
    return await writing(lambda: downloads.write(partial(_write, layers, query, job, document, samples)))


def _aovs(query: ImageQuery) -> list[Aov]:
    return list(AOVS) if query.aov == "all" else [query.aov]


def _most_bytes(job: Job, query: ImageQuery) -> int:
    """About the bytes of a file that cannot be compressed."""
    format = images.FORMATS[query.format]
    bits = query.bits if query.bits in format.bits else format.bits[0]
    return _texels(job, query) * bits // 8


def _texels(job: Job, query: ImageQuery) -> int:
    """The numbers in the layers of an image."""
    return job.settings.width * job.settings.height * sum(len(images.LAYERS[aov]) for aov in _aovs(query))


def _write(
    layers: dict[str, np.ndarray], query: ImageQuery, job: Job, document: bytes, samples: int, file: BinaryIO
) -> None:
    bits: views.Bits = 16 if query.bits == Bits.SIXTEEN else 8
    made_from = None
    if images.FORMATS[query.format].has_metadata:
        view = recipe.PictureView(aov=query.aov, exposure=query.exposure, tone_map=query.tone_map, bits=bits)
        made_from = recipe.write_text(unfolded(document), job.settings, samples, view)
    if query.aov == "all":
        images.write_layers(file, layers, made_from)
    else:
        images.write(file, layers[query.aov], query.format, bits=bits, metadata=made_from)
