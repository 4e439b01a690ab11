"""Renders: answered at once, or started, watched, read and cancelled."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import replace
from enum import IntEnum
from functools import partial
from typing import Annotated, BinaryIO, get_args
from urllib.parse import urlencode

import numpy as np
from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field

from service import views
from service.displays import SRGB
from service.document.grading import Lut, ToneMap, shown_as
from service.document.text import load_json
from service.formats import images
from service.formats.images import recipe
from service.formats.images.cryptomatte import LAYERS as CRYPTOMATTE_LAYERS
from service.formats.images.cryptomatte import Cryptomatte, names_of
from service.ipc import messages
from service.ipc.messages import View
from service.problems import Conflict, FieldError, InvalidDocument, Unavailable
from service.server.http.downloads import Downloads, FileAnswer, Written, present
from service.server.renders.render import Render
from service.server.renders.store.record import State
from service.server.requests.request_parser import LONGEST_LABEL, unfolded
from service.server.routes import answers, events, json_answers, submission, waiting
from service.server.routes.errors import GONE
from service.server.routes.submission import IdempotencyHeader
from service.server.state import MOST_WAITS, app_state, caller_of, owner_of
from service.system.executors import storing, writing
from service.views import AOVS, DEFAULT_TONE_MAP, LEAST_EXPOSURE, MOST_EXPOSURE, Aov, AovOrAll, FileFormat

router = APIRouter(prefix="/v1", tags=["renders"])

LONGEST_WAIT_S = 600.0  # many proxies cut idle connections long before
Wait = Annotated[
    float,
    Query(
        ge=0,
        le=LONGEST_WAIT_S,
        allow_inf_nan=False,
        description=f"Seconds. One caller has at most {MOST_WAITS} answers that wait, event streams included.",
    ),
]
Kernel = Annotated[bool, Query(description="Answer with what the kernel was compiled for, too.")]
Label = Annotated[str | None, Query(max_length=LONGEST_LABEL, description="Exactly this label.")]
CRYPTOMATTE_NUMBERS = (
    48  # of a pixel: 12 for each of two layers as the renderer sends them, and once more with hashes
)
FLOAT_BYTES = 4  # of a number in a layer, as the renderer sends it
FILES = answers.files(*(images.FORMATS[name].mime for name in get_args(FileFormat)))


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
    """How an image is encoded. EXR, npy and HDR store linear values; exposure and tone map apply to the others."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    format: FileFormat = "png"
    bits: Bits = Bits.EIGHT
    aov: AovOrAll = "color"
    exposure: Annotated[float, Field(ge=LEAST_EXPOSURE, le=MOST_EXPOSURE)] = 0.0
    tone_map: ToneMap = DEFAULT_TONE_MAP
    color_space: views.ColorSpace = "srgb"
    lut: Lut = None
    cryptomatte: Annotated[
        bool,
        Field(description="With exr: what shapes and materials cover of each pixel, by the hash of their names."),
    ] = False

    def view(self) -> View:
        if self.bits == Bits.SIXTEEN and 16 not in images.FORMATS[self.format].bits:
            raise InvalidDocument([FieldError("/bits", f"16 is for png; a {self.format} file has its own")])
        if self.aov == "all" and self.format != "exr":
            raise InvalidDocument([FieldError("/aov", "all is for exr: no other format holds more than one")])
        if self.cryptomatte and (self.format != "exr" or self.aov not in ("color", "all")):
            raise InvalidDocument([FieldError("/cryptomatte", "is for exr, with the aov color or all")])
        shown_as(self.tone_map, self.color_space, self.format)
        encoding, p3 = images.FORMATS[self.format].encoding(self.bits), self.color_space == "display_p3"
        return View(self.aov, self.exposure, self.tone_map, encoding, p3)


@router.post(
    "/render",
    summary="Render and return the image",
    description="Waits for the render's end; closing the connection cancels it.",
    openapi_extra=answers.RENDER_BODY,
    response_class=Response,
    responses=FILES | answers.problems(400, 413, 415, 422, 429, 503),
)
async def render(request: Request, query: Annotated[ImageQuery, Query()]) -> Response:
    query.view()  # before anything is rendered
    await lut_of(request, query.lut)
    job = await submission.one_shot(request)
    try:
        if not await waiting.until(request, job.finished.wait()):
            return Response(status_code=GONE)
        if job.state == "cancelled":
            raise Unavailable("The server is shutting down.")
        return await _image(request, job, query)
    finally:
        app_state(request).render_queue.cancel(job)
        job.release()


