"""The renders' store for the event loop: whatever touches the disk runs in threads.

Rows are written in the order in which they are handed over, by one thread. Small pictures have another, and large
ones two more, as they take seconds: no small render waits for them when it ends. Methods raise Unavailable where the
disk takes no more.
"""

from __future__ import annotations

import errno
import logging
import shutil
import tempfile
from collections.abc import Callable, Collection
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TypeVar

from service.ipc.messages import Progress, Restore
from service.problems import ServiceError, Unavailable
from service.server.renders.store.batch_rows import BatchOrder, BatchRows
from service.server.renders.store.pictures import KINDS, DamagedPicture, Kind, PictureFiles
from service.server.renders.store.record import ENDED, IdempotencyKey, Order, Outcome, StoredRender
from service.server.renders.store.rows import EndedMember, RenderRows
from service.server.requests.batch_request import document_of_step
from service.server.requests.request_parser import patched
from service.server.storage.asset_access import AllowedUses
from service.server.storage.database import Database
from service.server.storage.stores import RENDERS
from service.system.disk_usage import Usage, expected, trouble
from service.system.executors import (
    Pool,
    packing,
    reading_large_pictures,
    recording,
    saving_large_pictures,
    saving_pictures,
)

log = logging.getLogger(__name__)

RETRY_S = 30
MAKING = ".batch-"  # how the names of folders begin in which files of several pictures are made
MEMBER_BYTES = 4096  # of the row of a render of a batch, once it has ended
LARGE = 16 << 20  # bytes of a picture, which take 0.1 s of a middling disk
READ_ONLY = {errno.EACCES, errno.EPERM, errno.EROFS}

T = TypeVar("T")
Room = Callable[[Usage], AbstractContextManager[None]]


