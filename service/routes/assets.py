"""Meshes and images that scenes refer to by the hash of their bytes."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response

from service.rendering.threads import packing
from service.routes.house import house

router = APIRouter(prefix="/v1/assets", tags=["assets"])

FOREVER = "public, max-age=31536000, immutable"  # an id is the hash of what it names
BODY = {"requestBody": {"required": True, "content": {"application/octet-stream": {}}}}


@router.post("", status_code=201, summary="Upload a mesh or an image", openapi_extra=BODY)
async def upload(request: Request, filename: Annotated[str | None, Query(max_length=255)] = None) -> dict[str, Any]:
    data = await request.body()
    kind = request.headers.get("content-type")
    info = await packing(lambda: house(request).assets.add(data, kind, filename))
    return {name: value for name, value in asdict(info).items() if value is not None}


@router.get("/{id}", summary="The bytes", response_class=Response)
async def download(request: Request, id: str) -> Response:
    data = await packing(lambda: house(request).assets.read(id))
    headers = {"content-disposition": "attachment", "cache-control": FOREVER}
    return Response(data, media_type="application/octet-stream", headers=headers)