@router.post(
    "/renders",
    status_code=202,
    summary="Start a render",
    description="It is stored before this answers, and outlives the server. `Idempotency-Key`: for 24 h the same key "
    "with the same body gives the same render, with another body 409. With `wait`, 200 where the render ends within "
    "that many seconds; closing the connection does not cancel it. `callback`: a URL that is sent its end.",
    openapi_extra=answers.LASTING_RENDER_BODY,
    response_class=Response,
    responses=answers.shaped(answers.Render, "It waits for its turn, or goes on; `Location` leads to it.", 202)
    | answers.shaped(answers.Render, "With `wait`: it has ended.")
    | answers.problems(400, 409, 413, 415, 422, 429, 503),
)
async def start(request: Request, wait: Wait = 0, idempotency_key: IdempotencyHeader = None) -> Response:
    code = 202
    with waiting.place(request) if wait else contextlib.nullcontext():
        found = await submission.submitted(request, idempotency_key)
        if isinstance(found, Render) and wait:
            if not await waiting.until(request, found.over.wait(), wait):
                return Response(status_code=GONE)
            if found.finished.is_set():
                code = 200
    status = found.status() if isinstance(found, Render) else found
    return JSONResponse(status, code, {"location": f"renders/{status['id']}"})


@router.get(
    "/renders",
    summary="One's own renders, the newest first",
    description="A page of them; `Link` with `rel=next` leads to the next page while there is one.",
    response_class=Response,
    responses=answers.shaped(list[answers.Render]) | answers.problems(422),
)
async def renders(request: Request, query: Annotated[ListQuery, Query()]) -> Response:
    renders, owner = app_state(request).render_queue, owner_of(request)
    page = await renders.page(owner, query.label, query.state, query.limit, query.after)
    headers = dict[str, str]()
    if page.more:
        following = query.model_copy(update={"after": page.renders[-1].id})
        headers["link"] = f'<renders?{urlencode(following.model_dump(exclude_none=True))}>; rel="next"'
    listed = [job.snapshot() for job in page.renders]
    return await json_answers.made(lambda: [status() for status in listed], headers=headers)


@router.get(
    "/renders/events",
    summary="The progress of all of one's own renders as server-sent events",
    description="`progress` of each render that is under way, of those that are started later, and of each at most "
    f"ten times a second, {events.AT_ONCE * 10} events a second in all; `done` once a render has ended. Each has the "
    "render's status as data. Renders that had ended before are not in it: open it first, then start or list them. "
    "It ends with the server.",
    response_class=Response,
    responses=answers.EVENTS | answers.problems(422, 429),
)
async def all_progress(request: Request, label: Label = None) -> Response:
    return events.of_all(request, app_state(request).render_queue, owner_of(request), label)


@router.get(
    "/renders/{id}",
    summary="How far it is",
    description="With `wait`, answers at the render's end, or after that many seconds.",
    response_class=Response,
    responses=answers.shaped(answers.Render) | answers.problems(404, 410, 422, 429),
)
async def status(request: Request, id: answers.RenderId, wait: Wait = 0, kernel: Kernel = False) -> Response:
    state = app_state(request)
    if (place := state.batches.waiting(id, owner_of(request))) is not None:
        batch, step = place
        return JSONResponse(batch.waiting_status(step))
    job = await _render(request, id)
    with waiting.place(request) if wait else contextlib.nullcontext():
        if wait and not await waiting.until(request, job.over.wait(), wait):
            return Response(status_code=GONE)
    return JSONResponse(job.status(kernel=kernel))


@router.get(
    "/renders/{id}/events",
    summary="Its progress as server-sent events",
    description="`progress` at most ten times a second and once `done`, each with the status as data; then the "
    "answer ends. When the server ends, it ends without `done`.",
    response_class=Response,
    responses=answers.EVENTS | answers.problems(404, 410, 429),
)
async def progress(request: Request, id: answers.RenderId) -> Response:
    return events.of_one(request, await _render(request, id))


@router.get(
    "/renders/{id}/scene",
    summary="Its scene and settings",
    description="A body that renders the same picture again: the scene as it was sent, the settings as they were "
    "resolved.",
    response_class=Response,
    responses=answers.RENDER_AGAIN | answers.problems(404, 410, 503),
)
async def scene(request: Request, id: answers.RenderId) -> Response:
    state, job = app_state(request), await _render(request, id)
    document = await job.document()
    settings = json.dumps({name: value for name, value in job.order.settings.document().items() if value is not None})
    body = await writing(lambda: f'{{"scene":{unfolded(document)},"settings":{settings}}}'.encode())
    return await state.downloads.answer(caller_of(request), body, "application/json")


@router.get(
    "/renders/{id}/image",
    summary="The image so far",
    response_class=Response,
    responses=FILES | answers.problems(404, 409, 410, 422, 429, 503),
)
async def image(request: Request, id: answers.RenderId, query: Annotated[ImageQuery, Query()]) -> Response:
    job = await _render(request, id)
    return await _image(request, job, query)


