"""The service's version and limits, its health, and the schema of its documents."""

from __future__ import annotations

import asyncio
import json
from functools import cache
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse, PlainTextResponse

from service import scene
from service.routes import answers
from service.routes.metrics import MIME, scrape
from service.state import app_state
from service.streams import protocol

router = APIRouter(tags=["service"])


@router.get("/healthz", summary="Alive")
async def healthz() -> dict[str, str]:
    return {"status": "ok"}


@router.get(
    "/readyz",
    summary="Able to render now",
    description="A small picture was rendered, at most five seconds ago.",
    responses=answers.problems(503),
)
async def readyz(request: Request) -> dict[str, str]:
    await app_state(request).readiness.check()
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
async def info(request: Request) -> dict[str, Any]:
    return await app_state(request).info()


@router.get(
    "/v1/schema",
    summary="JSON Schema of Scene, Settings and the stream's View",
    response_class=JSONResponse,
    responses=answers.shaped(answers.Schemas),
)
async def schema() -> Response:
    return Response(await asyncio.to_thread(_schema), media_type="application/json")


@cache
def _schema() -> bytes:
    """The schemas as JSON; they never change, and making them takes 0.2 s."""
    document = scene.schema() | {"view": protocol.View.model_json_schema()}
    return json.dumps(document, ensure_ascii=False, separators=(",", ":")).encode()
