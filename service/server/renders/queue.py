"""All renders asked for over REST: some run, some wait, ended ones are kept for a while. Each has its owner."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections import Counter, OrderedDict
from collections.abc import Awaitable, Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import partial

from service.problems import FieldError, Gone, InvalidDocument, NotFound, TooManyRequests, Unavailable
from service.server.renders import listing
from service.server.renders.documents import WaitingDocuments
from service.server.renders.followers import Follower, Followers
from service.server.renders.recorder import Recorder
from service.server.renders.render import InBatch, Render
from service.server.renders.retention import (
    LoadedPictures,
    QueueLimits,
    RetainedRenders,
    forget,
    in_memory,
    move_to_row,
    take_up,
)
from service.server.renders.scene import PackedScenes
from service.server.renders.slots import Slots
from service.server.renders.store.batch_rows import BatchOrder
from service.server.renders.store.record import ENDED, IdempotencyKey, State, StoredRender
from service.server.renders.store.rows import REMEMBERED, EndedMember
from service.server.renders.store.store import MEMBER_BYTES, RenderStore
from service.server.storage.asset_access import NO_USES, AllowedUses
from service.server.storage.quota import QuotaUsedUp
from service.system.background import Background
from service.system.executors import answering

RETRY_S = 5  # when to ask again where there is no room
CLOSING_S = 3.0  # for the last samples of running renders to reach the disk
EVICTION_S = 60.0  # at most between two looks for renders that are too old

log = logging.getLogger(__name__)


class RenderQueue:
    """The renders of all owners. An owner is a text that the caller chooses; nobody else learns of its renders."""

    def __init__(self, limits: QueueLimits, store: RenderStore | None = None) -> None:
        """With a `store` renders outlive the server."""
        self.limits = limits
        self.store = store
        self._jobs: dict[str, Render] = {}  # in the order of arrival, without those of batches that are rows
        self._followers = Followers[Render]()
        self._gone: OrderedDict[str, tuple[str, int]] = OrderedDict()  # owners and numbers of forgotten ones
        self._number = 0  # of the last one
        self._slots = Slots(self.limits.running, self._on_finished)
        self._waiting = self._slots.waiting
        self.packed = PackedScenes()  # of those that wait
        self._storing: Counter[str] = Counter()  # by owner: they are being stored, and wait as soon as they are
        self._documents = WaitingDocuments(self.limits.disk_bytes)
        self._retained: RetainedRenders[Render | InBatch] = RetainedRenders(self.limits.retention)
        self.loaded_pictures = LoadedPictures()
        self._chores = Background()
        self._timer: asyncio.TimerHandle | None = None
        self.closing = False

    def resume(
        self,
        stored: Collection[StoredRender],
        make: Callable[[StoredRender], Render],
        batches: Collection[InBatch] = (),
        members: Mapping[str, tuple[int, int]] | None = None,
        ended: Collection[EndedMember] = (),
    ) -> None:
        """Take up what the store has: ended ones are kept, the others go on or wait. `members`: by the ids of renders
        of batches the batch's number and the step; `ended`: those of them that have ended."""
        assert self.store is not None
        known = {batch.number: batch for batch in batches}
        take_up(batches, ended, self.store)
        for batch in batches:
            self._documents.count(batch, batch.bytes)
        for each in stored:
            if each.gone:
                self._remember(each.order.id, each.order.owner, each.number)
                continue
            job = make(each)
            job.number = self._number = each.number
            whole = each.outcome.state in ENDED
            job.recorder = Recorder(self.store, each.number, job.id, whole, job.renderers, job.owner)
            self._know(job)
            if (place := (members or {}).get(job.id)) is not None:
                known[place[0]].add(place[1], job)
            else:
                job.changes.followers = self._followers
            if not job.finished.is_set():
                self._slots.add(job)
                self._documents.count(job, job.order.bytes)
        for job in sorted(self._jobs.values(), key=lambda job: job.ended_at):
            if job.finished.is_set() and job.batch is None:
                self._retained.add(job)
        if self._jobs:
            log.info("took up stored renders", {"waiting": len(self._waiting), "ended": self.retained})
        self._evict()
        self._slots.dispatch()

    async def submit(
        self, job: Render, uses: AllowedUses = NO_USES, key: IdempotencyKey | None = None, listed: bool = True
    ) -> None:
        """Queue a job, which runs when its turn comes; it is stored first where that is possible.

        `uses`: the assets that it refers to. The caller releases one that is not `listed`. Raises TooManyRequests
        where its owner has as many under way as one may have, Unavailable where the queue or the disk is full.
        """
        try:
            self.admit(job.owner)
            if listed and self.store is not None:
                job.number = await self._stored(job, uses, key)
        except BaseException:
            job.release()
            raise
        if listed and self.store is not None:
            job.recorder = Recorder(self.store, job.number, job.id, renderers=job.renderers, owner=job.owner)
            job.scene.forget_document()
        if listed:
            self._number = job.number = max(job.number, self._number + 1)
            self._know(job)
            job.changes.followers = self._followers
            job.changes.tell(job)
        self._slots.add(job)
        self._slots.dispatch()
        if job in self._waiting:
            job.scene.set_aside()

    async def submit_member(self, job: Render, batch: InBatch, step: int) -> None:
        """Queue a render of a batch, as `submit`: it is not listed, and stays for as long as its batch does."""
        self.admit(job.owner)
        if self.store is not None:
            self._storing[job.owner] += 1
            insert = partial(self.store.insert_member, job.order, job.outcome, batch.number, step)
            try:
                job.number = await self._make_room_for(insert, MEMBER_BYTES)
            finally:
                self._storing[job.owner] -= 1
            whole = job.finished.is_set()
            job.recorder = Recorder(self.store, job.number, job.id, whole, job.renderers, job.owner)
        self.take_member(job, batch, step)

    def take_member(self, job: Render, batch: InBatch, step: int) -> None:
        """A render of a batch is there, and waits if it has not ended."""
        self._number = job.number = max(job.number, self._number + 1)
        self._know(job)
        batch.add(step, job)
        if job.finished.is_set():
            self._chores.start("end of a render", move_to_row(job, batch, self._jobs))
            return
        self._slots.add(job)
        self._slots.dispatch()
        if job in self._waiting:
            job.scene.set_aside()

    def admit(self, owner: str) -> None:
        """Raise what `submit` would raise, before a scene is read for nothing."""
        if self.closing:
            raise Unavailable("The server is shutting down.", RETRY_S)
        theirs = len(self._waiting.line(owner)) + self._storing[owner]
        active = theirs + sum(job.owner == owner for job in self._slots.running)
        if active >= self.limits.each:
            detail = f"{active} renders of yours are under way: no more than {self.limits.each} (SUNBOX_MAX_JOBS)"
            raise TooManyRequests(detail, RETRY_S)
        # A queue that is full still takes renders of owners with less than their share of it.
        share = self.limits.waiting // max(1, len(self._waiting.callers) + (theirs == 0))
        if self.queued >= self.limits.waiting and theirs >= share:
            raise Unavailable(f"{self.queued} renders are waiting; the queue is full (SUNBOX_MAX_QUEUE)", RETRY_S)

    def get(self, id: str, owner: str = "") -> Render:
        if id in self._gone and self._gone[id][0] == owner:
            raise Gone("This render was deleted, or it ended long ago and made room for newer ones.")
        job = self._jobs.get(id)
        if job is None or job.owner != owner:
            raise NotFound("There is no render of this id.")
        return job

    async def page(
        self,
        owner: str = "",
        label: str | None = None,
        state: State | None = None,
        limit: int = 200,
        after: str | None = None,
    ) -> listing.Page:
        """An owner's renders, the newest first, of that label and state; those that were asked for before `after`.

        Raises InvalidDocument where there never was a render `after`.
        """
        last = None if after is None else self._place(after, owner)
        newest_first = list(reversed(self._jobs.values()))
        return await answering(partial(listing.page, newest_first, owner, label, state, limit, last))

    @contextmanager
    def follower(self, owner: str) -> Iterator[Follower[Render]]:
        """Learns of every change of an owner's renders; first of those that are under way."""
        with self._followers.follower(owner) as follower:
            under_way = (*self._slots.running, *self._waiting.line(owner))  # not all that are kept: those are many
            for job in sorted(under_way, key=lambda job: job.number):
                if job.owner == owner and job.batch is None and job.id in self._jobs and not job.finished.is_set():
                    follower.add(job)
            if self.closing:
                follower.close()
            yield follower

    def _place(self, id: str, owner: str) -> int:
        """The number of a render, which may be gone. Raises InvalidDocument."""
        job = self._jobs.get(id)
        known, number = self._gone.get(id, (None, 0)) if job is None else (job.owner, job.number)
        if known != owner:
            raise InvalidDocument([FieldError("/after", "is not the id of one of your renders")])
        return number

    @property
    def queued(self) -> int:
        return len(self._waiting) + self._storing.total()

    @property
    def running(self) -> int:
        return len(self._slots.running)

    @property
    def retained(self) -> int:
        return len(self._retained)

    def _know(self, job: Render) -> None:
        """Find it by its id from now on, and its picture where memory is taken from."""
        self._jobs[job.id] = job
        job.loaded_pictures = self.loaded_pictures

    async def close(self) -> None:
        """Have the last samples of what runs stored, for the next start; what is not stored is cancelled."""
        if self.closing:
            return
        self.closing = True
        self._followers.close()
        self._slots.close()
        if self._timer is not None:
            self._timer.cancel()
        for job in [*self._slots.running, *self._waiting]:
            if job.recorder is None:
                job.cancel()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(CLOSING_S):
                await asyncio.gather(*(job.close() for job in self._jobs.values() if not job.finished.is_set()))
                await self._chores.ended()

    async def _stored(self, job: Render, uses: AllowedUses, key: IdempotencyKey | None) -> int:
        """The number that the store gave to the job."""
        self._documents.take(job, job.order.bytes)
        self._storing[job.owner] += 1
        try:
            return await self._insert(job, uses, key)
        except BaseException:
            self._documents.release(job)
            raise
        finally:
            self._storing[job.owner] -= 1

    async def _insert(self, job: Render, uses: AllowedUses, key: IdempotencyKey | None) -> int:
        """Where nothing makes room, there is a reserve for owners of few bytes at last."""
        assert self.store is not None
        scene = job.scene
        assert scene.document is not None
        insert = partial(
            self.store.insert, job.order, job.outcome, scene.document, uses, key, patch=scene.patch, base=scene.base
        )
        try:
            return await self._make_room_for(insert, job.order.bytes)
        except QuotaUsedUp:
            if self._documents.take_reserve(job, job.order.bytes):
                return await insert(reserved=True)
            raise

    async def _make_room_for(self, insert: Callable[[], Awaitable[int]], missing: int) -> int:
        """Returns `await insert()`, for which ended renders make room. Raises QuotaUsedUp where there are none."""
        while True:
            try:
                return await insert()
            except QuotaUsedUp:
                goes, missing = self._retained.take_for(missing), 2 * missing
                if not goes:
                    raise
                await forget(self._drop(goes), self.store)

    def _on_finished(self, job: Render) -> None:
        if job.finished.is_set() and job.id in self._jobs:
            self.loaded_pictures.add(job)
        self._ended(job)

    def _ended(self, job: Render) -> None:
        self._documents.release(job)
        if job.finished.is_set() and job.id in self._jobs:
            if job.batch is None:
                self._retained.add(job)
            else:
                job.batch.ended(job)
                self._chores.start("end of a render", move_to_row(job, job.batch, self._jobs))
        self._evict()

    def cancel(self, job: Render) -> None:
        """Cancel a job that waits or runs; the image so far stays."""
        self._slots.remove(job)
        job.cancel()
        self._ended(job)
        if job.recorder is not None:
            self._chores.start("count of a picture's bytes", self._weigh(job))

    async def _weigh(self, job: Render) -> None:
        """Count what is stored of a cancelled render, once it is."""
        await job.recorded()
        if job.id in self._jobs and job.batch is None:
            self._retained.add(job)

    def keep(self, batch: InBatch) -> None:
        """Its last render has ended: from now on it may make room for others."""
        self._documents.release(batch)
        self._retained.add(batch)
        self._evict()

    async def store_batch(
        self, batch: InBatch, order: BatchOrder, body: bytes, uses: AllowedUses, key: IdempotencyKey | None
    ) -> int:
        """The number of a batch in the store. Raises Unavailable, TooManyRequests."""
        if self.store is None:
            return 0
        self._documents.take(batch, order.bytes)
        try:
            return await self._make_room_for(partial(self.store.insert_batch, order, body, uses, key), order.bytes)
        except BaseException:
            self._documents.release(batch)
            raise

    async def delete_batch(self, batch: InBatch) -> None:
        """Forget a batch that has ended, and its pictures. Raises Unavailable where the disk fails."""
        for job in list(batch.jobs.values()):  # which leave it meanwhile
            await job.recorded()
        self._retained.remove(batch)
        await forget(self._drop([batch]), self.store)

    async def delete(self, job: Render) -> None:
        """Forget an ended render, its document and its picture. Raises Unavailable where the disk fails."""
        await job.recorded()
        if job.recorder is not None and self.store is not None:
            job.release()
            await job.recorder.close()
            await self.store.forget([(job.recorder.number, job.id)])
        if job.id in self._jobs:
            self._retained.remove(job)
            self._drop([job])

    def _evict(self) -> None:
        if self.closing:
            return
        now = time.monotonic()
        if stored := self._drop(self._retained.take_superfluous(now)):
            self._chores.start("deletion of renders", forget(stored, self.store))
        # So that room is made also when no more requests come.
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if (left_s := self._retained.left_s(now)) is not None:
            self._timer = asyncio.get_running_loop().call_later(min(EVICTION_S, left_s + 1.0), self._evict)

    def _drop(self, goes: Collection[Render | InBatch]) -> list[Recorder | InBatch]:
        """Forget renders and batches; what the store has to forget of them."""
        stored = list[Recorder | InBatch]()
        for each in goes:
            for job in in_memory(each) if isinstance(each, InBatch) else [each]:
                job.release()
                self._jobs.pop(job.id, None)
                self.loaded_pictures.remove(job)
            if isinstance(each, InBatch):
                each.gone = True
                stored.append(each)
                continue
            self._remember(each.id, each.owner, each.number)
            if each.recorder is not None:
                stored.append(each.recorder)
        return stored

    def _remember(self, id: str, owner: str, number: int) -> None:
        self._gone[id] = owner, number
        while len(self._gone) > REMEMBERED:
            self._gone.popitem(last=False)
