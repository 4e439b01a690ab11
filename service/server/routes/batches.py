"""Batches: one scene whose renders differ along axes; started, watched, and their pictures read together."""

from __future__ import annotations

import contextlib
import secrets
import time
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field

from service.config import MIB
from service.displays import SRGB
from service.document.grading import Lut, ToneMap, shown_as
from service.formats import images
from service.formats.images import animation
from service.formats.images.animation import AnimationFormat
from service.ipc.messages import View
from service.problems import Conflict, FieldError, InvalidDocument, TooLarge
from service.server.batches.batch import Batch
from service.server.batches.posing import with_poses
from service.server.renders.store.batch_rows import BatchOrder
from service.server.renders.store.record import IdempotencyKey
from service.server.requests.batch_request import ParsedBatch
from service.server.routes import answers, batch_files, json_answers, submission, waiting
from service.server.routes.errors import GONE
from service.server.routes.examples import BATCH_ID
from service.server.routes.renders import ImageQuery, Wait, lut_of
from service.server.routes.submission import ID_BYTES, IdempotencyHeader, allowed
from service.server.state import STARTING_S, AppState, app_state, caller_of, owner_of
from service.system.executors import storing
from service.views import DEFAULT_TONE_MAP, LEAST_EXPOSURE, MOST_EXPOSURE

router = APIRouter(prefix="/v1", tags=["batches"])

# Of a request, which stays in memory while its renders are made; larger geometry is uploaded as an asset.
MOST_BYTES = 2 * MIB
BatchId = Annotated[str, Path(description="As the answer to the batch's start has it.", examples=[BATCH_ID])]
Width = Annotated[int | None, Field(ge=1, description="Pixels of one picture, which is scaled down, never up.")]


