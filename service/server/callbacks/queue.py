"""All callbacks: each is sent when its render or batch has ended, and again where that fails, if need be by later
servers."""

from __future__ import annotations

import asyncio
import json
import logging
import random
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from service.callback_hosts import CallbackHosts
from service.config import Config
from service.problems import FieldError, InvalidDocument, ServiceError, TooManyRequests
from service.server.batches.batch import Batch
from service.server.callbacks import signing
from service.server.renders.render import Render
from service.server.renders.status import iso
from service.server.storage.callback_rows import Callback, CallbackRows, Kind
from service.server.storage.database import Database
from service.system.background import Background, reported, within
from service.system.executors import answering, recording, resolving
from service.system.shares import CALLER, Shares
from service.system.turns import Turns

if TYPE_CHECKING:
    import ssl


AT_ONCE = 16  # attempts, of which an owner has its share: half of what others leave
OF_ONE_HOST = 2  # of these: a host that does not answer leaves room for the others
SILENCES = 3  # attempts in a row without an answer, after which a host has one at a time
EACH = 10_000  # callbacks of one owner that have not ended
RETRY_S = 60  # when to ask again where an owner has as many
# Seconds between the eight attempts, half a day in all: a render is kept for a day, so that who is told can still
# fetch its picture. Each is longer or shorter by up to a tenth, so that what failed together is not sent together.
PAUSES = (5.0, 60.0, 300.0, 1_800.0, 3_600.0, 3 * 3_600.0, 8 * 3_600.0)
SCATTER = 0.1
LONGEST_S = 60.0  # between two looks for what is due: clocks jump
AGAIN_S = 5.0  # after the disk failed
CALLBACK = "callback"  # what its tasks are called in the log and in /metrics
GONE = 410  # by Standard Webhooks: the receiver wants no more

log = logging.getLogger(__name__)


