"""What was asked for with a render, what became of it so far, and what it needs to begin."""

from __future__ import annotations

import logging

from service.problems import ServiceError, Unavailable
from service.quality import ResolvedSettings
from service.renderers.protocol import Renderers
from service.renders.recorder import Recorder
from service.renders.scene import RenderScene
from service.renders.store.record import Order, Outcome, State

log = logging.getLogger(__name__)


class Ordered:
    """The order of a render, which never changes, its outcome, and how it waits in line."""

    recorder: Recorder | None = None
    number = 0  # rises in the order of arrival
    place = 0  # among those of its owner that wait
    waits = False  # for memory, the disk or a renderer, which was logged

    def __init__(
        self, renderers: Renderers, order: Order, outcome: Outcome, scene: RenderScene, document: bytes | None
    ) -> None:
        self.renderers = renderers
        self.order = order
        self.outcome = outcome
        self.began = outcome.state == "running"  # when the server ended before, or it gave way to another one
        self._scene = scene
        self._memory = scene.memory
        self._document = document

    @property
    def id(self) -> str:
        return self.order.id

    @property
    def owner(self) -> str:
        return self.order.owner

    @property
    def client(self) -> str:
        """Who shares the slots with others: the owner; without keys each render is its own client."""
        return self.order.owner or self.order.id

    @property
    def priority(self) -> int:
        return self.order.priority

    @property
    def state(self) -> State:
        return self.outcome.state

    @property
    def elapsed_s(self) -> float:
        """For how long it has been rendered."""
        return self.outcome.progress.elapsed_s

    @property
    def settings(self) -> ResolvedSettings:
        return self.order.settings

    @property
    def lasting(self) -> bool:
        """Whether it is stored: it outlives the server, and may be interrupted."""
        return self.recorder is not None

    @property
    def memory_share(self) -> float:
        """The part of SUNBOX_MEMORY that it takes while it runs."""
        return self._memory.share

    @property
    def lacks(self) -> int:
        """The bytes of memory that are missing for it to begin."""
        return self._scene.lacks

    def set_aside(self) -> None:
        """Forget the packed scene, which is packed again when its turn comes."""
        self._scene.set_aside()

    def forget_document(self) -> None:
        """The store has it from now on."""
        self._document = None

    async def document(self) -> bytes:
        """The folded document. Raises Unavailable, Internal."""
        if self._document is not None:
            return self._document
        assert self.recorder is not None
        return await self.recorder.store.document(self.recorder.number)

    def reserve(self) -> bool:
        """Count the memory that it is known to need, before it runs. False where it has to wait for memory or for a
        renderer; one that is not stored does not wait, and says so to its client when it runs."""
        try:
            if self.renderers.hopeless:
                raise Unavailable("There is no renderer.")
            self._scene.reserve()
        except Unavailable as error:
            if self.recorder is not None:
                self.wait(error)
                return False
        return True

    def wait(self, reason: ServiceError) -> None:
        """Note that something is missing for it to begin. It is tried again every few seconds, and logged once."""
        if not self.waits:
            log.warning("a render has to wait id=%s reason=%s", self.id[:6], reason)
        self.waits = True
