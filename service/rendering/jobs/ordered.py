"""What was asked for with a render, and what became of it so far."""

from __future__ import annotations

from service.quality import ResolvedSettings
from service.rendering.jobs.store.record import Order, Outcome, State


class Ordered:
    """The order of a render, which never changes, and its outcome."""

    waits = False  # for memory or a renderer, which was logged

    def __init__(self, order: Order, outcome: Outcome) -> None:
        self.order = order
        self.outcome = outcome

    @property
    def id(self) -> str:
        return self.order.id

    @property
    def owner(self) -> str:
        return self.order.owner

    @property
    def priority(self) -> int:
        return self.order.priority

    @property
    def state(self) -> State:
        return self.outcome.state

    @property
    def settings(self) -> ResolvedSettings:
        return self.order.settings
