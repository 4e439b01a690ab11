"""What the service is, whether it lives, and what its documents look like."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request

from service import scene
from service.rendering import protocol
from service.routes.house import house

router = APIRouter(tags=["service"])


@router.get("/healthz", summary="Alive")
async def healthz() -> dict[str, str]:
    return {"status": "ok"}


@router.get("/readyz", summary="Able to render now")
async def readyz(request: Request) -> dict[str, str]:
    await house(request).engine.ready(0)
    return {"status": "ok"}


@router.get("/v1/info", summary="Version, renderer, limits, quality presets")
async def info(request: Request) -> dict[str, Any]:
    return await house(request).info()


@router.get("/v1/schema", summary="JSON Schema of Scene, Settings and the stream's View")
def schema() -> dict[str, Any]:
    return scene.schema() | {"view": protocol.View.model_json_schema()}
