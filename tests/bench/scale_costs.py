"""What the model of a divided render is fed with: costs that are measured here."""

from __future__ import annotations

import math
import socket
import statistics
import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from gpu import Band, Renderer, RenderSettings, border_after
from gpu.analysis.metering import noise_meter_off
from service.bench.scenes import BenchAssets
from service.document import parse_scene, presets
from service.pack import pack
from service.worker.division.ledger import MOST_BYTES
from tests.bench.scale_model import Costs

if TYPE_CHECKING:
    from gpu import Picture

SIZE = 512
ROWS = 64  # of a band
BLOCKS = 3  # of which the median counts
MESSAGES = 40


def measure(renderer: Renderer, scene: str, size: int = SIZE) -> Costs:
    """The costs of a built-in scene for a renderer with one core: on a software renderer seconds are processor time,
    which others on the machine hardly change."""
    clock = time.process_time if renderer.info["software"] else time.perf_counter
    arrays = pack(parse_scene(presets.get("scenes", scene)), BenchAssets()).arrays
    loaded = renderer.load(arrays)
    with noise_meter_off():  # the model counts its samples by itself
        costs = _measured(renderer.picture(loaded, RenderSettings(size, size)), size, clock)
    loaded.release()
    return costs


def _measured(picture: Picture, size: int, clock: Callable[[], float]) -> Costs:
    picture.trace(math.inf, border_after(0))
    began = clock()
    picture.trace(math.inf, 32)
    sample_s = (clock() - began) / (32 - border_after(0)) / size**2
    picture.reset()
    picture.trace(math.inf, border_after(0))
    write, merge = [], []
    for _ in range(BLOCKS):
        first = picture.samples
        end = border_after(first)
        picture.block.share(0, end)
        bands = [Band(first, end - first, top, min(ROWS, size - top)) for top in range(0, size, ROWS)]
        values = np.zeros((ROWS, size, 12), np.float32)
        values[..., 11] = end - first
        began = clock()
        for band in bands:
            picture.block.write_band(band, values[: band.rows])
        write.append((clock() - began) / size**2)
        began = clock()
        picture.block.complete()
        while picture.samples < end:
            picture.trace(math.inf, end)
        merge.append((clock() - began) / size**2)
    picture.release()
    return Costs(sample_s, statistics.median(write), statistics.median(merge))


def forwarding_s() -> float:
    """Seconds in which a process takes a result from a socket and hands it to another one."""
    payload = bytes(MOST_BYTES)
    (giver, taker), (handing, receiver) = socket.socketpair(), socket.socketpair()

    def give() -> None:
        for _ in range(MESSAGES):
            giver.sendall(payload)

    def receive() -> None:
        left = MESSAGES * MOST_BYTES
        buffer = bytearray(1 << 20)
        while left:
            left -= receiver.recv_into(buffer)

    threads = [threading.Thread(target=work, daemon=True) for work in (give, receive)]
    for thread in threads:
        thread.start()
    message = bytearray(MOST_BYTES)
    began = time.thread_time()
    for _ in range(MESSAGES):
        view = memoryview(message)
        while view:
            view = view[taker.recv_into(view) :]
        handing.sendall(message)
    took = (time.thread_time() - began) / MESSAGES
    for thread in threads:
        thread.join()
    for each in (giver, taker, handing, receiver):
        each.close()
    return took
