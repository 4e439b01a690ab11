"""One and two processes on the device."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

from service.bench.device.isolated import SPAWN
from tests.bench.device import yielding
from tests.bench.device.part import Options, Row


def rows(options: Options) -> Iterator[Row]:
    for count in (1, 2):
        pools = [SPAWN.Pool(1) for _ in range(count)]
        with ThreadPoolExecutor(count) as threads:
            given = ("", options.device, options.scale)
            asked = [threads.submit(pool.apply, yielding.traced, given) for pool in pools]
            yield {"processes": count, "mpaths_per_s": [one.result()["mpaths_per_s"] for one in asked]}
        for pool in pools:
            pool.terminate()
