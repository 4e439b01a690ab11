"""Lists of renders, a page at a time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

from service.server.renders.render import Render
from service.server.renders.store.record import State


@dataclass(frozen=True)
class Page:
    """Renders, the newest first, and whether there are more."""

    renders: list[Render]
    more: bool


def page(
    newest_first: Iterable[Render], owner: str, label: str | None, state: State | None, limit: int, last: int | None
) -> Page:
    """Those of an owner, of that label and state, whose number is below `last`; none of a batch. For any thread."""
    fits = (
        job
        for job in newest_first
        if job.owner == owner
        and job.batch is None
        and (last is None or job.number < last)
        and label in (None, job.order.label)
        and state in (None, job.state)
    )
    found = list(islice(fits, limit))
    return Page(found, more=len(found) == limit and next(fits, None) is not None)
