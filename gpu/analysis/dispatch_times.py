"""Times of dispatches of chosen sizes, without what chooses them: the floor and the slope of a device."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, NamedTuple

from gpu import context as contexts
from gpu.picture.schedule import work_groups

if TYPE_CHECKING:
    from gpu.picture.picture import Picture


class DispatchTime(NamedTuple):
    """Seconds by the clock until the device had finished, and by the device itself."""

    wall_s: float
    device_s: float


def dispatch_time(picture: Picture, rows: int, samples: int) -> DispatchTime:
    """A dispatch of `samples` samples for each pixel of the picture's first `rows` rows."""
    passes, width = picture._passes, picture.settings.width
    dispatcher = picture._dispatcher
    dispatcher.bind()
    query = picture.context.query(time=True)
    tile = (0, 0, width, rows)
    began = time.perf_counter()
    with query:
        passes._trace(picture._sums.total, tile, tile[:2], tile[2:], 0, samples, work_groups(width, rows))
    contexts.finish(picture.context)
    wall_s = time.perf_counter() - began
    return DispatchTime(wall_s, query.elapsed / 1e9)
