"""Built-in scenes, materials and environments."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from service import presets

router = APIRouter(prefix="/v1/presets", tags=["presets"])


@router.get("/{kind}", summary="Names and titles of scenes, materials or environments")
def names(kind: str) -> list[dict[str, str]]:
    return presets.names(kind)


@router.get("/{kind}/{name}", summary="The bare document")
def preset(kind: str, name: str) -> dict[str, Any]:
    return presets.get(kind, name)
