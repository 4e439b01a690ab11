"""The renderer's process, from its first line to its last."""

from __future__ import annotations

import argparse
import contextlib
import gc
import logging
import os
import signal
import socket
from pathlib import Path

from service.ipc import channel
from service.ipc.heartbeat import Heartbeat
from service.ipc.messages import Ready, Unable
from service.system import logs
from service.system.confined import hide
from service.system.cpu import raise_process_niceness
from service.system.garbage import loaded
from service.system.lifeline import end_with
from service.system.shared_memory import return_freed

OOM_SCORE = 500  # of 1000, more than the server's: a cluster may have raised that one, and only root may lower it
DEVICES = Path("/dev/dri")
FREED = 8 << 20  # bytes from which on a freed block returns to the machine: more than a picture's that is read

log = logging.getLogger("service.worker")  # __name__ is __main__ here


def main() -> int:
    gc.disable()  # until all that this process works with is loaded
    parser = argparse.ArgumentParser(prog="python -m service.worker")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("heartbeat", type=int)
    parser.add_argument("--memory", type=int, help="bytes that may be held on the device")
    parser.add_argument("--host-memory", type=int, help="the same where the device's memory is the machine's")
    parser.add_argument("--checkpoint", type=float, required=True, help="seconds between two of a render")
    parser.add_argument("--ahead", required=True, help="which kernels nobody has to wait for: off, some or all")
    parser.add_argument("--nice", type=int, required=True, help="steps of niceness above the server's")
    parser.add_argument("--device", type=int)
    parser.add_argument("--software", action="store_true", help="on the processor, whatever its device's number is")
    parser.add_argument("--name", default="0", help="the renderer's id, for the log")
    parser.add_argument("--lifeline", type=int, help="a pipe, whose other end the server holds")
    parser.add_argument("--log-level", type=int, default=logging.WARNING)
    parser.add_argument("--server", type=int, required=True, help="its process id")
    arguments = parser.parse_args()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the server, which ends this process in good order
    if not end_with(arguments.server):
        return 0
    _offer_itself()
    hide()  # not before: its /proc folder is root's from then on
    logs.configure(os.environ.get("SUNBOX_LOG_FORMAT", "console"), logging.getLevelName(arguments.log_level))
    logs.always(renderer=arguments.name)
    return_freed(FREED)  # a scene's arrays and, of a software renderer, its textures
    try:
        code = _serve(socket.socket(fileno=arguments.descriptor), arguments)
    except channel.Closed:
        code = 0
    except BaseException:
        log.exception("the renderer failed")
        code = 1
    # At once, its end of the link with it: on a busy machine an interpreter takes seconds to tidy up, and a process
    # that is killed meanwhile cannot report any more that it ended by itself.
    logging.shutdown()
    os._exit(code)


def _serve(end: socket.socket, arguments: argparse.Namespace) -> int:
    from gpu import GpuError, Renderer, denoise, software_device
    from gpu.analysis.device_limits import free_memory
    from service.worker.device.memory import UNLIMITED, default_limit
    from service.worker.loop import Loop

    # NVIDIA's own cache, for what Sunbox does not keep: off for root else, and off where its folder is not there yet.
    os.environ.setdefault("__GL_SHADER_DISK_CACHE", "1")
    if folder := os.environ.get("__GL_SHADER_DISK_CACHE_PATH"):
        with contextlib.suppress(OSError):
            Path(folder).mkdir(parents=True, exist_ok=True)
    try:
        device = software_device() if arguments.software else arguments.device
        renderer = Renderer(device)
    except GpuError as error:
        channel.send(end, Unable(str(error)))
        return 1
    # Not earlier: beside a dozen busy programs, starting at this priority took 30 s instead of 3 s.
    raise_process_niceness(os.getpriority(os.PRIO_PROCESS, 0) + arguments.nice)
    limit = arguments.memory or default_limit(renderer.info, free_memory(renderer.context), arguments.host_memory)
    # Beside a GPU the denoiser's own process knows: the loop says it later.
    place = denoise.PROCESSOR if renderer.info["software"] else ""
    facts = {"denoiser": denoise.version(place), "memory_limit": None if limit == UNLIMITED else limit}
    channel.send(end, Ready({**renderer.info, **facts}))
    log.info("started", {"driver": renderer.info.get("renderer")})
    if renderer.info["software"] and (closed := closed_gpus(DEVICES)):
        log.warning(
            "the processor renders, as this user may not use the GPU",
            {"device": closed[0], "group": closed[0].group()},
        )
    loaded()
    heartbeat, lifeline = Heartbeat(arguments.heartbeat), arguments.lifeline
    Loop(end, renderer, heartbeat, limit, device, arguments.checkpoint, lifeline, arguments.ahead).run()
    return 0


def closed_gpus(folder: Path) -> list[Path]:
    """The GPUs' devices that this user may not open: they are their group's, mostly `render`."""
    return [device for device in sorted(folder.glob("renderD*")) if not os.access(device, os.R_OK | os.W_OK)]


def _offer_itself() -> None:
    """Where memory runs out the kernel shall take this process, which is replaced, and not the server."""
    score = Path("/proc/self/oom_score_adj")
    with contextlib.suppress(OSError):
        score.write_text(str(min(1000, int(score.read_text()) + OOM_SCORE)))


if __name__ == "__main__":
    raise SystemExit(main())
