"""Small renders and pictures for a store."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from service.document import parse_settings
from service.document.quality import resolve
from service.ipc.messages import Progress, Restore, SavedPicture
from service.server.renders.store.record import Order

SETTINGS = resolve(parse_settings({"width": 4, "height": 4}, "", None))
PROGRESS = Progress(8, 0.25, 1.5, None)
DOCUMENT = zlib.compress(b"{}")


def picture(value: int = 1, reason: Any = None) -> Restore:
    buffers = [np.full(size, value, np.uint8) for size in (1000, 0, 64)]
    return Restore(7, 1, SavedPicture(8, (2, 1, 0), buffers), reason, PROGRESS)


def order(id: str, owner: str = "") -> Order:
    return Order(id, owner, SETTINGS, "label", 2, 100.0, len(DOCUMENT))