@router.delete(
    "/renders/{id}",
    status_code=204,
    summary="Cancel; delete what has ended",
    description="A render that waits or runs is cancelled, and its image so far stays. One that has ended is deleted "
    "with its image, and answered 410 from then on. So the second call deletes what the first one cancelled.",
    responses=answers.problems(404, 410, 503),
)
async def delete(request: Request, id: answers.RenderId) -> None:
    renders, job = app_state(request).render_queue, await _render(request, id)
    if job.finished.is_set():
        if job.batch is not None:
            raise Conflict("This render belongs to a batch: delete the batch.")
        await renders.delete(job)
    else:
        renders.cancel(job)
        await job.recorded()


async def _render(request: Request, id: str) -> Render:
    """Raises NotFound, Gone, and Conflict for one of a batch that waits for its turn."""
    return await app_state(request).batches.render(id, owner_of(request))


async def _image(request: Request, job: Render, query: ImageQuery) -> Response:
    query.view()
    async with present(request.receive) as gone:
        written = await picture_file(request, job, query, gone)
    if written is None:
        return Response(status_code=GONE)
    return FileAnswer(written.file, images.FORMATS[query.format].mime, {"cache-control": "no-store"}, source=written)


async def picture_file(
    request: Request, job: Render, query: ImageQuery, gone: Callable[[], bool] = lambda: False
) -> Written | None:
    """The file of a render's picture; None where the client has `gone` before its turn. Raises Conflict before the
    first sample, and the render's own error where it failed."""
    state, downloads = app_state(request), app_state(request).downloads
    caller = caller_of(request)
    key = (job.id, query.model_dump_json()) if job.state == "done" else None  # else it changes
    async with downloads.turn(caller):
        if gone():
            return None
        written = downloads.find(key)
        if written is None:
            downloads.admit(caller, _most_bytes(job, query))
            with state.memory.reserved("pictures", _texels(job, query) * FLOAT_BYTES):
                written = await _written(downloads, job, query, await lut_of(request, query.lut))
            downloads.keep(caller, key, written, lasting=key is not None and query.aov == "all")
    return written


async def lut_of(request: Request, id: str | None) -> messages.Lut | None:
    """The table of colours that a query names. Raises InvalidDocument."""
    if id is None:
        return None
    return await storing(partial(app_state(request).reader.lut, id, owner=owner_of(request)), caller_of(request))


async def _written(downloads: Downloads, job: Render, query: ImageQuery, lut: messages.Lut | None) -> Written:
    view = replace(query.view(), lut=lut)
    layers: dict[str, np.ndarray] = {}
    samples = 0
    for aov in _aovs(query):
        layers[aov], progress = await job.image(replace(view, aov=aov))
        samples = samples or progress.samples
        if samples == 0:
            raise Conflict("There is no sample yet.")
    for covered in CRYPTOMATTE_LAYERS if query.cryptomatte else ():
        layers[covered], _ = await job.image(replace(view, aov=covered))
    document = await job.document()
    fill = partial(_write, layers, query, job, document, samples)
    return await writing(partial(downloads.write, fill, _most_bytes(job, query)))


def _aovs(query: ImageQuery) -> list[Aov]:
    return list(AOVS) if query.aov == "all" else [query.aov]


def _most_bytes(job: Render, query: ImageQuery) -> int:
    """About the bytes of a file that cannot be compressed."""
    format = images.FORMATS[query.format]
    bits = query.bits if query.bits in format.bits else format.bits[0]
    return _texels(job, query) * bits // 8


def _texels(job: Render, query: ImageQuery) -> int:
    """The numbers in the layers of an image."""
    numbers = sum(len(images.LAYERS[aov]) for aov in _aovs(query)) + CRYPTOMATTE_NUMBERS * query.cryptomatte
    return job.order.settings.width * job.order.settings.height * numbers


def _write(
    layers: dict[str, np.ndarray], query: ImageQuery, job: Render, document: bytes, samples: int, file: BinaryIO
) -> None:
    bits: views.Bits = 16 if query.bits == Bits.SIXTEEN else 8
    made_from = None
    if images.FORMATS[query.format].has_metadata:
        view = recipe.PictureView(
            aov=query.aov,
            exposure=query.exposure,
            tone_map=query.tone_map,
            bits=bits,
            color_space=query.color_space,
            lut=query.lut,
        )
        made_from = recipe.write_text(unfolded(document), job.order.settings, samples, view)
    if query.cryptomatte:
        coverage = {aov: layers[aov] for aov in CRYPTOMATTE_LAYERS}
        others = {aov: layer for aov, layer in layers.items() if aov not in coverage}
        matte = Cryptomatte(coverage, names_of(load_json(unfolded(document))))
        images.write_layers(file, others, made_from, matte)
    elif query.aov == "all":
        images.write_layers(file, layers, made_from)
    else:
        stands = shown_as(query.tone_map, query.color_space) if query.aov == "color" else SRGB
        images.write(file, layers[query.aov], query.format, bits=bits, metadata=made_from, encoding=stands)
