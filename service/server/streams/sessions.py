"""Streams by session: a client whose connection dropped takes its own stream up again, and no other client's."""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections import Counter

from service.problems import NotFound, TooManyRequests
from service.renderers.protocol import Renderers
from service.server.requests.request_reader import RequestReader
from service.server.streams.stream import Stream
from service.system.background import Background
from service.system.shares import Shares

ID_BYTES = 32  # 256 bits: an id cannot be guessed
RETURN_S = 60.0  # of the contract: how long a session waits for its client to come back
GOING_AWAY = 1001  # close code

log = logging.getLogger(__name__)


class Session:
    def __init__(self, id: str, stream: Stream, owner: str, running: asyncio.Task[None]) -> None:
        self.id = id
        self.owner = owner  # the owner of the key that opened it
        self.stream = stream
        self.connections = 0  # at present; two while one replaces the other
        self.running = running
        self.timer: asyncio.TimerHandle | None = None


class Sessions:
    def __init__(self, renderers: Renderers, reader: RequestReader, most: int, each: int | None = None) -> None:
        """`most` streams at a time, of which one key has its share, and at most `each`. Without keys each stream is a
        client of its own."""
        name = "SUNBOX_MAX_CLIENTS" if each is None or each >= most // 2 else "SUNBOX_MAX_KEY_CLIENTS"
        self._shares = Shares(most, f"streams ({name})", each)
        self._renderers = renderers
        self._reader = reader
        self._most = most
        self._running = Background()
        self._sessions: dict[str, Session] = {}  # the longest left first, among those that are left

    @property
    def attended(self) -> int:
        """How many sessions have a connection."""
        return self._shares.total

    @property
    def waiting(self) -> int:
        """How many sessions wait for their clients to come back."""
        return len(self._sessions) - self.attended

    def enter(self, id: str | None, owner: str = "") -> Session:
        """A new session, or the one of that id; `leave` ends what this begins.

        `owner`: whose key it is. A session of another key raises NotFound.

        Raises NotFound when it is gone, TooManyRequests when there is no room, Unavailable without a renderer.
        """
        session = self._of(id, owner)
        if id is not None and session is None:
            raise NotFound("This session is gone: start anew.")
        if session is None:
            session = self._new(owner)
        elif not session.connections:
            self._admit(session.id, owner)
        if session.timer is not None:
            session.timer.cancel()
            session.timer = None
        session.connections += 1
        return session

    def _new(self, owner: str) -> Session:
        id = secrets.token_hex(ID_BYTES)
        self._admit(id, owner)
        try:
            stream = Stream(self._renderers, self._reader, owner)
        except BaseException:
            self._shares.release(owner or id)
            raise
        running = self._running.start("stream", stream.run(), stream.died)
        self._sessions[id] = session = Session(id, stream, owner, running)
        return session

    def _admit(self, id: str, owner: str) -> None:
        if self.attended >= self._most:
            raise TooManyRequests(f"{self._most} streams are open, and no more are taken (SUNBOX_MAX_CLIENTS).")
        self._shares.take(owner or id)

    def _of(self, id: str | None, owner: str) -> Session | None:
        """The session of that id, if that key opened it."""
        session = self._sessions.get(id) if id is not None else None
        return session if session is not None and session.owner == owner else None

    def leave(self, session: Session) -> None:
        """The connection is over; the session waits for another, unless the stream has ended."""
        session.connections -= 1
        if session.connections:
            return
        self._shares.release(session.owner or session.id)
        if session.id not in self._sessions:
            return
        if session.stream.ended is not None:
            self._end(session)
            return
        session.timer = asyncio.get_running_loop().call_later(RETURN_S, self._end, session)
        self._sessions[session.id] = self._sessions.pop(session.id)
        if self.waiting > self._most:  # clients that come and go all the time must not fill the renderer's memory
            waiting = [each for each in self._sessions.values() if not each.connections]
            ((owner, _),) = Counter(each.owner for each in waiting).most_common(1)  # it costs their own key a session
            self._end(next(each for each in waiting if each.owner == owner))

    def close(self, reason: str) -> None:
        """End all streams; their clients are told that the server goes away."""
        for session in list(self._sessions.values()):
            session.stream.end(GOING_AWAY, reason)
            if not session.connections:
                self._end(session)

    def _end(self, session: Session) -> None:
        if self._sessions.pop(session.id, None) is None:
            return
        if session.timer is not None:
            session.timer.cancel()
        session.running.cancel()
        log.info("session ended", {"sessions": len(self._sessions)})
