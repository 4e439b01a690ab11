"""A request for a render becomes a render in the queue: read, validated, packed and stored."""

from __future__ import annotations

import secrets
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Collection, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, TypeVar

from fastapi import Header
from starlette.requests import Request

from service.document.quality import ResolvedSettings
from service.pack import Packed
from service.problems import Conflict, FieldError, InvalidDocument, ServiceError, Unavailable
from service.server.renders.render import Render
from service.server.renders.status import status
from service.server.renders.store.record import IdempotencyKey, Order, StoredRender
from service.server.requests.parsers import Kind
from service.server.requests.request_parser import ParsedRequest
from service.server.state import STARTING_S, AppState, app_state, caller_of, owner_of
from service.server.storage.asset_access import NO_USES, AllowedUses, Use
from service.server.storage.quota import Quota
from service.system.executors import KeyedLocks, opening, packing

ID_BYTES = 16  # 128 bits cannot be guessed; hex digits never look like an option in a shell


async def one_shot(request: Request) -> Render:
    """A queued render that is not listed."""
    began, state = time.monotonic(), app_state(request)
    async with _parsed(request, "request") as parsed:
        job = await _packed(state, parsed, owner_of(request), began)
        await state.render_queue.submit(job, listed=False)
    return job


async def unlisted(
    state: AppState, owner: str, document: bytes, settings: ResolvedSettings, packed: Packed
) -> Render:
    """A queued render of a packed scene that is not listed; whoever asks cancels and releases it."""
    order = Order(secrets.token_hex(ID_BYTES), owner, settings, None, 0, time.time(), len(document))
    job = state.job(order, document, packed, 0.0)
    await state.render_queue.submit(job, listed=False)
    return job


async def submitted(request: Request, key: str | None) -> Render | dict[str, Any]:
    """A queued render, or the earlier one with this idempotency key: its status where it is gone."""
    began, state, owner = time.monotonic(), app_state(request), owner_of(request)
    check_key(state, key)
    async with _parsed(request, "render" if key is None else "keyed_render", key) as parsed:

        async def make(taken: IdempotencyKey | None) -> Render:
            return await _submitted(state, parsed, owner, began, taken)

        found = await once(state, "render", owner, key, parsed.digest, partial(_keyed, state), make)
        return _known(state, found, parsed) if isinstance(found, StoredRender) else found


async def _keyed(state: AppState, owner: str, key: str) -> tuple[str, StoredRender] | None:
    store = state.render_queue.store
    return None if store is None else await store.keyed(owner, key)


def _parsed(request: Request, kind: Kind, key: str | None = None) -> AbstractAsyncContextManager[ParsedRequest]:
    state, owner = app_state(request), owner_of(request)

    async def ready(body: bytearray) -> None:
        if await is_new(owner, key, partial(_keyed, state)):
            state.render_queue.admit(owner)
        await state.renderers.able(STARTING_S)

    return state.bodies.read(request, kind, caller_of(request), ready)


async def _submitted(
    state: AppState, parsed: ParsedRequest, owner: str, began: float, key: IdempotencyKey | None = None
) -> Render:
    state.render_queue.admit(owner)
    state.callbacks.check(parsed.callback, owner, state.render_queue.store is not None)
    async with allowed(state, owner, parsed.uses) as uses:
        job = await _packed(state, parsed, owner, began)
        await state.render_queue.submit(job, uses, key)
    if parsed.callback is not None:
        state.callbacks.follow(job)
    return job


async def _packed(state: AppState, parsed: ParsedRequest, owner: str, began: float) -> Render:
    """Packing is the last test that a scene has to pass. If it has to wait, what was packed waits with it, or where
    that is too much, it is packed again at its turn."""
    packed = await packing(partial(state.reader.pack, parsed.scene, owner=owner))
    id, document = secrets.token_hex(ID_BYTES), parsed.document
    now, size, callback = time.time(), len(document), parsed.callback
    order = Order(id, owner, parsed.settings, parsed.label, parsed.priority, now, size, callback)
    return state.job(order, document, packed, time.monotonic() - began)


def _known(state: AppState, stored: StoredRender, parsed: ParsedRequest) -> Render | dict[str, Any]:
    """The render that an equal request made earlier. Where it is gone, only its status is stored."""
    try:
        return state.render_queue.get(stored.order.id, stored.order.owner)
    except ServiceError:
        return status(replace(stored.order, settings=parsed.settings), stored.outcome, renderers=0)


@asynccontextmanager
async def allowed(state: AppState, owner: str, uses: Sequence[Use]) -> AsyncIterator[AllowedUses]:
    """A context in which the assets that a document uses are there, until the store says that they are in use.

    Raises InvalidDocument with the pointers of those that its owner may not use."""
    async with _pinned(state.storage.quota, {ref for _, ref in uses}):
        yield await opening(partial(state.storage.access.allowed, owner, uses)) if uses else NO_USES


@asynccontextmanager
async def _pinned(quota: Quota, ids: Collection[str]) -> AsyncIterator[None]:
    """A context in which these assets are not deleted. A thread waits for the quota's lock, as that may take
    seconds."""
    if not ids:
        yield
        return
    pin = quota.pinned(ids)
    await opening(pin.__enter__)
    try:
        yield
    finally:
        await opening(partial(pin.__exit__, None, None, None))


LONGEST_KEY = 200  # characters
IdempotencyHeader = Annotated[
    str | None, Header(description=f"1 to {LONGEST_KEY} characters, the caller's own name for this.")
]

T = TypeVar("T")
U = TypeVar("U")
Find = Callable[[str, str], Awaitable[tuple[str, U] | None]]  # by owner and key: the digest, and what was made

_turns = KeyedLocks[tuple[int, str, str, str]]()


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
    async with _turns.of((id(state), kind, owner, key)):
        found = await find(owner, key)
        if found is None:
            return await make(IdempotencyKey(key, digest))
    known, earlier = found
    if known != digest:
        raise Conflict("This Idempotency-Key was used for another request.")
    return earlier
