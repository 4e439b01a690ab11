"""Those who follow renders learn when the status of one has changed: on the event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Generic, Protocol, TypeVar


class Followed(Protocol):
    """A render that is followed."""

    @property
    def id(self) -> str: ...
    @property
    def owner(self) -> str: ...
    @property
    def finished(self) -> asyncio.Event: ...


T = TypeVar("T", bound=Followed)


class Follower(Generic[T]):
    """The renders of one owner whose status has changed, each once, in the order of the first change."""

    def __init__(self) -> None:
        self._changed: dict[str, T] = {}
        self._woken = asyncio.Event()
        self.closed = False

    def add(self, render: T) -> None:
        self._changed.setdefault(render.id, render)
        self._woken.set()

    def close(self) -> None:
        self.closed = True
        self._woken.set()

    async def next(self, most: int, seconds: float) -> list[T]:
        """Up to `most` of them, as soon as there is one; none after that many seconds, or when it was closed."""
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await self._woken.wait()
        found = list(self._changed.values())[:most]
        for render in found:
            del self._changed[render.id]
        if not self._changed and not self.closed:
            self._woken.clear()
        return found


class Followers(Generic[T]):
    """The followers of all renders of an owner."""

    def __init__(self) -> None:
        self._by_owner: dict[str, list[Follower[T]]] = {}

    @contextmanager
    def follower(self, owner: str) -> Iterator[Follower[T]]:
        follower = Follower[T]()
        self._by_owner.setdefault(owner, []).append(follower)
        try:
            yield follower
        finally:
            mine = self._by_owner[owner]
            mine.remove(follower)
            if not mine:
                del self._by_owner[owner]

    def tell(self, render: T) -> None:
        for follower in self._by_owner.get(render.owner, ()):
            follower.add(render)

    def close(self) -> None:
        """The server ends."""
        for mine in self._by_owner.values():
            for follower in mine:
                follower.close()


class Changes(Generic[T]):
    """The changes of one render's status. Its followers learn of its end once, and of nothing after that."""

    def __init__(self) -> None:
        self.followers: Followers[T] | None = None
        self._next = asyncio.Event()
        self._ended = False

    def tell(self, render: T) -> None:
        self._next.set()
        self._next = asyncio.Event()
        if self.followers is not None and not self._ended:
            self.followers.tell(render)
        self._ended = render.finished.is_set()

    async def next(self) -> None:
        """Return at the next one."""
        await self._next.wait()
