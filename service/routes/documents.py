"""Scenes and materials that users save under names of their own."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response

from service.documents import LONGEST_NAME, CheckedDocument, check_kind
from service.downloads import PIECE
from service.rendering.executors import saving
from service.routes import answers
from service.state import app_state, caller

router = APIRouter(prefix="/v1/documents", tags=["documents"], responses=answers.problems(503))

JSON = "application/json"
# Neither slashes nor what moves the text around it, in a menu or a log: control characters, and marks of direction.
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


@router.get("/{kind}", summary="Names and titles", responses=answers.problems(404))
async def names(request: Request, kind: answers.DocumentKind) -> list[answers.Named]:
    return [answers.Named(**entry) for entry in await saving(partial(app_state(request).documents.names, kind))]


@router.get("/{kind}/{name}", summary="The bare document", responses=answers.DOCUMENT | answers.problems(404, 422))
async def document(request: Request, kind: answers.DocumentKind, name: Name) -> Response:
    own = app_state(request)
    data = await saving(partial(own.documents.get, kind, name))
    if len(data) <= PIECE:
        return Response(data, media_type=JSON)
    # From a file, or else it would stay in memory until it has been fetched.
    return await own.downloads.answer(caller(request), data, JSON)


@router.put(
    "/{kind}/{name}",
    summary="Save a document",
    description="The body is the bare document, and must be valid; a document of the same name is replaced.",
    openapi_extra=answers.DOCUMENT_BODY,
    responses=answers.shaped(answers.Named, "It is new.", 201) | answers.problems(400, 413, 415, 422),
)
async def put(
    request: Request, response: Response, kind: answers.DocumentKind, name: Name, title: Title = None
) -> answers.Named:
    own = app_state(request)
    async with own.bodies.taken(request) as body:
        checked: CheckedDocument = await own.bodies.parsed(check_kind(kind), body, caller(request))
    kept, new = await saving(partial(own.documents.put, kind, name, checked, title), caller(request))
    if new:
        response.status_code = 201
    return answers.Named(name=name, title=kept)


@router.delete("/{kind}/{name}", status_code=204, summary="Delete a document", responses=answers.problems(404, 422))
async def delete(request: Request, kind: answers.DocumentKind, name: Name) -> None:
    await saving(partial(app_state(request).documents.delete, kind, name))
