"""The process that speaks to Ray: `python -m service.renderers.ray.gateway DESCRIPTOR`, started by the server.

It ends when the server closes its socket, however that comes about. Its actors end with it, and so does a cluster
that it has started.
"""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import signal
import socket
import sys
import threading
from collections import deque
from contextlib import suppress
from typing import Any

from service.ipc import channel
from service.renderers.local.process import NoPlace
from service.renderers.ray import control
from service.renderers.ray.actor import Renderer
from service.renderers.ray.carriage import Scenes
from service.renderers.ray.control import Alive, Join, Joined, Open, Refused, Release
from service.renderers.ray.joining import CannotJoin, close_token_file, has_token, join, survey
from service.renderers.ray.lane import Lane
from service.renderers.ray.renderers import described
from service.system import logs
from service.system.background import Background

DRAINS_S = 2.0  # between two looks for nodes that are about to go
SILENT = "SUNBOX_RAY: the Ray cluster ({}) gave no answer in {:g} s"
WITHOUT_TOKEN = (
    "the Ray cluster has no token: whoever reaches its ports can run programs on its nodes, and in this server; make "
    "one with `ray get-auth-token --generate` and put it on all nodes (docs/scaling.md)"
)
ALIVE_S = 1.0  # between two signs of life
FAREWELL_S = 5.0  # for renderers to end by themselves

_written = deque[str](maxlen=1)  # by Ray, to stdout or stderr

log = logging.getLogger("service.renderers.ray.gateway")  # __name__ is __main__ here


class Gateway:
    """Fulfils `lane.Actors`, and opens a lane for each renderer that the server asks for."""

    def __init__(self, end: socket.socket, ask: Join, joined: Joined) -> None:
        self.scenes, self.options = Scenes(), ask.options
        self.threads = None if "GPU" in joined.resources else int(joined.resources["CPU"])
        self._end, self._joined = end, joined
        self._handles: dict[int, Any] = {}
        self._lanes: dict[asyncio.Task[None], Lane] = {}
        self._over = asyncio.Event()

    async def serve(self) -> None:
        """Return when the server is gone, or has closed its socket."""
        loop = asyncio.get_running_loop()
        loop.add_reader(self._end, self._readable)
        chores = Background()
        chores.start("watch for nodes that are drained", self._watch_drains())
        chores.start("signs of life", self._say_alive())
        await self._over.wait()
        await chores.close()
        for lane in self._lanes.values():
            lane.close()
        if self._lanes:
            await asyncio.wait(self._lanes, timeout=FAREWELL_S)

    def actor(self, number: int, anew: bool = False) -> Any:
        import ray

        if anew or number not in self._handles:
            declared = self._joined.resources
            made = ray.remote(Renderer).options(
                num_gpus=declared.get("GPU", 0), num_cpus=declared.get("CPU", 0), max_restarts=-1
            )
            self._handles[number] = made.remote()
        return self._handles[number]

    def placing(self, number: int) -> str:
        if _address(self._handles[number]).get("IPAddress"):
            return ""
        needed = described(self._joined.resources)
        return f"The Ray cluster at {self._joined.address} has no node with {needed} free for a renderer."

    def restart(self, number: int) -> None:
        import ray

        with suppress(Exception):  # it has gone meanwhile, or was released
            ray.kill(self._handles[number], no_restart=False)

    def _readable(self) -> None:
        received = control.receive(self._end)
        if received is None:
            asyncio.get_running_loop().remove_reader(self._end)
            self._over.set()
            return
        message, descriptor = received
        if isinstance(message, Open) and descriptor is not None:
            lane = Lane(message.number, socket.socket(fileno=descriptor), self)
            before = [running for running, other in self._lanes.items() if other.number == lane.number]
            running = asyncio.get_running_loop().create_task(_after(before, lane))
            self._lanes[running] = lane
            running.add_done_callback(self._finished)
        elif isinstance(message, Release):
            self._release(message.number)

    def _release(self, number: int) -> None:
        import ray

        for lane in self._lanes.values():
            if lane.number == number:
                lane.release()
        if (handle := self._handles.pop(number, None)) is not None:
            ray.kill(handle)

    def _finished(self, running: asyncio.Task[None]) -> None:
        lane = self._lanes.pop(running)
        if not running.cancelled() and (error := running.exception()) is not None:
            log.error("a renderer's lane failed", {"renderer": lane.number}, exc_info=error)

    async def _say_alive(self) -> None:
        while True:
            with suppress(OSError):  # the server is gone, or reads nothing just now
                control.send(self._end, Alive())
            await asyncio.sleep(ALIVE_S)

    async def _watch_drains(self) -> None:
        """Have renderers leave the nodes that Ray is about to take away."""
        while True:
            await asyncio.sleep(DRAINS_S)
            with suppress(Exception):
                draining = await asyncio.to_thread(_draining)
                for lane in list(self._lanes.values()) if draining else ():
                    address = await asyncio.to_thread(_address, self._handles[lane.number])
                    if address.get("NodeID") in draining:
                        lane.leave()


