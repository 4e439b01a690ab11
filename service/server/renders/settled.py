"""Ended renders of batches: rows of the store, of which a batch knows how they ended. They are objects while somebody
looks at them, or the renderer has their pictures."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Iterable

from service.problems import Gone, ServiceError
from service.server.renders.job import Job
from service.server.renders.life import monotonic
from service.server.renders.ordered import InBatch, KeepsPictures
from service.server.renders.recorder import Recorder
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.rows import EndedMember
from service.server.renders.store.store import RenderStore

Make = Callable[[Order, Outcome], Job]  # a render that has ended

log = logging.getLogger(__name__)


def take_up(batches: Iterable[InBatch], ended: Iterable[EndedMember], store: RenderStore) -> None:
    """Tell batches of an earlier server which of their renders have ended."""
    known = {batch.number: batch for batch in batches}
    for each in ended:
        if (batch := known.get(each.batch)) is not None:
            batch.add_ended(each.step, each.state, monotonic(each.ended_at), store.picture_size(each.id))


async def settle(job: Job, batch: InBatch, jobs: dict[str, Job]) -> None:
    """A render has ended: it leaves `jobs` once it is whole on the disk."""
    await job.recorded()
    if job.recorder is not None and job.recorder.whole:
        jobs.pop(job.id, None)
        batch.settle(job)


async def looked_at(
    batch: InBatch, step: int, id: str, store: RenderStore | None, resting: KeepsPictures, make: Make
) -> Job:
    """A render of a batch, brought back from the store where it is not in memory; its picture stays with `resting`.
    Raises Gone."""
    job: Job | None = batch.job(step)
    if job is None and store is not None:
        stored = await store.one(id)
        job = batch.job(step)  # others may have been faster
        if job is None and stored is not None:
            job = batch.shown[step] = make(stored.order, stored.outcome)
            job.number, job.batch, job.resting = stored.number, batch, resting
            job.recorder = Recorder(store, stored.number, id, True, job.renderers, job.owner)
    if job is None or batch.gone:
        raise Gone("This render was deleted with its batch, or made room for newer ones.")
    return job


def in_memory(batch: InBatch) -> list[Job]:
    """The renders of a batch that are objects."""
    return [*batch.jobs.values(), *batch.shown.values()]


async def forget(dropped: Collection[Recorder | InBatch], store: RenderStore | None) -> None:
    """Delete renders and batches from the store."""
    if store is None:
        return
    batches = [each for each in dropped if not isinstance(each, Recorder)]
    recorders = [each for each in dropped if isinstance(each, Recorder)]
    members = [job.recorder for batch in batches for job in in_memory(batch) if job.recorder is not None]
    for recorder in recorders + members:
        await recorder.close()
    try:
        await store.forget([(recorder.number, recorder.id) for recorder in recorders])
        for batch in batches:
            await store.forget_batch(batch.number, list(batch.ids))
    except ServiceError as error:
        log.warning("could not delete renders from the disk", {"error": error})
