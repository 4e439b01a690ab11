"""Denoises pictures: `python -m service.worker.helpers.denoise_main DESCRIPTOR --parent PID`.

A process of its own, so that neither the denoiser's seconds nor its misfortunes are the render loop's, and nicer than
that, so that nobody's first frame waits for it.
"""

from __future__ import annotations

import argparse
import os
import select
import socket

from service.ipc import channel
from service.system.confined import hide
from service.system.lifeline import end_with
from service.worker.helpers.denoise_client import DenoiseRequest, DenoiseResult

NICENESS = 5  # steps above the renderer's: where both want the processor, this one gets a quarter of it
IDLE_S = 300.0  # then it ends, and gives back what the library holds (some 200 MB)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m service.worker.helpers.denoise_main")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("--parent", type=int, required=True)
    arguments = parser.parse_args()
    if not end_with(arguments.parent):
        return 0
    hide()
    os.nice(NICENESS)
    with socket.socket(fileno=arguments.descriptor) as end:
        _load()
        try:
            while select.select([end], [], [], IDLE_S)[0]:
                channel.send(end, deliver(channel.receive(end, wait=True)))
        except channel.Closed:
            pass
    return 0


def _load() -> None:
    """Load the library before the first picture comes; where that fails, the answer to that one says why."""
    from gpu import denoise

    denoise.missing()


def deliver(order: DenoiseRequest) -> DenoiseResult:
    from gpu import denoise

    if (detail := denoise.missing()) is not None:
        return DenoiseResult(None, detail, missing=True)
    try:
        return DenoiseResult(denoise.denoise(order.color, order.albedo, order.normal, order.fine))
    except (RuntimeError, MemoryError) as error:
        return DenoiseResult(None, f"Open Image Denoise failed: {error}")


if __name__ == "__main__":
    raise SystemExit(main())
