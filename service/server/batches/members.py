"""The renders of a batch, made one after the other: what its axes leave unchanged is validated and packed once."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from typing import Any

from service.document.document import Parsed
from service.document.quality import ResolvedSettings, resolve
from service.document.settings import Settings
from service.document.text import most_bytes
from service.pack import PackCache, Packed
from service.problems import InvalidDocument, ServiceError, TooLarge
from service.server.batches.batch import Batch, member_id
from service.server.renders.render import Render
from service.server.renders.store.record import Order
from service.server.requests.batch_request import variations
from service.server.requests.request_parser import LONGEST_LABEL, folded, unfolded
from service.server.requests.request_reader import RequestReader
from service.system.executors import packing

# A new render of an order: its document where no store has it, its packed scene where there is one.
NewJob = Callable[[Order, bytes | None, Packed | None], Render]


class Members:
    """For one task of the event loop; the work is done in threads."""

    def __init__(self, batch: Batch, body: bytes, reader: RequestReader, new_job: NewJob) -> None:
        """`body`: the folded `{scene, settings}` that varies, which counts as the work at hand's for as long as this
        lives. For a thread. Raises TooLarge, TooManyRequests, Unavailable."""
        self._batch, self._reader, self._new_job = batch, reader, new_job
        text = unfolded(body)
        reader.memory.hold(reader.batch_memory, self, most_bytes(text) + most_bytes(batch.order.axes))
        self._variations = variations(json.loads(text), batch.order.axes)
        self._cache = PackCache(budget=reader.caches)
        self._before: Parsed | None = None

    async def check(self) -> None:
        """Raise what packing the first render's scene raises."""
        await packing(self._check, self._batch.client)

    async def job(self, step: int, stored: bool) -> Render:
        """A render that is ready to be queued. One whose scene cannot be packed says why when its turn comes."""
        document, settings, packed = await packing(partial(self._packed, step), self._batch.client)
        order, label = self._batch.order, self._variations.name(step)[:LONGEST_LABEL]
        member = Order(
            member_id(self._batch.id, step), order.owner, settings, label, order.priority, order.created_at
        )
        kept = None if stored else await packing(partial(folded, document["scene"]), self._batch.client)
        try:
            return self._new_job(member, kept, packed)
        except TooLarge:
            return self._new_job(member, kept, None)

    def _check(self) -> None:
        document = self._variations.document(0)
        scene = self._reader.scene(document["scene"])
        self._before = Parsed(document["scene"], scene)
        self._reader.pack(scene, self._cache, owner=self._batch.owner)

    def _packed(self, step: int) -> tuple[dict[str, Any], ResolvedSettings, Packed | None]:
        document, settings = self._variations.document(step), resolve(Settings())
        try:
            settings = self._reader.settings(document["settings"])
            scene = self._reader.scene(document["scene"], self._before)
            self._before = Parsed(document["scene"], scene)
            return document, settings, self._reader.pack(scene, self._cache, owner=self._batch.owner)
        except (InvalidDocument, ServiceError):
            return document, settings, None
