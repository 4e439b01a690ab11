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
from pydantic import BaseModel, ConfigDict, Field

from service.document import presets
from service.document.text import dump_json
from service.formats import AssetInfo
from service.formats.images.metadata import metadata_text
from service.formats.types import Kind, Pose
from service.problems import FieldError, InvalidDocument, NotFound, UnsupportedMedia
from service.server.assets.posing import described, posed_scene
from service.server.http.downloads import FileAnswer
from service.server.requests.bodies import SMALL
from service.server.routes import answers
from service.server.routes.answers import Responses, reference
from service.server.routes.examples import UPLOADED
from service.server.state import app_state, caller_of, owner_of
from service.system.executors import opening, storing, storing_small
from service.system.memory import Reservation

router = APIRouter(prefix="/v1/assets", tags=["assets"])

FOREVER = "{}, max-age=31536000, immutable"  # the bytes of an id never change: it is their hash
BYTES, JSON = "application/octet-stream", "application/json"
SMALL_ASSET = 1 << 20  # bytes of a file that seldom takes longer than its hash and its record
HEADER_BYTES = 4096  # proxies refuse headers that are much longer


class AssetWarning(BaseModel):
    pointer: str = Field(
        description="The first place: RFC 6901 into the file's own JSON, or FILE:LINE of a zipped OBJ; may be empty."
    )
    detail: str
    count: int | None = Field(None, description="How many places; not there where the pointer is the only one.")


class AssetAnimation(BaseModel):
    name: str
    duration: float = Field(description="s; it begins at 0.")


class Asset(BaseModel):
    id: str
    kind: Kind
    format: str
    bytes: int
    width: int | None = Field(None, description="Of an image, texels.")
    height: int | None = Field(None, description="Of an image, texels.")
    channels: int | None = Field(None, description="Of an image.")
    vertices: int | None = Field(None, description="Of a mesh.")
    triangles: int | None = Field(None, description="Of a mesh or a scene.")
    bounds: list[list[float]] | None = Field(None, description="Of a mesh or a scene: least and greatest x, y, z, m.")
    warnings: list[AssetWarning] = Field(
        description="What is odd about the file, and what it asks for and does not get."
    )
    exposure: float | None = Field(
        None,
        description="Of a scene whose own lights expose the picture more than 4 stops from middle grey: the exposure "
        "in stops that suits them, metered from the logarithmic mean of the luminance in the camera's picture. "
        "Photometric lights, such as Blender exports, need about -10.",
    )
    aspect_ratio: float | None = Field(
        None, description="Of a scene whose camera says it: the width of its picture over the height."
    )
    variants: list[str] | None = Field(None, description="Of a scene: the variants of its materials, by name.")
    animations: list[AssetAnimation] | None = Field(None, description="Of a scene.")
    layers: list[str] | None = Field(
        None, description="Of an EXR with several: their names, which `layer` takes; an empty one is its R, G and B."
    )


class MaterialSet(BaseModel):
    materials: dict[str, Any]
    textures: dict[str, Any] = Field(description="All that the materials show, by name.")
    warnings: list[AssetWarning] = Field(description="Which of its images are not used, and why.")


ASSET_FILE: Responses = {
    200: {
        "description": "The file, or what it is.",
        "content": {
            "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
            "application/json": {"schema": reference("Asset"), "example": UPLOADED},
        },
    }
}


@router.post(
    "",
    status_code=201,
    summary="Upload a mesh, an image, a scene (glTF, USD, or a zip of a model with its parts), or a zip of textures",
    openapi_extra=answers.ASSET_BODY,
    response_model=None,
    responses=answers.shaped(Asset, "It is here.", 201) | answers.problems(413, 415, 422, 429, 503),
)
async def upload(
    request: Request,
    filename: Annotated[str | None, Query(max_length=255)] = None,
    entry: Annotated[
        str | None, Query(max_length=1024, description="Of a zip that holds several models: the one to take.")
    ] = None,
) -> dict[str, Any]:
    """A zip is what is in it: a model with its parts, MaterialX with its images, or images whose names say what they
    are. With `entry` the asset is that model without all that is no part of it, and so is its id."""
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
            info = storage.assets.add(file, kind, filename, partial(storage.shares.room, owner), entry=entry)
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
    return _described(info)


def _described(info: AssetInfo) -> dict[str, Any]:
    return {"warnings": []} | {name: value for name, value in asdict(info).items() if value is not None}


