"""Meshes and images that scenes refer to by the hash of their bytes."""

from __future__ import annotations

import asyncio
import json
import os
from contextlib import ExitStack
from dataclasses import asdict
from functools import partial
from typing import Annotated, Any, BinaryIO

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import JSONResponse

from service import presets
from service.assets import AssetInfo
from service.assets.scene_import import Imported
from service.http.downloads import FileAnswer
from service.problems import UnsupportedMedia
from service.requests.bodies import SMALL
from service.routes import answers
from service.scene.text import dump_json
from service.state import app_state, caller_of, owner_of
from service.system.executors import opening, storing, storing_small

router = APIRouter(prefix="/v1/assets", tags=["assets"])

FOREVER = "{}, max-age=31536000, immutable"  # the bytes of an id never change: it is their hash
BYTES = "application/octet-stream"
SMALL_ASSET = 1 << 20  # bytes of a file that seldom takes longer than its hash and its record
HEADER_BYTES = 4096  # proxies refuse headers that are much longer


@router.post(
    "",
    status_code=201,
    summary="Upload a mesh, an image, a scene (glTF, or a zip of an OBJ with its materials), or a zip of textures",
    openapi_extra=answers.ASSET_BODY,
    response_model=None,
    responses=answers.shaped(answers.Asset, "It is here.", 201) | answers.problems(413, 415, 422, 429, 503),
)
async def upload(request: Request, filename: Annotated[str | None, Query(max_length=255)] = None) -> dict[str, Any]:
    kind = request.headers.get("content-type", "")
    if kind.lower().startswith("multipart/"):
        async for _ in request.stream():  # to its end, so that its sender reads the answer
            pass
        raise UnsupportedMedia("Send the file's bytes as the body, not as a form: curl --data-binary @FILE, not -F")
    state, owner, caller = app_state(request), owner_of(request), caller_of(request)
    storage = state.storage
    file = await asyncio.to_thread(storage.assets.incoming)

    def add() -> AssetInfo:
        with file:  # closed in this thread: a cancelled request does not wait for it
            info = storage.assets.add(file, kind, filename, partial(storage.shares.room, owner))
        storage.shares.uploaded(owner, storage.assets.parts(info))
        return info

    received = 0
    with state.uploads.growing(caller) as have:
        async for chunk in request.stream():
            received += len(chunk)
            if received > SMALL:
                have(received)
            await asyncio.to_thread(storage.assets.receive, file, chunk)
        info = await (storing_small if received <= SMALL_ASSET else storing)(add, caller)
    return {"warnings": []} | {name: value for name, value in asdict(info).items() if value is not None}


@router.get(
    "/{id}/scene",
    summary="A glTF file, a zipped OBJ or a mesh as a scene document with a camera that shows it",
    response_class=JSONResponse,
    responses=answers.SCENE_DOCUMENT | answers.problems(404, 422),
)
async def scene(request: Request, id: answers.AssetId) -> Response:
    """Its references are assets here. The answer to the file's upload has `warnings`, `exposure` and `aspect_ratio`;
    here they are in headers: `Sunbox-Warnings` (as much of the list as has room, as JSON), `Sunbox-Exposure` and
    `Sunbox-Aspect-Ratio`, each only where there is something to say."""

    storage, owner = app_state(request).storage, owner_of(request)

    def read() -> tuple[Imported, str]:
        storage.access.check(owner, id)
        imported = storage.assets.scene(id)
        storage.shares.imported(owner, id, imported.references())
        return imported, dump_json(imported.scene(presets.default_environment()))

    imported, text = await storing(read, caller_of(request))
    headers = {"sunbox-warnings": _fitting(imported.warnings)} if imported.warnings else {}
    for name in ("exposure", "aspect_ratio"):
        if (value := getattr(imported, name)) is not None:
            headers[f"sunbox-{name.replace('_', '-')}"] = repr(value)
    return Response(text, media_type="application/json", headers=headers)


def _fitting(warnings: list[dict[str, Any]]) -> str:
    while len(text := json.dumps(warnings)) > HEADER_BYTES:
        warnings = warnings[: len(warnings) * 2 // 3]
    return text


@router.get(
    "/{id}/materials",
    summary="The materials of a zip of textures, or of a scene's file, with the textures that they show",
    response_class=JSONResponse,
    responses=answers.shaped(answers.MaterialSet, "The materials, by name.") | answers.problems(404, 422),
)
async def materials(request: Request, id: answers.AssetId) -> Response:
    """The images are assets here. What each image of a zip is of is said by the words of its file name."""

    storage, owner = app_state(request).storage, owner_of(request)

    def read() -> str:
        storage.access.check(owner, id)
        imported = storage.assets.materials(id)
        storage.shares.imported(owner, id, imported.references())
        document = imported.document
        return dump_json(
            {"materials": document["materials"], "textures": document["textures"], "warnings": imported.warnings}
        )

    return Response(await storing(read, caller_of(request)), media_type="application/json")


@router.get(
    "/{id}",
    summary="The bytes",
    response_class=Response,
    responses=answers.files("application/octet-stream") | answers.problems(404),
)
async def download(request: Request, id: answers.AssetId) -> Response:
    storage, owner = app_state(request).storage, owner_of(request)

    def find(stack: ExitStack) -> bytes | BinaryIO:
        storage.access.check(owner, id)
        return stack.enter_context(storage.assets.opened(id))

    with ExitStack() as stack:
        source = await opening(partial(find, stack), caller_of(request))
        # A shared cache would answer other keys, too.
        cached = FOREVER.format("private" if owner else "public")
        headers = {"content-disposition": "attachment", "cache-control": cached}
        if isinstance(source, bytes):
            return Response(source, media_type=BYTES, headers=headers)
        # A descriptor of its own: the file stays readable even if the asset is deleted meanwhile.
        return FileAnswer(os.fdopen(os.dup(source.fileno()), "rb"), BYTES, headers)
