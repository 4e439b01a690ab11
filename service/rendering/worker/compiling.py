"""The helper process that compiles: `python -m service.rendering.worker.compiling DESCRIPTOR --parent PID`.

A process of its own with its own context: what it compiles the renderer loads from the driver's disk cache.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import socket

from service.rendering import link
from service.rendering.worker.compiler import Compiled
from service.rendering.worker.lifeline import end_with

IDLE_S = 600.0  # then it ends, and gives back what the driver and its compiler hold (some 100 MB)
SPARE_IDLE_S = 5.0  # ... where kernels come seldom


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m service.rendering.worker.compiling")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("--parent", type=int, required=True)
    parser.add_argument("--device", type=int)
    parser.add_argument("--spare", action="store_true", help="only while nobody else wants the processor")
    arguments = parser.parse_args()
    if arguments.spare:
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if not end_with(arguments.parent):
        return 0
    from gpu.ahead import Ahead
    from gpu.errors import GpuError

    with socket.socket(fileno=arguments.descriptor) as end:
        try:
            ahead = Ahead(arguments.device)
            while select.select([end], [], [], SPARE_IDLE_S if arguments.spare else IDLE_S)[0]:
                recipe = link.receive(end, wait=True)
                try:
                    link.send(end, Compiled(*ahead.compile(recipe)))
                except GpuError as error:  # the renderer meets it too, and says it to whom it concerns
                    link.send(end, Compiled(0.0, True, str(error)))
        except (link.Closed, GpuError):
            pass
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