class RenderStore:
    """`room` is entered with what is to be stored, and raises where there is no room for it; `reserved` likewise for
    small orders, where there is room in what is reserved for them."""

    def __init__(
        self, folder: Path, room: Room = lambda size: nullcontext(), reserved: Room = lambda size: nullcontext()
    ) -> None:
        self._folder = folder
        self._rows = RenderRows(Database(folder))
        self.batches = BatchRows(Database(folder))
        self._files = PictureFiles(folder / RENDERS, room)
        self._room, self._reserved = room, reserved
        self.failures = 0  # of writes, which had to do without

    def usable(self) -> bool:
        """True if the data folder can be written to; a disk that is full may have room later."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=self._folder).close()
        except OSError as error:
            return error.errno not in READ_ONLY
        return True

    def load(self) -> list[StoredRender]:
        """Every render but the ended ones of batches, in the order of arrival, as far as it was stored. Not for an
        event loop.

        One that this version cannot read is a failed one, which says so; its row and its files stay as they are.
        """
        for left in self._folder.glob(f"{MAKING}*"):  # by a crash
            shutil.rmtree(left, ignore_errors=True)
        stored = self._rows.all()
        for each in stored:
            if each.unfit is not None and not each.gone:
                log.error(
                    "a stored render cannot be read, so it failed", {"id": each.order.id[:6], "reason": each.unfit}
                )
        if left_out := set[str]().union(*(each.unknown for each in stored)):
            log.warning("left out what this version does not know of renders", {"fields": ",".join(sorted(left_out))})
        present, gone = ([each.order.id for each in stored if each.gone is is_gone] for is_gone in (False, True))
        ended = [each.id for each in self._rows.ended_members()]
        self._files.prepare({*present, *ended}, gone)
        for id in ended:
            self._tidy(id)
        return [each if each.gone else self._reached(each) for each in stored]

    def _reached(self, render: StoredRender) -> StoredRender:
        """With the progress of the picture that there is of it."""
        id, outcome = render.order.id, render.outcome
        if render.unfit is not None:
            return render
        if self._files.has(id, "picture"):
            if outcome.state in ENDED:
                self._tidy(id)
            return render
        return replace(render, outcome=replace(outcome, progress=self._checkpointed(id)))

    def _tidy(self, id: str) -> None:
        """Delete the checkpoint of an ended render that has a picture, where a crash came before that was done."""
        if self._files.has(id, "checkpoint") and self._files.has(id, "picture"):
            with suppress(OSError):
                self._files.delete(id, "checkpoint")

    async def one(self, id: str) -> StoredRender | None:
        """A render as it is stored; None where it is deleted."""

        def read() -> StoredRender | None:
            found = self._rows.one(id)
            return found if found is None else self._reached(found)

        return await recording(read)

    async def open(self) -> None:
        """Be ready for many renders, until `close`."""
        with suppress(Unavailable):  # the disk fails; each write tries again
            await recording(self._rows.hold)

    async def close(self) -> None:
        await recording(self._rows.close)

    @property
    def pictures(self) -> Usage:
        """Disk usage of all pictures."""
        return self._files.usage

    def size(self, order: Order) -> int:
        """The bytes of a render and its pictures on the disk."""
        return order.bytes + self._files.size(order.id)

    def has(self, id: str, kind: Kind) -> bool:
        return self._files.has(id, kind)

    def latest(self, id: str) -> Kind | None:
        """The kind of a render's stored picture; None: nothing is stored."""
        return next((kind for kind in KINDS if self._files.has(id, kind)), None)

    def _checkpointed(self, id: str) -> Progress:
        """How far a render was at its last checkpoint."""
        try:
            return self._files.progress(id, "checkpoint")
        except FileNotFoundError:
            return Progress()
        except (DamagedPicture, OSError) as error:
            log.error("could not read a checkpoint, so its render begins again", {"id": id[:6], "error": error})
            with suppress(OSError):
                self._files.set_aside(id, "checkpoint")
            return Progress()

    async def insert(
        self,
        order: Order,
        outcome: Outcome,
        document: bytes,
        uses: AllowedUses,
        key: IdempotencyKey | None = None,
        reserved: bool = False,
        patch: bytes | None = None,
        base: int | None = None,
    ) -> int:
        """The number of a render that waits from now on, and is on the disk: of `document` with `patch` merged in,
        both of them folded. `base`: the number of a render that brought this document, which is stored once."""

        def insert() -> int:
            with (self._reserved if reserved else self._room)(expected([order.bytes])):
                return self._rows.insert(order, outcome, document, uses, key, patch, base)

        return await recording(insert)

    async def update(self, number: int, outcome: Outcome) -> None:
        await recording(partial(self._rows.update, number, outcome))

    async def insert_member(self, order: Order, outcome: Outcome, batch: int, step: int) -> int:
        """The number of a render of a batch that waits from now on, and is on the disk."""

        def insert() -> int:
            with self._room(expected([MEMBER_BYTES])):
                return self._rows.insert_member(order, outcome, batch, step)

        return await recording(insert)

    def members(self) -> dict[str, tuple[int, int]]:
        """By the ids of renders of batches that have not ended: the batch's number, and the step. Not for an event
        loop."""
        return self._rows.members()

    def ended_members(self) -> list[EndedMember]:
        """The ended renders of all batches. Not for an event loop."""
        return self._rows.ended_members()

    def picture_size(self, id: str) -> int:
        """The bytes of a render's pictures on the disk."""
        return self._files.size(id)

    async def insert_batch(
        self, order: BatchOrder, body: bytes, uses: AllowedUses, key: IdempotencyKey | None
    ) -> int:
        """The number of a batch that is on the disk from now on; see BatchRows."""

        def insert() -> int:
            with self._room(expected([order.bytes])):
                return self.batches.insert(order, body, uses, key)

        return await recording(insert)

    async def forget_batch(self, number: int, ids: Collection[str]) -> None:
        """Delete a batch, its renders, which have these ids, and their pictures."""
        await recording(partial(self.batches.forget, number))
        for id in ids:
            await self._on_disk(partial(self._files.delete, id), _pool(self._files.size(id)))

    async def document(self, number: int) -> bytes:
        """The folded document, patched where the render has a patch, or is one of a batch."""
        if (of_batch := await recording(partial(self._rows.step, number))) is not None:
            return await packing(partial(document_of_step, *of_batch))
        document, patch = await recording(partial(self._rows.document, number))
        return document if patch is None else await packing(partial(patched, document, patch))

    async def keyed(self, owner: str, key: str) -> tuple[str, StoredRender] | None:
        """The digest and the render of a key that was taken lately, also where the render is gone."""
        return await recording(partial(self._rows.keyed, owner, key))

    async def write(self, id: str, kind: Kind, restore: Restore, owner: str = "") -> None:
        """Store a picture in the place of the one before it. Turns go round the owners."""
        pool = _pool(restore.saved.nbytes)
        await self._on_disk(partial(self._files.write, id, kind, restore), pool, owner)

    async def read(self, id: str, kind: Kind, task: int) -> Restore | None:
        """A picture for a task; None where there is none, or it is damaged."""

        def read() -> Restore | None:
            try:
                return self._files.read(id, kind, task)
            except FileNotFoundError:
                return None
            except DamagedPicture as error:
                log.error("a stored picture is damaged", {"id": id[:6], "kind": kind, "error": error})
                return None

        large = self._files.size(id) > LARGE
        return await self._on_disk(read, reading_large_pictures if large else saving_pictures)

    def read_now(self, id: str, kind: Kind, task: int) -> Restore:
        """As `read`, in this thread. Raises OSError, DamagedPicture."""
        return self._files.read(id, kind, task)

    async def free(self, last: list[Restore]) -> None:
        """Forget a picture, to which the list has the last reference: unmapping a gigabyte takes 0.2 s."""
        await _pool(sum(each.saved.nbytes for each in last))(last.clear)

    async def delete(self, id: str, kind: Kind) -> None:
        await self._on_disk(partial(self._files.delete, id, kind), _pool(self._files.size(id)))

    async def forget(self, stored: Collection[tuple[int, str]]) -> None:
        """Delete all but the ids of renders, which are given by number and id."""
        await recording(partial(self._rows.forget, [number for number, _ in stored]))
        for _, id in stored:
            await self._on_disk(partial(self._files.delete, id), _pool(self._files.size(id)))

    async def _on_disk(self, work: Callable[[], T], pool: Pool, caller: str = "") -> T:
        try:
            return await pool(work, caller)
        except ServiceError:
            raise
        except OSError as error:
            log.error("could not reach a stored picture", {"error": error})
            raise Unavailable(f"The picture can't be stored: {trouble(error, self._folder)}.", RETRY_S) from None


def _pool(size: int) -> Pool:
    """The thread that writes and deletes pictures of that many bytes."""
    return saving_large_pictures if size > LARGE else saving_pictures