async def _after(before: list[asyncio.Task[None]], lane: Lane) -> None:
    """Run a lane once those have ended that had its actor."""
    if before:
        await asyncio.wait(before)
    await lane.run()


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m service.renderers.ray.gateway")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("--log-level", type=int, default=logging.WARNING)
    arguments = parser.parse_args()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the server, which ends this process in good order
    sys.stderr = os.fdopen(os.dup(2), "w", buffering=1)  # for the loggers only
    logs.configure(os.environ.get("SUNBOX_LOG_FORMAT", "console"), logging.getLevelName(arguments.log_level))
    sys.stderr = sys.__stderr__
    _keep_others_from_writing()
    os.umask(0o077)  # what Ray writes, its token first of all, is this user's alone
    close_token_file()
    end = socket.socket(fileno=arguments.descriptor)
    received = control.receive(end)
    if received is None:
        return 0
    ask: Join = received[0]
    refusal = threading.Timer(ask.patience_s, _refuse, [end, SILENT.format(ask.address, ask.patience_s)])
    refusal.daemon = True
    refusal.start()
    try:
        local = join(ask)
    except CannotJoin as error:
        _refuse(end, str(error))
    finally:
        refusal.cancel()
    joined = survey(ask, local)
    with suppress(OSError):
        control.send(end, joined)
    _written.clear()
    log.info("joined", {"address": joined.address, "renderers": joined.renderers})
    if not has_token():
        log.warning(WITHOUT_TOKEN, {"address": joined.address})
    end.setblocking(False)
    asyncio.run(Gateway(end, ask, joined).serve())
    _leave()
    return 0


def _refuse(end: socket.socket, detail: str) -> None:
    """Say why there is no cluster, to the server and to the renderers that it has asked for, and end this process."""
    detail = "; Ray wrote: ".join([detail, *_written])
    with suppress(OSError):
        control.send(end, Refused(detail))
        end.settimeout(1.0)
        while (received := control.receive(end)) is not None:
            if received[1] is not None:
                with socket.socket(fileno=received[1]) as lane, suppress(channel.Closed):
                    channel.send(lane, NoPlace(detail))
    logging.shutdown()
    os._exit(1)


def _leave() -> None:
    """End the actors, and the cluster where it is this server's own."""
    import ray

    last_resort = threading.Timer(FAREWELL_S, os._exit, [0])
    last_resort.daemon = True
    last_resort.start()
    ray.shutdown()
    logging.shutdown()
    os._exit(0)


def _draining() -> set[str]:
    """The ids of nodes that are about to go. Ray has no public name for it that needs no dashboard."""
    from ray._private.state import state

    return set(state.get_draining_nodes())


def _address(handle: Any) -> dict[str, Any]:
    """Where an actor is: NodeID, and IPAddress, which is empty as long as Ray has no process for it."""
    from ray._private.state import actors

    found: dict[str, Any] = actors(handle._actor_id.hex()).get("Address", {})
    return found


def _keep_others_from_writing() -> None:
    """Log what Ray's own code writes to stdout and stderr line by line, and for those who want to know everything."""
    reading, writing = os.pipe()
    for descriptor in (1, 2):
        os.dup2(writing, descriptor)
    os.close(writing)

    def read() -> None:
        with open(reading, errors="replace") as lines:
            for line in lines:
                _written.append(line.strip()[:300])
                log.debug("Ray wrote to its output", {"line": line.strip()})

    threading.Thread(target=read, name="ray-output", daemon=True).start()


if __name__ == "__main__":
    raise SystemExit(main())