class Shown(BaseModel):
    """How pictures are shown."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    exposure: Annotated[float, Field(ge=LEAST_EXPOSURE, le=MOST_EXPOSURE)] = 0.0
    tone_map: ToneMap = DEFAULT_TONE_MAP
    lut: Lut = None

    async def view(self, request: Request) -> View:
        """Raises InvalidDocument."""
        if shown_as(self.tone_map, "srgb") != SRGB:
            detail = "names another display than sRGB's, for which sheets and animations are"
            raise InvalidDocument([FieldError("/tone_map", detail)])
        return View("color", self.exposure, self.tone_map, "u1", lut=await lut_of(request, self.lut))


class SheetQuery(Shown):
    format: batch_files.SheetFormat = "png"
    width: Width = None


class AnimationQuery(Shown):
    format: AnimationFormat = "apng"
    fps: Annotated[float, Field(gt=0, le=120, description="Pictures a second.")] = 24.0
    width: Width = None


@router.post(
    "/batches",
    status_code=202,
    summary="Start renders that differ along axes",
    description="Axes multiply, and the last runs fastest. Each step of each axis is validated before this answers, "
    "the other axes being at their first, and glTF files are posed at each time; no scene is packed before its turn. "
    "Render k is, to the bit, the render of "
    "its document alone. `Idempotency-Key` as for renders. A `callback` is sent once, at the batch's end.",
    openapi_extra=answers.BATCH_BODY,
    response_class=Response,
    responses=answers.shaped(answers.StartedBatch, "Its renders wait for their turns; `Location` leads to it.", 202)
    | answers.problems(400, 404, 409, 413, 415, 422, 429, 503),
)
async def start(request: Request, idempotency_key: IdempotencyHeader = None) -> Response:
    state, owner = app_state(request), owner_of(request)
    submission.check_key(state, idempotency_key)

    async def ready(body: bytearray) -> None:
        if len(body) > MOST_BYTES:
            raise TooLarge(f"The body of a batch holds at most {MOST_BYTES // MIB} MiB: upload geometry as assets.")
        if await submission.is_new(owner, idempotency_key, state.batches.keyed):
            state.batches.admit(owner)
        await state.renderers.able(STARTING_S)

    parsed: ParsedBatch
    async with state.bodies.read(request, "batch", caller_of(request), ready) as parsed:

        async def make(key: IdempotencyKey | None) -> Batch:
            posed = await storing(partial(with_poses, parsed, state.storage, owner), caller_of(request))
            return await _started(state, owner, posed, key)

        keyed = state.batches.keyed
        found = await submission.once(state, "batch", owner, idempotency_key, parsed.digest, keyed, make)
    batch = state.batches.get(found, owner) if isinstance(found, str) else found
    document = {"id": batch.id, "renders": batch.order.renders}
    return JSONResponse(document, 202, {"location": f"batches/{batch.id}"})


async def _started(state: AppState, owner: str, parsed: ParsedBatch, key: IdempotencyKey | None) -> Batch:
    order = BatchOrder(
        secrets.token_hex(ID_BYTES), owner, parsed.renders, parsed.axes, parsed.label, parsed.priority, time.time(),
        len(parsed.body) + len(parsed.axes), parsed.callback,
    )  # fmt: skip
    state.callbacks.check(parsed.callback, owner, state.render_queue.store is not None)
    async with allowed(state, owner, parsed.uses) as uses:
        batch = await state.batches.submit(order, parsed.body, uses, key)
    if parsed.callback is not None:
        state.callbacks.follow(batch)
    return batch


@router.get(
    "/batches/{id}",
    summary="How far its renders are",
    description="With `wait`, answers at the batch's end, or after that many seconds.",
    response_class=Response,
    responses=answers.shaped(answers.Batch) | answers.problems(404, 410, 422, 429),
)
async def status(request: Request, id: BatchId, wait: Wait = 0) -> Response:
    batch = app_state(request).batches.get(id, owner_of(request))
    with waiting.place(request) if wait else contextlib.nullcontext():
        if wait and not await waiting.until(request, batch.finished.wait(), wait):
            return Response(status_code=GONE)
    return await json_answers.made(batch.snapshot())


@router.delete(
    "/batches/{id}",
    status_code=204,
    summary="Cancel; delete what has ended",
    description="The renders of a batch that wait or run are cancelled, and their pictures so far stay. A batch that "
    "has ended is deleted with all its renders, and answered 410 from then on.",
    responses=answers.problems(404, 410, 503),
)
async def delete(request: Request, id: BatchId) -> None:
    batches = app_state(request).batches
    batch = batches.get(id, owner_of(request))
    if batch.finished.is_set():
        await batches.delete(batch)
    else:
        await batches.cancel(batch)


@router.get(
    "/batches/{id}/images.zip",
    summary="The pictures of all renders that are done, zipped",
    description="`0000-name.png` and so on, in the renders' order; each as its `image` would be.",
    response_class=Response,
    responses=answers.files("application/zip") | answers.problems(404, 409, 410, 422, 429, 503),
)
async def images_zip(request: Request, id: BatchId, query: Annotated[ImageQuery, Query()]) -> Response:
    query.view()
    await lut_of(request, query.lut)
    batch = app_state(request).batches.get(id, owner_of(request))
    return batch_files.zipped(request, batch, query, _pictured(batch))


@router.get(
    "/batches/{id}/sheet",
    summary="A contact sheet of the pictures that there are",
    description="Two axes are its rows and columns; of more, the last is its columns.",
    response_class=Response,
    responses=answers.files(*(images.FORMATS[name].mime for name in batch_files.SHEET_FORMATS))
    | answers.problems(404, 409, 410, 413, 422, 429, 503),
)
async def sheet(request: Request, id: BatchId, query: Annotated[SheetQuery, Query()]) -> Response:
    batch = app_state(request).batches.get(id, owner_of(request))
    view = await query.view(request)
    return await batch_files.sheet(request, batch, query.format, query.width, view, _pictured(batch))


@router.get(
    "/batches/{id}/animation",
    summary="The pictures that there are, one after the other",
    description="Those that are missing are left out. MP4 needs the program ffmpeg on the server: 501 without it.",
    response_class=Response,
    responses=answers.files(*animation.MIME.values()) | answers.problems(404, 409, 410, 413, 422, 429, 501, 503),
)
async def animated(request: Request, id: BatchId, query: Annotated[AnimationQuery, Query()]) -> Response:
    batch = app_state(request).batches.get(id, owner_of(request))
    steps, view = _pictured(batch), await query.view(request)
    return await batch_files.animated(request, batch, query.format, query.fps, query.width, view, steps)


def _pictured(batch: Batch) -> list[int]:
    """The steps whose renders are done. Raises Conflict where none is."""
    if not (steps := batch.pictured):
        raise Conflict("None of the batch's renders is done yet.")
    return steps
