"""The service's version and limits, its health, and the schema of its documents."""

from __future__ import annotations

import json
from functools import cache, lru_cache, partial
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse, PlainTextResponse
from pydantic import BaseModel, ConfigDict, Field

from service import document
from service.document.material import MODELS
from service.document.schema import brief, model_schema
from service.problems import FieldError, InvalidDocument
from service.server.http.compression import Constant
from service.server.routes import answers, json_answers
from service.server.routes.metrics import MIME, scrape
from service.server.state import app_state
from service.server.streams import protocol
from service.system.executors import answering

router = APIRouter(tags=["service"])


@router.get("/healthz", summary="Alive")
async def healthz() -> dict[str, str]:
    return {"status": "ok"}


@router.get(
    "/readyz",
    summary="Able to render now",
    description="What is stored was loaded, and a small picture was rendered, at most five seconds ago.",
    responses=answers.problems(503),
)
async def readyz(request: Request) -> dict[str, str]:
    state = app_state(request)
    state.loading.check()
    await state.readiness.check()
    return {"status": "ok"}


@router.get(
    "/metrics",
    summary="Prometheus' text",
    response_class=PlainTextResponse,
    responses={200: {"content": {"text/plain": {"schema": {"type": "string"}}}}},
)
async def metrics(request: Request) -> Response:
    state = app_state(request)
    return Response(await scrape(state, state.traffic), media_type=MIME)


@router.get(
    "/v1/info",
    summary="Version, renderer, limits, quality presets",
    response_model=None,
    responses=answers.shaped(answers.Info),
)
async def info(request: Request) -> Response:
    found = await app_state(request).info()
    return await json_answers.made(lambda: found)


class SchemaQuery(BaseModel):
    model_config = ConfigDict(extra="forbid")
    model: Annotated[str | None, Field(description="Of the material of this `type` alone.")] = None
    brief: Annotated[bool, Field(description="With `model`: a line for each field, for who writes one.")] = False


@router.get(
    "/v1/schema",
    summary="JSON Schema of Scene, Settings and the stream's View",
    description="With `model`, the schema of one material's model; with `brief` too, in few words: range, unit, "
    "default and a line of each field.",
    response_class=JSONResponse,
    responses=answers.shaped(answers.Schemas) | answers.problems(422),
)
async def schema(request: Request, query: Annotated[SchemaQuery, Query()]) -> Response:
    if query.model is None:
        if query.brief:
            raise InvalidDocument([FieldError("/brief", "needs `model` beside it")])
        return (await answering(_schema)).answer(request)
    return (await answering(partial(_model, query.model, query.brief))).answer(request)


@cache
def _schema() -> Constant:
    """The schemas; making them takes 0.2 s."""
    return Constant(document.schema() | {"view": protocol.View.model_json_schema()})


@lru_cache(2 * len(MODELS))
def _model(model: str, is_brief: bool) -> Constant:
    """The schema of one material's model. Raises InvalidDocument."""
    found = model_schema(json.loads(_schema().plain)["scene"], model)
    if found is None:
        raise InvalidDocument([FieldError("/model", f"is not one of {', '.join(sorted(MODELS))}")])
    return Constant(brief(found) if is_brief else found)
