"""Disk usage of the documents of renders that wait or run: each owner has its share of that."""

from __future__ import annotations

from typing import Protocol, TypeVar

from service.problems import ServiceError
from service.server.storage.quota import reserve_bytes
from service.system.shares import Shares

PART = 2  # of the quota, what these documents take at most: the rest is for assets, pictures and saved documents


class HasClient(Protocol):
    @property
    def client(self) -> str: ...


T = TypeVar("T", bound=HasClient)


class WaitingDocuments:
    """For the event loop. `quota`: bytes, of SUNBOX_DATA_QUOTA; None: no bound."""

    def __init__(self, quota: int | None = None) -> None:
        what = "documents of renders that wait (SUNBOX_DATA_QUOTA)"
        self._shares = None if quota is None else Shares(quota // PART, what)
        self._reserve = None if quota is None else Shares(reserve_bytes(quota), what)
        self._taken: dict[HasClient, list[tuple[Shares, int]]] = {}

    def count(self, render: HasClient, size: int) -> None:
        """Count a render that there is."""
        if self._shares is not None:
            self._shares.count(render.client, size)
            self._taken[render] = [(self._shares, size)]

    def take(self, render: HasClient, size: int) -> None:
        """Count a new one. Raises TooManyRequests, Unavailable and TooLarge, as Shares."""
        if self._shares is not None:
            self._shares.check(render.client, size)
            self.count(render, size)

    def take_reserve(self, render: HasClient, size: int) -> bool:
        """True if a new one may use what is reserved of the quota, since its client takes little of that."""
        if self._reserve is None:
            return False
        try:
            self._reserve.take(render.client, size)
        except ServiceError:
            return False
        self._taken[render].append((self._reserve, size))
        return True

    def release(self, render: HasClient) -> None:
        """It has ended."""
        for shares, size in self._taken.pop(render, ()):
            shares.release(render.client, size)
