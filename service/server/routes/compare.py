"""A verdict on two documents or pictures: whether they differ beyond noise, where, and with which certainty."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, Field

from service.document.quality import ResolvedSettings
from service.formats import images
from service.formats.cache import refused
from service.formats.errors import ParseError
from service.formats.source import for_sandbox
from service.formats.types import RenderedPicture
from service.ipc.messages import ESTIMATE
from service.pack import Packed
from service.problems import AssetError, FieldError, InvalidDocument, NotFound, Unavailable
from service.server.assets.store import AssetStore
from service.server.renders.render import Render
from service.server.requests import compare_request
from service.server.requests.compare_request import ParsedComparison, check_pixels, check_sizes
from service.server.requests.request_parser import ParsedRequest
from service.server.routes import answers, compare_answers, submission, waiting
from service.server.routes.errors import GONE
from service.server.state import STARTING_S, AppState, app_state, caller_of, owner_of
from service.server.verdict import comparison
from service.server.verdict.comparison import SampleSource, Side, Still, Taken, UnderWay, Verdict, ways_of
from service.server.verdict.evidence import PIXEL_BYTES, Estimate
from service.system.executors import comparing, opening, packing, storing
from service.views import MapKind

router = APIRouter(prefix="/v1", tags=["compare"])

VERDICT: answers.Responses = {
    200: {
        "model": compare_answers.Verdict,
        "description": "The verdict, or a map.",
        "content": {"image/png": {"schema": {"type": "string", "format": "binary"}}},
    }
}

ASSET = "sha256:"
under_way = UnderWay()  # of this process, which is the only one that answers
HEADER_REGIONS = 16  # in the header beside a map, which proxies bound to 8 KiB


Name = Annotated[str, Field(pattern=r"^[\w-]{1,64}$", examples=["before-and-after"])]


class CompareQuery(BaseModel):
    """What is answered: the verdict, or a map, with the verdict in the header `Sunbox-Verdict`."""

    model_config = ConfigDict(extra="forbid")
    format: Literal["json", "png"] = "json"
    map: MapKind = "p"
    name: Name | None = None  # by which its client asks how far it is


@router.get(
    "/compare/{name}",
    summary="Say how far a comparison is",
    description="Of one that was given that `name` by whoever asked for it; 204 while none of it is under way.",
    response_model=compare_answers.UnderWay,
    responses={204: {"description": "It has not begun, or has ended."}},
)
async def comparison_under_way(request: Request, name: Name) -> Response:
    found = under_way.samples(owner_of(request), name)
    if found is None:
        return Response(status_code=204)
    return JSONResponse({"samples": found[0], "max_samples": found[1]})


@router.post(
    "/compare",
    summary="Say whether two documents or pictures differ beyond noise",
    description="Documents are rendered with the same seeds, `a`'s, in groups of samples, until they are known to "
    "differ or have the samples, the time or the noise that their settings allow; renders and EXR files stay as they "
    "are. With `format=png` the answer is a map, and the verdict is in the header `Sunbox-Verdict` as JSON, with its "
    "first 16 regions. Closing the connection ends the work.",
    openapi_extra=compare_answers.BODY,
    response_class=Response,
    responses=VERDICT | answers.problems(400, 404, 409, 410, 413, 415, 422, 429, 503),
)
async def compare(request: Request, query: Annotated[CompareQuery, Query()]) -> Response:
    state, caller, owner = app_state(request), caller_of(request), owner_of(request)

    async def ready(body: bytearray) -> None:
        state.render_queue.admit(owner)
        await state.renderers.able(STARTING_S)

    async with state.bodies.read(request, "comparison", caller, ready) as asked:
        answered = asyncio.ensure_future(_answered(state, asked, caller, owner, query))
        if not await waiting.until(request, answered):
            return Response(status_code=GONE)
        return answered.result()


async def _answered(
    state: AppState, asked: ParsedComparison, caller: str, owner: str, query: CompareQuery
) -> Response:
    """Encoded where cancelling it ends the work as well."""
    with (
        state.memory.growing("scenes") as hold_scenes,
        state.memory.growing("pictures") as hold_pictures,
        under_way.following(owner, query.name) as on_progress,
    ):
        sides = _Sides(state, caller, owner, hold_scenes)
        a, b = await sides.found(asked.a, "/a"), await sides.found(asked.b, "/b")
        check_sizes(a.size, b.size)
        hold_pictures(a.size[0] * a.size[1] * PIXEL_BYTES)
        if asked.same and isinstance(a, SampleSource):
            verdict = comparison.same(a, asked.confidence)
        else:
            verdict = await comparison.compare(a, b, asked.confidence, on_progress)
        return await comparing(partial(_response, verdict, query))


def _response(verdict: Verdict, query: CompareQuery) -> Response:
    document = verdict.document()
    if query.format == "json":
        return JSONResponse(document)
    short = document | {"regions": document["regions"][:HEADER_REGIONS]}
    headers = {"sunbox-verdict": json.dumps(short), "cache-control": "no-store"}
    return Response(images.encode(verdict.picture(query.map), "png"), media_type="image/png", headers=headers)


@dataclass
class _Sides:
    """What a request names becomes what is compared."""

    state: AppState
    caller: str
    owner: str
    hold_scenes: Callable[[int], None]
    scene_bytes: int = 0

    async def found(self, side: compare_request.Side, pointer: str) -> Side:
        if isinstance(side, ParsedRequest):
            return await self._document(side, pointer)
        try:
            still = await (self._asset(side) if side.startswith(ASSET) else self._render(side))
        except NotFound as error:
            raise NotFound(error.detail, pointer) from None
        except InvalidDocument as error:
            raise error.under(pointer) from None
        except AssetError as error:
            raise InvalidDocument([FieldError(pointer, error.detail)]) from None
        return still

    async def _document(self, parsed: ParsedRequest, pointer: str) -> SampleSource:
        try:
            check_pixels(parsed.settings.render_width, parsed.settings.render_height)
            packed = await packing(partial(self.state.reader.pack, parsed.scene, owner=self.owner))
        except InvalidDocument as error:
            raise error.under(pointer) from None
        self.state.memory.release(packed)
        self.scene_bytes += packed.bytes
        self.hold_scenes(self.scene_bytes)
        return SampleSource(parsed.settings, partial(self._rendered, parsed.document, packed, pointer))

    async def _rendered(self, document: bytes, packed: Packed, pointer: str, settings: ResolvedSettings) -> Taken:
        """One group of samples: a render as `POST /v1/render` has it, with the same limits and turns."""
        job = await submission.unlisted(self.state, self.owner, document, settings, packed)
        try:
            await job.finished.wait()
            if job.state == "cancelled":
                raise Unavailable("The server is shutting down.")
            return Taken(await _estimate(job), job.elapsed_s)
        except InvalidDocument as error:
            raise error.under(pointer) from None
        finally:
            self.state.render_queue.cancel(job)
            job.release()

    async def _render(self, id: str) -> Still:
        """A render's picture so far. Raises NotFound, Gone, Conflict, InvalidDocument."""
        job = await self.state.batches.render(id, self.owner)
        settings = job.order.settings
        check_pixels(settings.render_width, settings.render_height)
        if settings.denoise:
            raise _denoised()
        return Still(await _estimate(job), settings.seed, ways_of(settings))

    async def _asset(self, id: str) -> Still:
        """An EXR file of ours. Raises NotFound, AssetError, InvalidDocument."""
        storage = self.state.storage

        def info() -> tuple[int, int]:
            storage.access.check(self.owner, id)
            found = storage.assets.info(id)
            return found.width or 0, found.height or 0

        check_pixels(*await opening(info, self.caller))
        picture = await storing(partial(rendered, storage.assets, id), self.caller)
        if picture.denoised:
            raise _denoised()
        color, variance = picture.layers[..., :3], picture.layers[..., 3:]
        estimate = await comparing(partial(Estimate.of, color, variance, picture.samples))
        return Still(estimate, picture.seed, picture.ways)


async def _estimate(job: Render) -> Estimate:
    """Raises Conflict before the first sample, and the render's own error where it failed."""
    pixels, progress = await job.image(ESTIMATE)  # both at once: the render may go on
    return await comparing(partial(Estimate.of, pixels[..., :4], pixels[..., 4:], progress.samples))


def _denoised() -> InvalidDocument:
    detail = "was denoised, so that its noise is not known: render it without `denoise`"
    return InvalidDocument([FieldError("", detail)])


def rendered(assets: AssetStore, id: str) -> RenderedPicture:
    """Colour, variance and samples of an EXR file. Raises NotFound, AssetError."""
    if assets.info(id).format != "exr":
        raise AssetError("is no EXR file")
    try:
        with assets.opened(id) as source:
            return assets.loader.sandbox.parse_rendered(for_sandbox(source))
    except ParseError as error:
        raise refused("the EXR file", error) from None
