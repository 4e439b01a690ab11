"""All batches: each has a few renders in line at a time, so that a million of them take no more than those."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection
from functools import partial

from service.problems import MISTAKE, Conflict, Gone, Internal, NotFound, ServiceError, TooManyRequests, Unavailable
from service.server.batches.batch import ID_DIGITS, RENDERS_OF_ONE, STEP_DIGITS, Batch, Members, member_id, step_of
from service.server.renders.queue import RETRY_S, RenderQueue
from service.server.renders.render import Render
from service.server.renders.retention import looked_at
from service.server.renders.store.batch_rows import BatchOrder, StoredBatch
from service.server.renders.store.record import IdempotencyKey, Order, Outcome
from service.server.storage.asset_access import AllowedUses
from service.system.background import Background, within
from service.system.executors import parsing, recording
from service.system.shares import CALLER

EACH = 32  # batches of one owner that are under way
AGAIN_S = 5.0  # between two attempts to queue a render where there is no room

log = logging.getLogger(__name__)


class BatchQueue:
    """For the event loop. An owner learns of no other's batches."""

    def __init__(
        self,
        renders: RenderQueue,
        members: Callable[[Batch, bytes], Members],
        ended: Callable[[Order, Outcome], Render],
        ahead: int,
    ) -> None:
        """`ended` makes a render that has ended before it began. `ahead`: renders of a batch that wait or run at a
        time."""
        self._renders, self._members, self._made_ended, self._ahead = renders, members, ended, ahead
        self._batches: dict[str, Batch] = {}  # in the order of arrival
        self._tasks = Background()

    async def submit(self, order: BatchOrder, body: bytes, uses: AllowedUses, key: IdempotencyKey | None) -> Batch:
        """Store a batch and begin it. Raises what packing its first scene raises; TooManyRequests, Unavailable."""
        self.admit(order.owner)
        batch = Batch(order)
        self._check_number(batch)
        members = await parsing(partial(self._members, batch, body), batch.client)
        await members.check()
        batch.number = await self._renders.store_batch(batch, order, body, uses, key)
        self._batches = {id: each for id, each in self._batches.items() if not each.gone} | {batch.id: batch}
        self._begin(batch, members)
        return batch

    def admit(self, owner: str) -> None:
        """Raise what `submit` would raise, before a scene is read for nothing."""
        self._renders.admit(owner)
        under_way = len(self._under_way(owner))
        if under_way >= EACH:
            raise TooManyRequests(f"{under_way} batches of yours are under way: no more than {EACH} may be", RETRY_S)

    def _under_way(self, owner: str) -> list[Batch]:
        return [each for each in self._batches.values() if each.owner == owner and not each.finished.is_set()]

    def _check_number(self, batch: Batch) -> None:
        """Raise TooManyRequests where an owner's batches have more renders than are kept once they have ended."""
        others, limit = self._under_way(batch.owner), self._renders.limits.retention.most_renders
        if others and batch.counts_as + sum(each.counts_as for each in others) > limit:
            renders, most = sum(each.order.renders for each in others), limit * RENDERS_OF_ONE
            detail = (
                f"{renders} renders of your batches are under way, and with these there would be more than {most}"
            )
            raise TooManyRequests(f"{detail} (ten times SUNBOX_KEEP_RENDERS)", RETRY_S)

    def resume(self, stored: Collection[StoredBatch]) -> list[Batch]:
        """The batches that the store has, which go on with `go_on` once they have their renders."""
        for each in stored:
            batch = Batch(each.order)
            batch.number, batch.cancelled = each.number, each.cancelled
            self._batches[batch.id] = batch
        return list(self._batches.values())

    def go_on(self) -> None:
        for batch in self._batches.values():
            if batch.cancelled:
                self._cancel(batch)
            batch.finish_if_done()  # all of its renders may have ended
            if batch.finished.is_set():
                self._renders.keep(batch)
            else:
                self._begin(batch, None)

    def get(self, id: str, owner: str = "") -> Batch:
        """Raises NotFound."""
        batch = self._batches.get(id)
        if batch is None or batch.owner != owner:
            raise NotFound("There is no batch of this id.")
        if batch.gone:
            raise Gone("This batch was deleted, or it ended long ago and made room for newer renders.")
        return batch

    def waiting(self, id: str, owner: str = "") -> tuple[Batch, int] | None:
        """The batch of a render that is not there yet, and its place in it."""
        found = self._place(id, owner)
        return None if found is None or found[0].steps.is_made(found[1]) else found

    async def render(self, id: str, owner: str = "") -> Render:
        """A render, of a batch or alone. Raises NotFound, Gone, and Conflict for one of a batch that is not there
        yet."""
        if (found := self._place(id, owner)) is None:
            return self._renders.get(id, owner)
        batch, step = found
        if not batch.steps.is_made(step):
            raise Conflict("This render of a batch waits for its turn: it has no picture yet.")
        return await self.render_of(batch, step)

    async def render_of(self, batch: Batch, step: int) -> Render:
        """A render that was made. Raises Gone."""
        renders, id = self._renders, member_id(batch.id, step)
        return await looked_at(batch, step, id, renders.store, renders.loaded_pictures, self._made_ended)

    def _place(self, id: str, owner: str) -> tuple[Batch, int] | None:
        """The batch of a render, and its place in it."""
        if len(id) != ID_DIGITS + STEP_DIGITS:
            return None
        for batch in self._batches.values():  # few, and all ids but those of their renders end here
            if batch.owner == owner and not batch.gone and id.startswith(batch.id[:ID_DIGITS]):
                try:
                    step = step_of(id)
                except ValueError:
                    return None
                if step < batch.order.renders and member_id(batch.id, step) == id:
                    return batch, step
        return None

    async def cancel(self, batch: Batch) -> None:
        """Cancel what waits or runs; the pictures so far stay."""
        batch.cancelled = True
        if (store := self._renders.store) is not None:
            await recording(partial(store.batches.cancel, batch.number))
        self._cancel(batch)

    def _cancel(self, batch: Batch) -> None:
        for job in list(batch.jobs.values()):
            if not job.finished.is_set():
                self._renders.cancel(job)
        batch.finish_if_done()

    async def delete(self, batch: Batch) -> None:
        """Forget one that has ended, with its pictures."""
        await self._renders.delete_batch(batch)

    async def keyed(self, owner: str, key: str) -> tuple[str, str] | None:
        """The digest and the id of the batch of an idempotency key."""
        store = self._renders.store
        return None if store is None else await recording(partial(store.batches.keyed, owner, key))

    async def close(self) -> None:
        """The server ends: renders that are not in line yet are made after the next start."""
        await self._tasks.close()

    def _begin(self, batch: Batch, members: Members | None) -> None:
        self._tasks.start("batch", self._feed(batch, members), lambda _: self._give_up(batch))

    async def _feed(self, batch: Batch, members: Members | None) -> None:
        """Put its renders in line, in their order, until all of them were, and wait for the last one's end."""
        CALLER.set(batch.client)  # also where an earlier server began it
        line = self._put_in_line(batch, members)
        del members  # its document leaves the memory when the last render is in line
        await line
        while not batch.finished.is_set():
            await self._changed(batch)
        self._renders.keep(batch)

    def _give_up(self, batch: Batch) -> None:
        """End it, and those of its renders that are not made yet with it: tasks that wait for it go on."""
        batch.cancelled = True
        self._cancel(batch)
        if batch.finished.is_set():
            self._renders.keep(batch)

    async def _put_in_line(self, batch: Batch, members: Members | None) -> None:
        missing = [step for step in range(batch.order.renders) if not batch.steps.is_made(step)]
        for step in missing:
            while batch.ahead >= self._ahead and not batch.cancelled:
                await self._changed(batch)
            if batch.cancelled:
                return
            try:
                if (members := members or await self._read(batch)) is None:
                    return
                job = await members.job(step, stored=self._renders.store is not None)
                await self._wait_for_room(job, batch, step)
            except Exception as error:
                await self._fail(batch, step, error)

    async def _fail(self, batch: Batch, step: int, error: Exception) -> None:
        """One of its renders cannot be made, which is that render's end; the others go on."""
        unexpected = not isinstance(error, ServiceError)
        log.warning(
            "a render of a batch cannot be made",
            {"id": member_id(batch.id, step)[:6], "step": step, "error": error},
            exc_info=error if unexpected else None,
        )
        problem = error if isinstance(error, ServiceError) else Internal(MISTAKE)
        job = self._made_ended(batch.member(step), Outcome().failed(problem, time.time()))
        try:
            await self._wait_for_room(job, batch, step)
        except Exception:
            log.exception("a failed render of a batch could not be stored")
            self._renders.take_member(job, batch, step)

    async def _wait_for_room(self, job: Render, batch: Batch, step: int) -> None:
        while not batch.cancelled and not await self._queued(job, batch, step):
            await self._changed(batch, AGAIN_S)

    async def _queued(self, job: Render, batch: Batch, step: int) -> bool:
        """True if there was room for it in line. A batch that was cancelled meanwhile takes it out again."""
        batch.queueing = True
        try:
            await self._renders.submit_member(job, batch, step)
        except (TooManyRequests, Unavailable) as error:
            job.wait(error)
            job.scene.wait_as_document()
            return False
        finally:
            batch.queueing = False
            if batch.cancelled:
                self._cancel(batch)
            else:
                batch.finish_if_done()  # it may be the last one, and have ended
        return True

    async def _read(self, batch: Batch) -> Members | None:
        """The renders of a batch that an earlier server began, once there is memory for its document and the disk can
        be read; None where it is cancelled before. Raises NotFound, TooLarge."""
        assert self._renders.store is not None
        while not batch.cancelled:
            try:
                body = await recording(partial(self._renders.store.batches.body, batch.number))
                if body is None:
                    raise NotFound("The document of this batch is not stored any more.")
                return await parsing(partial(self._members, batch, body), batch.client)
            except (TooManyRequests, Unavailable) as error:
                log.warning("a batch has to wait", {"id": batch.id[:6], "error": error})
                await self._changed(batch, AGAIN_S)
        return None

    @staticmethod
    async def _changed(batch: Batch, seconds: float | None = None) -> None:
        batch.changed.clear()
        await within(batch.changed, seconds)
