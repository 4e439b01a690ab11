"""Callbacks: which are to be sent, were delivered, or failed."""

from __future__ import annotations

from datetime import datetime
from functools import partial
from typing import Annotated, Any
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from service.server.renders.status import iso
from service.server.routes import answers, json_answers
from service.server.state import app_state, owner_of
from service.server.storage.callback_rows import RETAINED, RETAINED_S, Callback, Kind, State
from service.system.executors import recording

router = APIRouter(prefix="/v1", tags=["callbacks"])

MOST_LISTED = 200


class ListQuery(BaseModel):
    """Which of one's callbacks are listed."""

    model_config = ConfigDict(extra="forbid")
    state: State | None = None
    limit: Annotated[int, Field(ge=1, le=MOST_LISTED)] = 100
    after: Annotated[str | None, Field(max_length=100, description="The last id of the page before.")] = None


class CallbackAnswer(BaseModel):
    id: str = Field(description="The header `webhook-id` of every attempt.")
    kind: Kind = Field(description="What ends: a render or a batch.")
    of: str = Field(description="Its id.")
    url: str
    state: State = Field(description="`waiting` for the end, `due` to be sent or sent again, or how it ended.")
    attempts: int
    created: datetime
    next: datetime | None = Field(description="The next attempt, of one that is due.")
    ended: datetime | None
    status: int | None = Field(description="HTTP status of the last attempt's answer; null where there was none.")
    error: str | None = Field(description="Why the last attempt failed.")


@router.get(
    "/callbacks",
    summary="One's own callbacks, the newest first",
    description="A page of them; `Link` with `rel=next` leads to the next page while there is one. "
    f"{RETAINED} delivered and {RETAINED} failed ones are kept, for {RETAINED_S / 86_400:.0f} days.",
    response_class=Response,
    responses=answers.shaped(list[CallbackAnswer]) | answers.problems(422, 503),
)
async def callbacks(request: Request, query: Annotated[ListQuery, Query()]) -> Response:
    listed = app_state(request).callbacks.listed
    find = partial(listed, owner_of(request), query.state, query.limit + 1, query.after)
    found = await recording(find)
    page, headers = found[: query.limit], dict[str, str]()
    if len(found) > query.limit:
        following = query.model_copy(update={"after": page[-1].id})
        headers["link"] = f'<callbacks?{urlencode(following.model_dump(exclude_none=True))}>; rel="next"'
    return await json_answers.made(lambda: [_as_json(each) for each in page], headers=headers)


def _as_json(callback: Callback) -> dict[str, Any]:
    return {
        "id": callback.id,
        "kind": callback.kind,
        "of": callback.subject,
        "url": callback.url,
        "state": callback.state,
        "attempts": callback.attempts,
        "created": iso(callback.created_at),
        "next": iso(callback.next_at),
        "ended": iso(callback.ended_at),
        "status": callback.answer,
        "error": callback.error,
    }
