"""Which ended renders make room, at what cost, and what a deletion leaves."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.config import MIB, Config
from service.ipc.messages import Progress, Restore, SavedPicture
from service.problems import Gone, TooManyRequests, Unavailable
from service.server.renders.documents import WaitingDocuments
from service.server.renders.queue import RenderQueue
from service.server.renders.render import Render
from service.server.renders.retention import RetainedRenders, Retention
from service.server.renders.status import status
from service.server.renders.store.record import Order, Outcome
from service.server.renders.store.store import RenderStore
from service.server.storage.asset_access import NO_USES, AllowedUses
from service.server.storage.quota import QuotaUsedUp, reserve_bytes
from service.server.storage.stores import Storage, storage
from service.system.disk_usage import Usage
from tests.asset_files import OBJ
from tests.queues import LIMITS
from tests.service.rendering.fakes import SETTINGS, Renderers, load


class Ended:
    looks = 0  # at any of them
    counts_as = 1

    def __init__(self, owner: str, ended_at: float, size: int = 1) -> None:
        self.owner, self._ended_at, self._size = owner, ended_at, size

    @property
    def ended_at(self) -> float:
        Ended.looks += 1
        return self._ended_at

    @property
    def size(self) -> int:
        Ended.looks += 1
        return self._size


def test_an_end_costs_as_much_among_many_as_among_few() -> None:
    kept: RetainedRenders[Ended] = RetainedRenders(Retention(most_renders=10_000, most_bytes=1 << 40, longest_s=1e6))
    looks = []
    for number in range(5000):
        Ended.looks = 0
        kept.add(Ended(f"{number % 5}", float(number)))
        assert kept.take_superfluous(5000.0) == []
        assert kept.left_s(5000.0) == 1e6 - 5000.0
        looks.append(Ended.looks)
    assert max(looks[10:]) == looks[10] < 20


def test_old_ones_and_those_of_the_owner_of_most_bytes_go() -> None:
    kept: RetainedRenders[Ended] = RetainedRenders(Retention(most_renders=3, most_bytes=100, longest_s=10.0))
    small, *large = Ended("b", 1.0, 10), *(Ended("a", 2.0 + i, 40) for i in range(3))
    for each in (small, *large):
        kept.add(each)
    assert kept.take_superfluous(5.0) == [large[0]]
    assert kept.take_superfluous(11.5) == [small]
    assert kept.take_for(1) == [large[1]] and len(kept) == 1
    assert kept.take_for(1000) == []  # the newest stays
    kept.remove(large[2])
    assert kept.left_s(0.0) is None and len(kept) == 0


def test_renders_of_batches_count_too() -> None:
    kept: RetainedRenders[Ended] = RetainedRenders(Retention(most_renders=10, most_bytes=100, longest_s=100.0))
    single, *batches = Ended("a", 1.0), *(Ended("a", 2.0 + i) for i in range(3)), Ended("b", 9.0)
    for each, count in zip(batches, (4, 6, 12, 1000), strict=True):
        each.counts_as = count
    for each in (single, *batches[:2]):
        kept.add(each)
    assert kept.take_superfluous(5.0) == [single]
    kept.add(batches[2])
    kept.add(batches[3])
    assert kept.take_superfluous(5.0) == batches[:2], "an owner's last one stays, however many it has"
    kept.remove(batches[2])
    assert len(kept) == 1


def test_documents_that_wait_are_divided_among_the_keys() -> None:
    documents, jobs = (
        WaitingDocuments(64 * MIB),
        [Render(Renderers(), Order(f"{i}", "a", SETTINGS), load) for i in range(3)],
    )  # type: ignore[arg-type]
    documents.take(jobs[0], 10 * MIB)
    with pytest.raises(TooManyRequests, match="SUNBOX_DATA_QUOTA"):
        documents.take(jobs[1], 10 * MIB)
    documents.release(jobs[0])
    documents.take(jobs[1], 10 * MIB)
    documents.release(jobs[0])  # which had ended
    with pytest.raises(TooManyRequests):
        documents.take(jobs[2], 10 * MIB)


QUOTA = 32 * MIB


class Disk:
    """A queue whose renders run for ever, with its data folder."""

    def __init__(self, folder: Path) -> None:
        self.kept: Storage = storage(Config(data_dir=folder, data_quota=QUOTA))
        room = self.kept.quota.room
        self.store = RenderStore(folder, room, partial(room, reserved=True))
        self.queue = RenderQueue(replace(LIMITS, running=1, disk_bytes=QUOTA), self.store)
        self._count = 0

    async def submit(self, owner: str, size: int) -> Render:
        self._count += 1
        order = Order(f"{owner}{self._count}", owner, SETTINGS, bytes=size)
        job = Render(Renderers(), order, load, np.random.default_rng(self._count).bytes(size))  # type: ignore[arg-type]
        await self.queue.submit(job)
        return job

    async def fill(self, owner: str, size: int) -> Exception:
        with pytest.raises((TooManyRequests, Unavailable)) as refused:
            for _ in range(1000):
                await self.submit(owner, size)
        return refused.value

    def upload(self, owner: str, more: bytes = b"") -> str:
        id = self.kept.assets.add(OBJ + more).id
        self.kept.shares.uploaded(owner, [id])
        return id


def test_a_key_that_fills_the_disk_refuses_nobody_elses_small_render(tmp_path: Path) -> None:
    async def scenario() -> None:
        disk = Disk(tmp_path)
        upload = disk.upload("b")
        assert isinstance(await disk.fill("a", MIB), TooManyRequests)
        await disk.submit("b", 300)
        used = disk.kept.quota.used().bytes
        for blob in range(100):  # and "a" fills the rest with what it refers to
            try:
                disk.upload("a", b"#" * MIB + b"%d" % blob)
            except Unavailable:
                break
        assert disk.kept.quota.used().bytes > used
        with disk.kept.quota.room(Usage(QUOTA - reserve_bytes(QUOTA) - used - MIB // 2)):  # what cannot make room
            with pytest.raises(QuotaUsedUp), disk.kept.quota.room(Usage(MIB)):
                pass
            with pytest.raises((TooManyRequests, Unavailable)):
                await disk.submit("a", MIB)
            for _ in range(5):
                await disk.submit("b", MIB // 8)
        assert disk.kept.assets.holds(upload)
        await disk.queue.close()
        await disk.store.close()
        disk.kept.assets.close()

    asyncio.run(scenario())


def test_ended_renders_make_room_for_new_ones(tmp_path: Path) -> None:
    async def scenario() -> None:
        disk = Disk(tmp_path)
        noise = np.frombuffer(np.random.default_rng(0).bytes(3 * MIB), np.uint8)
        saved = SavedPicture(8, (0, 0, 0), [noise])
        await disk.submit("d", 10)  # has the only place, so that the others wait and have their pictures on the disk
        old = []
        for owner in "aab":
            job = await disk.submit(owner, 10)
            await disk.store.write(job.id, "picture", Restore(1, 1, saved, "stopped", Progress(8)))
            disk.queue.cancel(job)
            await job.recorded()
            old.append(job)
        used = disk.kept.quota.used().bytes
        with disk.kept.quota.room(Usage(QUOTA - reserve_bytes(QUOTA) - used - MIB)):
            await disk.submit("c", 2 * MIB)
        with pytest.raises(Gone):
            disk.queue.get(old[0].id, "a")
        assert disk.queue.get(old[1].id, "a") and disk.queue.get(old[2].id, "b")
        assert not disk.store.has(old[0].id, "picture")
        await disk.queue.close()
        await disk.store.close()
        disk.kept.assets.close()

    asyncio.run(scenario())


def test_what_is_deleted_is_gone_from_everywhere(tmp_path: Path) -> None:
    async def scenario() -> None:
        disk = Disk(tmp_path)
        asset = disk.upload("a")
        order = Order("id", "a", SETTINGS, bytes=8)
        job: Any = Render(Renderers(), order, load, b"document")  # type: ignore[arg-type]
        await disk.queue.submit(job, AllowedUses("a", (asset,)))
        disk.queue.cancel(job)
        saved = SavedPicture(8, (0, 0, 0), [np.zeros(64, np.uint8)])
        await disk.store.write("id", "picture", Restore(1, 1, saved, "stopped", Progress(8)))
        with disk.kept.documents.assets_in_use() as in_use:
            assert asset in in_use
        await disk.queue.delete(job)
        with disk.kept.documents.assets_in_use() as in_use:
            assert asset not in in_use
        assert (await disk.queue.page("a")).renders == [] and disk.queue.retained == 0
        assert disk.store.latest("id") is None and not list((tmp_path / "renders").iterdir())
        with pytest.raises(Gone, match="deleted"):
            disk.queue.get("id", "a")
        (left,) = disk.store.load()
        assert left.gone
        await disk.queue.close()
        await disk.store.close()
        disk.kept.assets.close()

    asyncio.run(scenario())


def test_a_row_of_before_has_no_time_of_its_start(tmp_path: Path) -> None:
    async def scenario() -> None:
        store = RenderStore(tmp_path)
        number = await store.insert(Order("old", "", SETTINGS, created_at=0.25), Outcome(), b"", NO_USES)
        await store.update(number, Outcome("done", ended_at=1.5))
        (stored,) = store.load()
        told = status(stored.order, stored.outcome, renderers=0)
        times = "1970-01-01T00:00:00.250Z", None, "1970-01-01T00:00:01.500Z"
        assert (told["created"], told["started"], told["ended"]) == times
        await store.close()

    asyncio.run(scenario())
