"""Built-in scenes, materials and environments."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path

from service import presets
from service.routes import answers

router = APIRouter(prefix="/v1/presets", tags=["presets"])


@router.get("/{kind}", summary="Names and titles", response_model_exclude_none=True, responses=answers.problems(404))
def names(kind: answers.PresetKind) -> list[answers.NamedPreset]:
    return [answers.NamedPreset(**entry) for entry in presets.names(kind)]


@router.get(
    "/{kind}/{name}",
    summary="The bare document",
    response_model=None,
    responses=answers.DOCUMENT | answers.problems(404),
)
def preset(kind: answers.PresetKind, name: Annotated[str, Path(examples=[presets.DEFAULT_SCENE])]) -> dict[str, Any]:
    return presets.get(kind, name)
