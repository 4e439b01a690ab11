"""Where the slow work of the server is done, so that neither the event loop nor each other waits for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")

_PACKING = ThreadPoolExecutor(2, "packing")  # parsing and packing scenes: seconds for the largest
_ENCODING = ThreadPoolExecutor(2, "encoding")  # pictures to JPEG and the like: milliseconds, and somebody looks


async def packing(work: Callable[[], T]) -> T:
    return await asyncio.get_running_loop().run_in_executor(_PACKING, work)


async def encoding(work: Callable[[], T]) -> T:
    return await asyncio.get_running_loop().run_in_executor(_ENCODING, work)
