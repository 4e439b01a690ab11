"""Requests that may be sent twice: the second one with the same Idempotency-Key gives what the first one made."""

from __future__ import annotations

import asyncio
import weakref
from collections.abc import Awaitable, Callable
from typing import Annotated, TypeVar

from fastapi import Header

from service.problems import Conflict, FieldError, InvalidDocument, Unavailable
from service.server.renders.store.record import IdempotencyKey
from service.server.state import AppState

LONGEST_KEY = 200  # characters
IdempotencyHeader = Annotated[
    str | None, Header(description=f"1 to {LONGEST_KEY} characters, the caller's own name for this.")
]

T = TypeVar("T")
U = TypeVar("U")
Find = Callable[[str, str], Awaitable[tuple[str, U] | None]]  # by owner and key: the digest, and what was made

_turns: weakref.WeakValueDictionary[tuple[int, str, str, str], asyncio.Lock] = weakref.WeakValueDictionary()


def check_key(state: AppState, key: str | None) -> None:
    """Raise InvalidDocument for a key that cannot be one, Unavailable where none can be remembered."""
    if key is None:
        return
    if not 1 <= len(key) <= LONGEST_KEY:
        raise InvalidDocument([FieldError("/idempotency-key", f"must have 1 to {LONGEST_KEY} characters")])
    if state.render_queue.store is None:
        raise Unavailable("Idempotency-Key needs the data folder, which cannot be written to.", 60)


async def is_new(owner: str, key: str | None, find: Find[U]) -> bool:
    """Whether the request needs room: a repetition does not."""
    return key is None or await find(owner, key) is None


async def once(
    state: AppState, kind: str, owner: str, key: str | None, digest: str, find: Find[U],
    make: Callable[[IdempotencyKey | None], Awaitable[T]],
) -> T | U:  # fmt: skip
    """What `make` makes of the first request of this kind, owner and key, and what `find` finds for the others.

    Of several at once the others wait until the first is accepted or refused. Raises Conflict where the key was used
    for a request with another digest."""
    if key is None:
        return await make(None)
    async with _turns.setdefault((id(state), kind, owner, key), asyncio.Lock()):
        found = await find(owner, key)
        if found is None:
            return await make(IdempotencyKey(key, digest))
    known, earlier = found
    if known != digest:
        raise Conflict("This Idempotency-Key was used for another request.")
    return earlier
