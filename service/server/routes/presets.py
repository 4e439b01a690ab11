"""Built-in scenes, materials and environments."""

from __future__ import annotations

from functools import cache, partial
from typing import Annotated

from fastapi import APIRouter, Path, Request, Response
from fastapi.responses import JSONResponse

from service.document import presets
from service.server.http.compression import Constant
from service.server.routes import answers
from service.system.executors import answering

router = APIRouter(prefix="/v1/presets", tags=["presets"])


@router.get(
    "/{kind}",
    summary="Names and titles",
    response_class=JSONResponse,
    responses=answers.shaped(list[answers.NamedPreset]) | answers.problems(404),
)
async def names(request: Request, kind: answers.PresetKind) -> Response:
    return (await answering(partial(_names, kind))).answer(request)


@router.get(
    "/{kind}/{name}",
    summary="The bare document",
    response_class=JSONResponse,
    responses=answers.DOCUMENT | answers.problems(404),
)
async def preset(
    request: Request, kind: answers.PresetKind, name: Annotated[str, Path(examples=[presets.DEFAULT_SCENE])]
) -> Response:
    return (await answering(partial(_preset, kind, name))).answer(request)


@cache
def _names(kind: str) -> Constant:
    """Raises NotFound."""
    return Constant(presets.names(kind))


@cache
def _preset(kind: str, name: str) -> Constant:
    """Raises NotFound."""
    return Constant(presets.get(kind, name))
