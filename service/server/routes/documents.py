"""Scenes and materials that users save under names of their own."""

from __future__ import annotations

from functools import partial
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Header, Path, Query, Request, Response
from fastapi.responses import JSONResponse

from service.document import Scene, load_json, parse_scene
from service.exports import FORMATS, material_format, material_scene, scene_format
from service.server.routes import answers, export
from service.server.state import app_state, caller_of, owner_of
from service.server.storage.documents import (
    BY_LINK,
    LINK_DAYS,
    LONGEST_NAME,
    MOST_NAMES,
    CheckedDocument,
    Condition,
    check_kind,
    etag,
)
from service.system.executors import packing, saving

router = APIRouter(prefix="/v1/documents", tags=["documents"], responses=answers.problems(503))

JSON = "application/json"
# No slashes, and nothing that moves the text around it in a menu or a log: control characters, direction marks.
NAME = r"^[^\x00-\x1f\x7f-\x9f/\u200e\u200f\u2028-\u202e\u2066-\u2069]+$"

Name = Annotated[
    str,
    Path(
        min_length=1,
        max_length=LONGEST_NAME,
        pattern=NAME,
        description="Of your choice, without slashes.",
        examples=["my-scene"],
    ),
]
Title = Annotated[
    str | None, Query(min_length=1, max_length=200, description="The title in menus; by default the name.")
]


Shared = Annotated[
    bool | None,
    Query(description="Others may read it, but not replace it. Left out: as before, and not shared where it is new."),
]
ByLink = Annotated[
    bool,
    Query(
        description="Whoever knows the name may read it, and it is listed to nobody. It is deleted when nobody has "
        f"read it for {LINK_DAYS} days."
    ),
]
Format = Annotated[
    str | None,
    Query(description="A file instead of the JSON.", json_schema_extra={"enum": list(FORMATS)}),
]
Limit = Annotated[int, Query(ge=1, le=MOST_NAMES)]
After = Annotated[str | None, Query(max_length=LONGEST_NAME, description="Names behind this one only.")]
IfMatch = Annotated[str | None, Header(description="The `ETag` that the document must have, or `*`.")]
IfNoneMatch = Annotated[str | None, Header(description="`*`: there must be no document of this name.")]


@router.get(
    "/{kind}",
    summary="Names and titles",
    response_class=JSONResponse,
    responses=answers.shaped(list[answers.Named]) | answers.problems(404, 422),
)
async def names(
    request: Request, kind: answers.DocumentKind, limit: Limit = MOST_NAMES, after: After = None
) -> Response:
    """Of one's own documents and of those that others share, in the order of the titles; without keys of all. Those
    that were saved `by_link` are left out. `Link` with `rel=next` leads to the next page while there is one."""
    documents, owner = app_state(request).storage.documents, owner_of(request)

    def read() -> Response:
        found, more = documents.names(kind, owner, limit, after)
        headers = {}
        if more:
            following = urlencode({"limit": limit, "after": max(each["name"] for each in found)})
            headers["link"] = f'<{kind}?{following}>; rel="next"'
        return JSONResponse(found, headers=headers)

    return await saving(read)


@router.get(
    "/{kind}/{name}",
    summary="The bare document, or a file for another program",
    responses=answers.DOCUMENT | answers.problems(404, 413, 422, 429, 501),
)
async def document(
    request: Request,
    kind: answers.DocumentKind,
    name: Name,
    format: Format = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """One's own, or else one that another key shares. Its `ETag` serves for a later `If-Match`. With `format`, what
    that has no place for is in the header `Sunbox-Lost`."""
    state = app_state(request)
    if format is not None:
        return await _exported(request, kind, name, format)

    def read() -> tuple[bytes, str]:
        data = state.storage.documents.get(kind, name, owner_of(request))
        return data, etag(data)

    data, tag = await saving(read)
    headers = {"etag": tag, "cache-control": "private, no-cache"}
    if if_none_match is not None and {"*", tag} & set(_tags(if_none_match) or ()):
        return Response(status_code=304, headers=headers)
    return await state.downloads.answer(caller_of(request), data, JSON, headers)


async def _exported(request: Request, kind: str, name: str, format: str) -> Response:
    wanted = (material_format if check_kind(kind) == "materials" else scene_format)(format, "/format")
    data = await saving(partial(app_state(request).storage.documents.get, kind, name, owner_of(request)))
    if kind == "scenes":
        scene = await packing(partial(_scene, data), caller_of(request))
        return await export.written(request, scene, wanted, wanted.scene_writer, "")
    scene, within = await packing(partial(material_scene, data, name), caller_of(request))
    return await export.written(request, scene, wanted, wanted.material_writer, "", within)


def _scene(data: bytes) -> Scene:
    return parse_scene(load_json(data))


@router.put(
    "/{kind}/{name}",
    summary="Save a document",
    description="The body is the bare document, and must be valid; one's own document of the same name is replaced. "
    "With keys a document is its key's, unless it is `shared`. A material is saved bare, or with the textures "
    "that it shows: `{materials: {NAME: ...}, textures: {...}}`.",
    openapi_extra=answers.DOCUMENT_BODY,
    responses=answers.shaped(answers.Named, "It is new.", 201) | answers.problems(400, 412, 413, 415, 422, 429),
)
async def put(
    request: Request,
    response: Response,
    kind: answers.DocumentKind,
    name: Name,
    title: Title = None,
    shared: Shared = None,
    by_link: ByLink = False,
    if_match: IfMatch = None,
    if_none_match: IfNoneMatch = None,
) -> answers.Named:
    state = app_state(request)
    condition = Condition(_tags(if_match), _tags(if_none_match))
    wanted = BY_LINK if by_link else shared

    def save(checked: CheckedDocument) -> tuple[str, bool, str]:
        titled, new = state.storage.documents.put(kind, name, checked, title, owner_of(request), wanted, condition)
        return titled, new, etag(checked.body.encode())

    async with state.bodies.read(request, check_kind(kind), caller_of(request)) as checked:
        titled, new, response.headers["etag"] = await saving(partial(save, checked), caller_of(request))
    if new:
        response.status_code = 201
    return answers.Named(name=name, title=titled)


@router.delete(
    "/{kind}/{name}",
    status_code=204,
    summary="Delete a document",
    responses=answers.problems(403, 404, 412, 422),
)
async def delete(request: Request, kind: answers.DocumentKind, name: Name, if_match: IfMatch = None) -> None:
    condition = Condition(_tags(if_match))
    await saving(partial(app_state(request).storage.documents.delete, kind, name, owner_of(request), condition))


def _tags(header: str | None) -> tuple[str, ...] | None:
    """The entity tags in a header, or `*`; weak ones as if they were strong, since ours never are weak."""
    if header is None:
        return None
    return tuple(tag.strip().removeprefix("W/") for tag in header.split(","))