class PoseQuery(BaseModel):
    """How a glTF file is shown, where that is not as it was saved."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)
    variant: Annotated[str | None, Field(description="Of its materials, by name.")] = None
    animation: Annotated[str | None, Field(description="By name.")] = None
    time: Annotated[
        float | None,
        Field(ge=-1e9, le=1e9, description="In the animation, s: before its start and after its end as there."),
    ] = None

    def pose(self) -> Pose:
        if self.time is not None and self.animation is None:
            raise InvalidDocument([FieldError("/time", "needs `animation` beside it")])
        return Pose(self.variant, self.animation, self.time or 0.0)


@router.get(
    "/{id}/scene",
    summary="A glTF file, a zipped model or a mesh as a scene document with a camera that shows it; of a picture "
    "that Sunbox made the scene in its metadata",
    response_class=JSONResponse,
    responses=answers.SCENE_DOCUMENT | answers.problems(404, 422),
)
async def scene(request: Request, id: answers.AssetId, query: Annotated[PoseQuery, Query()]) -> Response:
    """Its references are assets here. A glTF file's skins, morph targets and nodes are posed as an animation has them
    at a time; the answer to the file's upload lists its `variants` and `animations`. That answer has `warnings`,
    `exposure`, `aspect_ratio` and `bounds`, too; here they are in headers, as JSON: `Sunbox-Warnings` (as much of the
    list as has room), `Sunbox-Exposure`, `Sunbox-Aspect-Ratio` and `Sunbox-Bounds`, each only where there is
    something to say."""

    storage, owner, pose = app_state(request).storage, owner_of(request), query.pose()

    def made_from() -> bytes | None:
        storage.access.check(owner, id)
        if storage.assets.info(id).kind != "image":
            return None
        if (text := metadata_text(storage.assets.read(id))) is None:
            raise NotFound(f"{id[:100]} is an image that Sunbox did not make: it has no scene in its metadata")
        return text

    if (text := await opening(made_from, caller_of(request))) is not None:
        state, values = app_state(request), Reservation()
        try:
            hold = partial(state.memory.hold, "bodies", values)
            found = await state.bodies.parsed("recipe", bytearray(text), caller_of(request), hold)
            return Response(found.body, media_type=JSON)
        finally:
            state.memory.release(values)

    def read() -> Response:
        imported = posed_scene(storage.assets, id, pose, partial(storage.shares.room, owner))
        storage.shares.imported(owner, id, imported.references())
        headers = {"sunbox-warnings": _fitting(imported.warnings)} if imported.warnings else {}
        for name in ("exposure", "aspect_ratio", "bounds"):
            if (value := getattr(imported, name)) is not None:
                headers[f"sunbox-{name.replace('_', '-')}"] = json.dumps(value)
        return Response(dump_json(imported.scene(presets.default_environment())), 200, headers, JSON)

    return await storing(read, caller_of(request))


def _fitting(warnings: list[dict[str, Any]]) -> str:
    while len(text := json.dumps(warnings)) > HEADER_BYTES:
        warnings = warnings[: len(warnings) * 2 // 3]
    return text


@router.get(
    "/{id}/materials",
    summary="The materials of a zip of textures, or of a scene's file, with the textures that they show",
    response_class=JSONResponse,
    responses=answers.shaped(MaterialSet, "The materials, by name.") | answers.problems(404, 422),
)
async def materials(request: Request, id: answers.AssetId) -> Response:
    """The images are assets here. What each image of a zip is of is said by the words of its file name."""

    storage, owner = app_state(request).storage, owner_of(request)

    def read() -> Response:
        storage.access.check(owner, id)
        imported = storage.assets.materials(id)
        storage.shares.imported(owner, id, imported.references())
        document = imported.document
        body = {"materials": document["materials"], "textures": document["textures"], "warnings": imported.warnings}
        return Response(dump_json(body), media_type=JSON)

    return await storing(read, caller_of(request))


@router.get(
    "/{id}",
    summary="The bytes; or what they are, where `Accept` asks for JSON",
    response_class=Response,
    responses=ASSET_FILE | answers.problems(404),
)
async def download(request: Request, id: answers.AssetId) -> Response:
    """With `Accept: application/json` the answer to the upload again: kind, size, warnings, and the variants and
    animations of a scene."""

    storage, owner = app_state(request).storage, owner_of(request)
    accepted = request.headers.get("accept", "*/*").lower()
    if "application/json" in accepted and "*/*" not in accepted and "octet-stream" not in accepted:

        def describe() -> Response:
            storage.access.check(owner, id)
            return JSONResponse(_described(described(storage.assets, id)), headers={"vary": "Accept"})

        return await storing(describe, caller_of(request))

    def find(stack: ExitStack) -> bytes | BinaryIO:
        storage.access.check(owner, id)
        return stack.enter_context(storage.assets.opened(id))

    with ExitStack() as stack:
        source = await opening(partial(find, stack), caller_of(request))
        # A shared cache would answer other keys, too.
        cached = FOREVER.format("private" if owner else "public")
        headers = {"content-disposition": "attachment", "cache-control": cached, "vary": "Accept"}
        if isinstance(source, bytes):
            return Response(source, media_type=BYTES, headers=headers)
        # A descriptor of its own: the file stays readable even if the asset is deleted meanwhile.
        return FileAnswer(os.fdopen(os.dup(source.fileno()), "rb"), BYTES, headers)
