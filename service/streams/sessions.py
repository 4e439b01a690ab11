"""Streams by session: a client whose connection dropped takes its own stream up again, and no other client's."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections import Counter

from service.problems import NotFound, TooManyRequests
from service.renderers.protocol import Renderers
from service.requests.request_reader import RequestReader
from service.streams.stream import Stream
from service.system.background import Background

ID_BYTES = 32  # 256 bits: an id cannot be guessed
KEPT_S = 60.0  # of the contract: how long a session waits for its client to come back
GOING_AWAY = 1001  # close code

log = logging.getLogger(__name__)


class Session:
    def __init__(self, stream: Stream, owner: str, running: asyncio.Task[None]) -> None:
        self.id = secrets.token_hex(ID_BYTES)
        self.owner = owner  # the owner of the key that opened it
        self.stream = stream
        self.connections = 0  # at present; two while one replaces the other
        self.beside: Session | None = None  # whose second variant this is: a client's two count as one
        self.running = running
        self.timer: asyncio.TimerHandle | None = None


class Sessions:
    def __init__(self, renderers: Renderers, reader: RequestReader, most: int, each: int | None = None) -> None:
        """`most` clients at a time, and `each` of one key; None: no such limit."""
        self._each = each
        self._renderers = renderers
        self._reader = reader
        self._most = most
        self._running = Background()
        self._kept: dict[str, Session] = {}  # the longest left first, among those that are left

    @property
    def attended(self) -> int:
        return sum(session.connections > 0 and not _is_second(session) for session in self._kept.values())

    def _attended_by(self, owner: str) -> int:
        return sum(
            each.owner == owner and each.connections > 0 and not _is_second(each) for each in self._kept.values()
        )

    @property
    def waiting(self) -> int:
        """How many sessions wait for their clients to come back."""
        return len(self._kept) - self.attended

    def enter(self, id: str | None, beside: str | None = None, owner: str = "") -> Session:
        """A new session, or the one of that id; `leave` ends what this begins.

        `owner`: whose key it is. One that another key opened is as gone as one that never was.
        `beside`: the session of the same client whose picture this one is compared with. Each has its turn, and the
        two count as one client.

        Raises NotFound when it is gone, TooManyRequests when there is no room, Unavailable without a renderer.
        """
        session = self._of(id, owner)
        if id is not None and session is None:
            raise NotFound("This session is gone: start anew.")
        first = self._first(beside, owner) if session is None else session.beside
        is_second = first is not None and first.connections > 0
        if (session is None or not session.connections) and not is_second:
            self._admit(owner)
        if session is None:
            stream = Stream(self._renderers, self._reader, owner)
            session = Session(stream, owner, self._running.start("stream", stream.run(), stream.died))
            session.beside = first
            self._kept[session.id] = session
        if session.timer is not None:
            session.timer.cancel()
            session.timer = None
        session.connections += 1
        return session

    def _admit(self, owner: str) -> None:
        if self.attended >= self._most:
            raise TooManyRequests(f"{self._most} clients are connected, and no more are taken (SUNBOX_MAX_CLIENTS).")
        if owner and self._each is not None and self._attended_by(owner) >= self._each:
            detail = (
                f"{self._each} clients with your key are connected, and no more are taken (SUNBOX_MAX_KEY_CLIENTS)."
            )
            raise TooManyRequests(detail)

    def _of(self, id: str | None, owner: str) -> Session | None:
        """The session of that id, if that key opened it."""
        session = self._kept.get(id) if id is not None else None
        return session if session is not None and session.owner == owner else None

    def _first(self, id: str | None, owner: str) -> Session | None:
        """The session of that id, if it may have another one beside it: not a second one, and one at a time."""
        first = self._of(id, owner)
        taken = any(each.beside is first and each.connections for each in self._kept.values())
        return None if first is None or first.beside is not None or taken else first

    def leave(self, session: Session) -> None:
        """The connection is over; the session waits for another, unless the stream has ended."""
        session.connections -= 1
        if session.connections or session.id not in self._kept:
            return
        if session.stream.ended is not None:
            self._end(session)
            return
        session.timer = asyncio.get_running_loop().call_later(KEPT_S, self._end, session)
        self._kept[session.id] = self._kept.pop(session.id)
        if self.waiting > self._most:  # clients that come and go all the time must not fill the renderer's memory
            waiting = [kept for kept in self._kept.values() if not kept.connections]
            owner = Counter(kept.owner for kept in waiting).most_common(1)[0][
                0
            ]  # and they cost their own key a session
            self._end(next(kept for kept in waiting if kept.owner == owner))

    def close(self, reason: str) -> None:
        """End all streams; their clients are told that the server goes away."""
        for session in list(self._kept.values()):
            session.stream.end(GOING_AWAY, reason)
            if not session.connections:
                self._end(session)

    def _end(self, session: Session) -> None:
        if self._kept.pop(session.id, None) is None:
            return
        if session.timer is not None:
            session.timer.cancel()
        session.running.cancel()
        log.info("session ended", {"sessions": len(self._kept)})


def _is_second(session: Session) -> bool:
    """Whether it is the second of a client that is still there."""
    return session.beside is not None and session.beside.connections > 0