class Callbacks:
    """For the event loop, but for `listed`."""

    def __init__(self, config: Config, find: Callable[[Kind, str, str], Render | Batch]) -> None:
        """`find` gives the render or batch of an id and owner, and raises NotFound, Gone."""
        self._config = config
        self._hosts = CallbackHosts.parse(config.callback_hosts)
        self._find = find
        self._rows = CallbackRows(Database(config.data_dir))
        self.listed = self._rows.listed
        self.outcomes: Counter[str] = Counter()  # of attempts: delivered, retried, failed
        self._pending: Counter[str] = Counter()  # that have not ended, by owner
        self._sending = dict[str, Callback]()  # by id
        self._turns = Turns()
        self._silences: Counter[str] = Counter()  # of hosts, since their last answer
        self._tasks = Background()
        self._woken = asyncio.Event()
        self._secrets: list[str] = []
        self._tls: ssl.SSLContext | None = None

    @property
    def pending(self) -> int:
        return self._pending.total()

    def check(self, url: str | None, owner: str, stored: bool) -> None:
        """Raise InvalidDocument for a URL that no callback may go to, TooManyRequests where its owner has too many.
        `stored`: whether renders outlive the server."""
        if url is None:
            return
        try:
            self._hosts.origin(url)
            if not stored:
                raise ValueError("needs the data folder, which cannot be written to")
        except ValueError as error:
            raise InvalidDocument([FieldError("/callback", str(error))]) from None
        if self._pending[owner] >= EACH:
            raise TooManyRequests(f"{EACH} callbacks of yours wait: no more may", RETRY_S)

    async def start(self) -> None:
        """Go on with what an earlier server left."""
        pending, waiting = await recording(self._rows.pending), await recording(self._rows.waiting)
        self._pending = pending
        if not self._hosts.origins and not pending:
            return
        for each in waiting:
            try:
                self._tasks.start(CALLBACK, self._follow(self._find(each.kind, each.subject, each.owner)))
            except ServiceError as error:  # it ended, and made room for others before anybody was told
                self._tasks.start(CALLBACK, self._end(each, error))
        self._tasks.start("sender of callbacks", self._run())

    def follow(self, subject: Render | Batch) -> None:
        """Send a callback when it has ended; it is stored already."""
        self._pending[subject.owner] += 1
        self._tasks.start(CALLBACK, self._follow(subject))

    async def close(self) -> None:
        """The server ends: what is not delivered is left for the next one."""
        await self._tasks.close()

    async def _follow(self, subject: Render | Batch) -> None:
        await subject.finished.wait()
        if isinstance(subject, Render):
            await subject.recorded()
        kind: Kind = "render" if isinstance(subject, Render) else "batch"
        status = subject.snapshot()
        body = await answering(lambda: event(kind, status()))
        await self._stored(partial(self._rows.make_due, kind, subject.id, body, time.time()))
        self._woken.set()

    async def _stored(self, write: Callable[[], None]) -> None:
        """Write, again and again where the disk fails."""
        while True:
            try:
                return await recording(write)
            except ServiceError as error:
                log.warning("could not store the state of a callback", {"error": error})
                await asyncio.sleep(AGAIN_S)

    async def _run(self) -> None:
        """Send what is due, a few at a time."""
        while True:
            self._woken.clear()
            pause = AGAIN_S
            with reported("sender of callbacks"):
                try:
                    if self._tls is None:
                        self._secrets = await recording(partial(signing.secrets_of, self._config))
                        self._tls = await resolving(_prepared)
                    pause = await self._begin()
                except ServiceError as error:
                    log.error("could not send callbacks", {"error": error})
            await within(self._woken, pause)

    async def _begin(self) -> float:
        """Begin all attempts that are due and have room; the seconds until the next one."""
        while owners := self._owners():
            busy = Counter(each.host for each in self._sending.values())
            full = [host for host, attempts in busy.items() if attempts >= self._most_of(host)]
            now = time.time()
            found = await recording(partial(self._rows.next, owners, full, list(self._sending), now))
            left = LONGEST_S if found is None else (found.next_at or 0.0) - now
            if found is None or left > 0:
                return min(left, LONGEST_S)
            self._sending[found.id] = found
            self._turns.had(found.owner)
            self._tasks.start(CALLBACK, self._attempt(found), partial(self._try_later, found))
        return LONGEST_S

    def _owners(self) -> list[str]:
        """Owners that may have another attempt: first that of the fewest, then the one whose turn is longest ago."""
        shares = Shares(AT_ONCE, "attempts")
        for each in self._sending.values():
            shares.count(each.owner)
        able = (owner for owner, count in self._pending.items() if count > 0 and shares.has_room(owner))
        return self._turns.order(able, shares.of)

    def _most_of(self, host: str) -> int:
        return 1 if self._silences[host] >= SILENCES else OF_ONE_HOST

    async def _attempt(self, callback: Callback) -> None:
        from service.server.callbacks import posting

        CALLER.set(callback.owner)  # whose turns at threads these are
        answer, error = None, None
        try:
            body, now = (callback.body or "").encode(), time.time()
            headers = signing.headers(callback.id, int(now), body, self._secrets)
            assert self._tls is not None
            answer = await posting.post(callback.url, body, headers, self._hosts, self._tls)
            self._silences.pop(callback.host, None)
            if not 200 <= answer < 300:
                error = f"it answered {answer}" + (", and redirects are not followed" if answer // 100 == 3 else "")
        except posting.NotSent as reason:
            self._silences[callback.host] += 1
            error = str(reason)
        except Exception:
            log.exception("a callback could not be sent")
            error = "the server could not send it"
        await self._stored(partial(self._rows.attempted, self._after(callback, answer, error)))
        del self._sending[callback.id]
        self._woken.set()

    def _try_later(self, callback: Callback, _: Exception) -> None:
        """An error of the server ended an attempt, of which nothing is stored."""
        asyncio.get_running_loop().call_later(AGAIN_S, self._sending.pop, callback.id, None)

    def _after(self, callback: Callback, answer: int | None, error: str | None) -> Callback:
        """The callback after an attempt."""
        now, attempts = time.time(), callback.attempts + 1
        more = attempts <= len(PAUSES) and answer != GONE
        known = replace(callback, attempts=attempts, answer=answer, error=error, next_at=None)
        fields: dict[str, object] = {"host": callback.host, "id": callback.id, "attempts": attempts}
        if error is not None and more:
            self.outcomes["retried"] += 1
            pause = PAUSES[attempts - 1] * random.uniform(1 - SCATTER, 1 + SCATTER)
            return replace(known, next_at=now + pause)
        self._pending[callback.owner] -= 1
        if error is None:
            self.outcomes["delivered"] += 1
            log.debug("delivered a callback", fields)
            return replace(known, state="delivered", ended_at=now)
        self.outcomes["failed"] += 1
        fields["error"] = error
        log.warning("gave up a callback", fields)
        return replace(known, state="failed", ended_at=now)

    async def _end(self, callback: Callback, error: ServiceError) -> None:
        """Nobody is told of it: its render is gone."""
        self._pending[callback.owner] -= 1
        self.outcomes["failed"] += 1
        gone = replace(callback, state="failed", ended_at=time.time(), error=error.detail)
        await self._stored(partial(self._rows.attempted, gone))


def _prepared() -> ssl.SSLContext:
    """Import the HTTP library, which the start does without, and read the certificates."""
    from service.server.callbacks import posting

    return posting.tls()


OF_RENDERS = (
    "id", "state", "label", "created", "started", "ended", "reason", "samples", "noise", "elapsed_s", "problem",
)  # fmt: skip
OF_BATCHES = ("id", "state", "label", "created", "counts")
LONGEST = 500  # characters of each part of a problem: the rest is in the render's status


def event(of: Kind, status: dict[str, Any]) -> str:
    """The body of a callback, as JSON: `type` and `timestamp` are those of Standard Webhooks."""
    names = OF_RENDERS if of == "render" else OF_BATCHES
    data: dict[str, Any] = {name: status[name] for name in names if name in status}
    if (problem := data.get("problem")) is not None:
        parts = (name for name in ("type", "title", "detail") if name in problem)
        data["problem"] = {name: str(problem[name])[:LONGEST] for name in parts}
    body = {"type": f"{of}.ended", "timestamp": iso(time.time()), "data": data}
    return json.dumps(body, ensure_ascii=False, separators=(",", ":"))
