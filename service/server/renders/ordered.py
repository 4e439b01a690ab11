"""What a render is: what was asked for, where it stands, its scene, and where it is stored."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from functools import partial
from typing import Any, Protocol, runtime_checkable
from weakref import WeakValueDictionary

from service.problems import ServiceError, Unavailable
from service.renderers.protocol import Renderers
from service.server.renders.followers import Changes
from service.server.renders.life import Life
from service.server.renders.recorder import Recorder
from service.server.renders.scene import RenderScene
from service.server.renders.store.record import End, Order, Outcome, State
from service.server.requests.request_parser import patched
from service.system.executors import packing

log = logging.getLogger(__name__)


@runtime_checkable
class InBatch(Protocol):
    """A batch, as its renders and their queue see it: it is kept, and makes room, as a whole."""

    id: str
    owner: str
    client: str  # whose share of the disk its document counts towards
    bytes: int  # of that document
    number: int  # of its row in the store
    ended_at: float  # by the monotonic clock
    counts_as: int  # of the renders of its owner that are kept
    gone: bool  # whether it made room for others, or was deleted
    jobs: dict[int, Any]  # by step: those that are under way, or not on the disk
    shown: WeakValueDictionary[int, Any]  # by step: those on the disk that somebody looks at

    @property
    def size(self) -> int: ...

    @property
    def ids(self) -> Iterator[str]: ...

    def add(self, step: int, render: Any) -> None: ...

    def add_ended(self, step: int, state: End, ended_at: float, size: int) -> None: ...

    def ended(self, render: Any) -> None: ...

    def settle(self, render: Any) -> None: ...

    def job(self, step: int) -> Any: ...


class KeepsPictures(Protocol):
    """Where pictures that a renderer has are registered, so that they make room when memory is needed."""

    def add(self, render: Any) -> None:
        """Somebody has looked at a render's picture, or it has ended."""


class Ordered:
    """A render as it stands in line. What a renderer has of it is for Rendering and PictureViewer."""

    recorder: Recorder | None = None
    number = 0  # rises in the order of arrival
    place = 0  # among those of its owner that wait
    counts_as = 1  # of the renders of its owner that are kept
    waits = False  # for memory, the disk or a renderer, which was logged
    batch: InBatch | None = None  # which has the document, and learns of the end
    resting: KeepsPictures | None = None  # None: whoever asked for it releases it
    task: int | None = None  # which renders it, and shows it when it has ended; None: no renderer has it

    def __init__(self, renderers: Renderers, order: Order, life: Life, scene: RenderScene) -> None:
        self.renderers, self.order, self.life, self.scene = renderers, order, life, scene
        self.id, self.owner, self.priority = order.id, order.owner, order.priority
        self.client = order.owner or order.id  # who shares the slots with others: without keys each is its own client
        self.finished = life.finished
        self.changes = Changes[Any]()

    @property
    def state(self) -> State:
        """As callers see it."""
        return self.outcome.state

    @property
    def outcome(self) -> Outcome:
        return self.life.outcome

    @outcome.setter
    def outcome(self, outcome: Outcome) -> None:
        self.life.outcome = outcome

    @property
    def began(self) -> bool:
        """Whether it was running when the server ended, or gave way: it goes on before its owner's others begin."""
        return self.life.began

    @property
    def ended_at(self) -> float:
        """By the monotonic clock, once it has ended."""
        return self.life.ended_at

    @property
    def elapsed_s(self) -> float:
        """For how long it has been rendered."""
        return self.outcome.progress.elapsed_s

    @property
    def lasting(self) -> bool:
        """Whether it is stored: it outlives the server, and may be interrupted."""
        return self.recorder is not None

    @property
    def memory_share(self) -> float:
        """The part of SUNBOX_MEMORY that it takes while it runs."""
        return self.scene.memory.share

    @property
    def lacks(self) -> int:
        """The bytes of memory that are missing for it to begin."""
        return self.scene.lacks

    def set_aside(self) -> None:
        """It has to wait: its scene is packed again when its turn comes, where that takes too much memory."""
        self.scene.set_aside()

    async def document(self) -> bytes:
        """The folded document. Raises Unavailable, Internal."""
        document, patch = self.scene.document, self.scene.patch
        if document is not None:
            return document if patch is None else await packing(partial(patched, document, patch))
        assert self.recorder is not None
        return await self.recorder.store.document(self.recorder.number)

    def reserve(self) -> bool:
        """Count the memory that it is known to need, before it runs. False where it has to wait for memory or for a
        renderer; one that is not stored does not wait, and says so to its client when it runs."""
        try:
            if self.renderers.hopeless:
                raise Unavailable("There is no renderer.")
            self.scene.reserve()
        except Unavailable as error:
            if self.recorder is not None:
                self.wait(error)
                return False
        return True

    def wait(self, reason: ServiceError) -> None:
        """Note that something is missing for it to begin. It is tried again every few seconds, and logged once."""
        if not self.waits:
            log.warning("a render has to wait", {"id": self.id[:6], "reason": reason})
        self.waits = True

    def wake(self) -> None:
        """Its status has changed."""
        self.changes.tell(self)
