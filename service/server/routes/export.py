"""A scene as a file for another program, and what calls share that write such a file."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import BinaryIO

from fastapi import APIRouter, Request, Response

from service.document import MeshShape, Scene
from service.exports import FORMATS, Exported, Format, scene_format
from service.exports.formats import Writer
from service.problems import InvalidDocument
from service.server.http.downloads import FileAnswer
from service.server.requests.export_request import ParsedExport
from service.server.routes import answers
from service.server.routes.examples import SCENE
from service.server.state import AppState, app_state, caller_of, owner_of
from service.server.storage.asset_access import references
from service.system.executors import packing

router = APIRouter(prefix="/v1", tags=["export"])

TIMES = 2  # bytes that are held while a file is written, for each byte of the meshes and images in it
ZIP = "application/zip"  # of a file that has others beside it
LOST = {
    "Sunbox-Lost": {
        "description": "What the format has no place for: a JSON array of `{pointer, detail}`, `[]` where nothing is "
        "lost. Where it would be too long for a header, equal details are told once, with their `count`.",
        "schema": {"type": "string"},
    }
}


def file_answers(*formats: Format) -> answers.Responses:
    """The answers of a call that writes one of these formats, for the API's description."""
    described = answers.files(*(each.media_type for each in formats), ZIP)
    return {status: {**each, "headers": LOST} for status, each in described.items()}


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
    responses=file_answers(*SCENES.values()) | answers.problems(400, 413, 415, 422, 429, 501, 503),
)
async def export(request: Request) -> Response:
    state = app_state(request)
    asked: ParsedExport
    async with state.bodies.read(request, "export", caller_of(request)) as asked:
        format = scene_format(asked.format)
        return await written(request, asked.scene, format, format.scene_writer, "/scene")


async def written(
    request: Request, scene: Scene, format: Format, writer: Writer, root: str, within: str = ""
) -> Response:
    """The answer with the file. `root` is a pointer to the scene in the body, and begins those of errors and losses;
    `within` as `Losses.document` has it.

    Raises InvalidDocument, TooLarge, TooManyRequests, Unavailable.
    """
    state, caller = app_state(request), caller_of(request)
    media_type, ending = format.media_type, format.ending
    with state.memory.growing("scenes") as hold:  # until the pieces of the file are on the disk
        exported = await packing(partial(_export, state, scene, writer, owner_of(request), root, hold), caller)
        if exported.beside:
            exported = await packing(partial(exported.zipped, f"scene.{ending}"), caller)
            media_type, ending = ZIP, "zip"

        def fill(file: BinaryIO) -> None:
            for piece in exported.pieces:
                file.write(piece)

        state.downloads.admit(caller, exported.size)
        file = await packing(partial(state.downloads.write, fill, exported.size), caller)
    state.downloads.keep(caller, None, file)
    headers = {
        "content-disposition": f'attachment; filename="scene.{ending}"',
        "sunbox-lost": exported.losses.header(root, within),
        "cache-control": "no-store",
    }
    return FileAnswer(file.file, media_type, headers, file)


def _export(
    state: AppState, scene: Scene, writer: Writer, owner: str, root: str, hold: Callable[[int], None]
) -> Exported:
    files = state.storage.access.files(owner, scene)
    meshes = [shape for shape in scene.shapes if isinstance(shape, MeshShape)]
    size = sum(map(files.size, set(references(scene))))
    size += sum(rows.nbytes for each in meshes for rows in (each.vertices, each.faces) if rows is not None)
    hold(TIMES * size)
    try:
        return writer(scene, files, state.config)
    except InvalidDocument as error:
        raise error.under(root) from None
