"""A material turned into another model."""

from __future__ import annotations

from fastapi import APIRouter, Request

from service.document.material.conversion import Converted
from service.server.routes import answers
from service.server.state import app_state, caller_of

router = APIRouter(prefix="/v1/materials", tags=["materials"])


@router.post(
    "/convert",
    summary="A material as one of another model",
    description="What both models know stays, and so do the colour and the width of the highlight. Textures and "
    "colours stay as they are written; the scene that has the textures is not needed. `lost` names the parameters "
    "that the new model has nothing for.",
    openapi_extra=answers.CONVERSION_BODY,
    responses=answers.problems(400, 413, 415, 422, 429, 503),
)
async def convert(request: Request) -> answers.ConvertedMaterial:
    bodies = app_state(request).bodies
    found: Converted
    async with bodies.read(request, "conversion", caller_of(request)) as found:
        return answers.ConvertedMaterial(material=found.material, lost=found.lost)
