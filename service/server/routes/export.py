"""A scene as a file for another program."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.exports import FORMATS, scene_format
from service.server.requests.export_request import ParsedExport
from service.server.routes import answers, exporting
from service.server.routes.examples import SCENE
from service.server.state import app_state, caller_of

router = APIRouter(prefix="/v1", tags=["export"])

SCENES = {name: each for name, each in FORMATS.items() if each.has_scenes}
BODY = answers.body(
    {
        "type": "object",
        "required": ["scene", "format"],
        "additionalProperties": False,
        "properties": {"scene": answers.reference("Scene"), "format": {"type": "string", "enum": list(SCENES)}},
    },
    sphere={"scene": SCENE, "format": "glb"},
)


@router.post(
    "/export",
    summary="A scene as a file for another program",
    description="Meshes, materials with their textures, lights and the camera; shapes that are no meshes become "
    "triangles. What the format has no place for is in the header `Sunbox-Lost`. A file from which nothing was lost, "
    "uploaded again, renders the same picture to the bit.",
    openapi_extra=BODY,
    response_class=Response,
    responses=exporting.file_answers(*SCENES.values()) | answers.problems(400, 413, 415, 422, 429, 501, 503),
)
async def export(request: Request) -> Response:
    state = app_state(request)
    asked: ParsedExport
    async with state.bodies.read(request, "export", caller_of(request)) as asked:
        format = scene_format(asked.format)
        return await exporting.written(request, asked.scene, format, format.scene_writer, "/scene")
