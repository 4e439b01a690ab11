"""Denoises pictures: `python -m service.worker.helpers.denoise_main DESCRIPTOR --parent PID`.

A process of its own, so that neither the denoiser's seconds nor its misfortunes are the render loop's. It works on
the GPU that renders, or on the processor: then it is nicer than the renderer, so that no first frame waits for it.
"""

from __future__ import annotations

import argparse
import os
import select
import socket
from collections.abc import Callable

from gpu import GpuError, denoise, devices
from gpu.oidn import GpuFilter
from service.ipc import channel
from service.system.confined import hide
from service.system.lifeline import end_with
from service.worker.helpers.denoise_client import DenoiseRequest, DenoiseResult, Located

NICENESS = 5  # steps above the renderer's: where both want the processor, this one gets a quarter of it
IDLE_S = 300.0  # then it ends, and gives back what the library holds (some 200 MB)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m service.worker.helpers.denoise_main")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("--parent", type=int, required=True)
    parser.add_argument("--gpu", type=int, help="EGL's number of the device that renders, where that is a GPU")
    arguments = parser.parse_args()
    if not end_with(arguments.parent):
        return 0
    hide()
    with socket.socket(fileno=arguments.descriptor) as end:
        try:
            denoiser = Denoiser(arguments.gpu, lambda located: channel.send(end, located))
            while select.select([end], [], [], IDLE_S)[0]:
                channel.send(end, denoiser.deliver(channel.receive(end, wait=True)))
        except channel.Closed:
            pass
    return 0


class Denoiser:
    """Denoises on the GPU that renders, and from the first failure there on the processor."""

    def __init__(self, gpu: int | None, say: Callable[[Located], None]) -> None:
        """Load the library before the first picture comes; where that fails, the answer to that one says why.

        `gpu`: EGL's number of the device that renders, None for the processor. Of a GPU `say` gets where pictures are
        denoised, once that is known and where it changes.
        """
        self._say = say
        self._gpu: GpuFilter | None = None
        if gpu is None:
            self._use_processor()
            return
        try:
            self._gpu = GpuFilter(devices()[gpu])
        except (GpuError, ImportError, OSError, RuntimeError, AttributeError) as error:  # the last: an older pyoidn
            self._leave_gpu(error)
        else:
            say(Located(self._gpu.name))

    def deliver(self, order: DenoiseRequest) -> DenoiseResult:
        given = order.color, order.albedo, order.normal, order.fine
        if self._gpu is not None:
            try:
                return DenoiseResult(denoise.denoise(*given, by=self._gpu))
            except RuntimeError as error:  # its memory is short, perhaps
                self._gpu.close()
                self._gpu = None
                self._leave_gpu(error)
        if (detail := denoise.missing()) is not None:
            return DenoiseResult(None, detail, missing=True)
        try:
            return DenoiseResult(denoise.denoise(*given))
        except (RuntimeError, MemoryError) as error:
            return DenoiseResult(None, f"Open Image Denoise failed: {error}")

    def _leave_gpu(self, error: Exception) -> None:
        self._use_processor()
        self._say(Located(denoise.PROCESSOR, str(error)))

    def _use_processor(self) -> None:
        os.nice(NICENESS)
        denoise.missing()


if __name__ == "__main__":
    raise SystemExit(main())
