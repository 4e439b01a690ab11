"""The server's side: joins a cluster through the gateway, and starts renderers there."""

from __future__ import annotations

import importlib.util
import logging
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, cast

from service.ipc import channel
from service.ipc.server_end import Channel
from service.renderers.local.process import ROOT, Cause, NoPlace, Start
from service.renderers.ray import control
from service.renderers.ray.control import Join, Joined, Open, ProcessEnded, Refused, Release
from service.renderers.ray.joining import INSTALL, CannotJoin
from service.renderers.ray.renderers import described
from service.system import logs
from service.system.child_processes import inherited_environment
from service.system.executors import tending

JOIN_S = 80.0  # for the gateway to start and to join, which it gives up itself much earlier
SILENT_S = 20.0  # without a sign of life, one of which comes every second
FAREWELL_S = 6.0  # for the gateway to end the actors, and a cluster of its own
RESTS = "The renderer has been given back to the Ray cluster until there is more work."

# Nothing is reported to Ray's makers. Actors begin at the server's own priority, as renderers of this machine do.
RAY = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_worker_niceness": "0"}

log = logging.getLogger(__name__)


@dataclass
class _Gateway:
    process: subprocess.Popen[bytes]
    control: socket.socket
    heard: float  # when it gave its last sign of life, or is expected to give the first one


class Cluster:
    """A Ray cluster, joined when it is made. When the gateway is lost, with it or alone, the next renderer starts it
    again."""

    def __init__(self, address: str, renderers: int | None, gpu: bool, options: dict[str, Any], **join: Any) -> None:
        """`options`: of a renderer's process, on whichever node. Raises CannotJoin; waits for some seconds."""
        if importlib.util.find_spec("ray") is None:
            raise CannotJoin(INSTALL)
        self.options = options
        self._join = Join(address, renderers, gpu, options, **join)
        self._resting: dict[int, socket.socket | None] = {}  # the ends of their channels, once they are asked for
        self._gateway: _Gateway | None = _start(self._join)
        try:
            self.joined = _answered(self._gateway)
        except CannotJoin:
            self._end(1.0)
            raise
        self._join = replace(self._join, renderers=self.joined.renderers)
        if not self.joined.local:  # it stays with the same one, also where `auto` would find another
            self._join = replace(self._join, address=self.joined.address)

    @property
    def device(self) -> str:
        """A renderer's share of its node, as /v1/info says it."""
        return described(self.joined.resources)

    def release_node(self, number: int) -> None:
        """Give what a renderer has back to the cluster, until it is woken; meanwhile it says that it waits."""
        if number not in self._resting:
            self._resting[number] = None
            with suppress(OSError):
                if self._gateway is not None:
                    control.send(self._gateway.control, Release(number))

    def wake(self, number: int) -> None:
        """Ask the cluster for a renderer that rests; Ray's autoscaler may have to start a node for it."""
        end = self._resting.pop(number, None)
        if end is not None:
            with end:
                self._carry(number, end)

    def watch(self, excused: bool) -> None:
        """Kill a gateway that hangs or was stopped, so that another takes its place; to be called now and then."""
        gateway, now = self._gateway, time.monotonic()
        if gateway is None:
            return
        with suppress(OSError):  # there is nothing more to read
            while gateway.control.recv(control.MOST_BYTES):
                gateway.heard = now
        if excused:
            gateway.heard = max(gateway.heard, now)
        if now - gateway.heard > SILENT_S:
            log.error("the gateway to the Ray cluster hung", {"silent_s": round(now - gateway.heard)})
            self._end(0.0)

    @property
    def resting(self) -> Collection[int]:
        """The numbers of the renderers that rest."""
        return self._resting.keys()

    def starter(self, number: int) -> Start:
        """The `Start` of a supervisor's renderer; `number` counts the renderers from 0."""
        return partial(ClusterProcess, partial(self._carry, number), self.watch)

    def _carry(self, number: int, end: socket.socket) -> int:
        """Have the gateway carry the messages of a renderer; `end` is of its channel. The gateway's process id."""
        if number in self._resting:
            if (before := self._resting[number]) is not None:
                before.close()
            self._resting[number] = end.dup()
            channel.send(end, NoPlace(RESTS, needed=False))
            return 0 if self._gateway is None else self._gateway.process.pid
        if self._gateway is not None:
            with suppress(OSError):
                return self._ask(self._gateway, number, end)
            self._end(0.0)
        self._gateway = _start(self._join)
        return self._ask(self._gateway, number, end)

    async def close(self) -> None:
        for end in self._resting.values():
            if end is not None:
                end.close()
        self._resting.clear()
        await tending(partial(self._end, FAREWELL_S))

    def _ask(self, gateway: _Gateway, number: int, end: socket.socket) -> int:
        control.send(gateway.control, Open(number), end.fileno())
        return gateway.process.pid

    def _end(self, patience_s: float) -> None:
        gateway, self._gateway = self._gateway, None
        if gateway is None:
            return
        gateway.control.close()
        try:
            gateway.process.wait(patience_s)
        except subprocess.TimeoutExpired:
            gateway.process.kill()
            gateway.process.wait()


def _start(ask: Join) -> _Gateway:
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    command = [sys.executable, "-m", "service.renderers.ray.gateway", str(theirs.fileno())]
    with theirs:
        process = subprocess.Popen(
            [*command, "--log-level", str(logs.level())],
            pass_fds=[theirs.fileno()],
            cwd=ROOT,
            env={**RAY, **_token_mode(), **inherited_environment("RAY_AUTH_TOKEN")},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            process_group=0,
        )
    control.send(ours, ask)
    ours.setblocking(False)
    return _Gateway(process, ours, time.monotonic() + JOIN_S)


def _token_mode() -> dict[str, str]:
    """Ray's mode of authentication by the rule of `ray start`, which Ray does not apply to those who join a cluster:
    where a token is there, it is used, unless RAY_AUTH_MODE says otherwise."""
    named = any(name in os.environ for name in ("RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH"))
    return {"RAY_AUTH_MODE": "token"} if named or (Path.home() / ".ray" / "auth_token").exists() else {}


def _answered(gateway: _Gateway) -> Joined:
    gateway.control.settimeout(JOIN_S)
    try:
        received = control.receive(gateway.control)
    except TimeoutError:
        raise CannotJoin(
            f"SUNBOX_RAY: the process that joins the Ray cluster gave no answer in {JOIN_S:g} s"
        ) from None
    gateway.control.setblocking(False)  # a few bytes now and then: only a gateway that hangs has no room for them
    if received is None:
        raise CannotJoin("SUNBOX_RAY: the process that joins the Ray cluster ended at once; the log says more")
    message = received[0]
    if isinstance(message, Refused):
        raise CannotJoin(message.detail)
    assert isinstance(message, Joined)
    return message


class ClusterProcess:
    """Fulfils `RendererProcess`: the gateway has the other end of its channel, and carries messages to an actor.

    The actor watches over the renderer's process and says why it ended; Ray watches over the actor and its node.
    """

    def __init__(
        self,
        carry: Callable[[socket.socket], int],
        watch: Callable[[bool], None],
        received: Callable[[Any], None],
        lost: Callable[[], None],
        lifeline: int | None = None,
    ) -> None:
        """`carry` has the gateway carry the messages of a socket, and returns the gateway's process id; `watch` looks
        after the gateway."""
        self._watch_gateway = watch
        self.began = time.monotonic()
        self.ready = False
        self.unable = False
        self._received, self._ended = received, ProcessEnded("node lost")
        ours, theirs = channel.pair()
        try:
            self.id = carry(theirs)
        finally:
            theirs.close()
        self.link = Channel(ours, self._heard, lost)

    @property
    def lived_s(self) -> float:
        return time.monotonic() - self.began

    @property
    def task(self) -> int:
        return self._ended.task

    def watch(self, excused: bool = False) -> None:
        """Look after the gateway; the actor watches the renderer."""
        self._watch_gateway(excused)

    async def end(self, patience_s: float) -> Cause:
        self.link.close()
        return cast(Cause, self._ended.cause)

    def _heard(self, message: Any) -> None:
        if isinstance(message, ProcessEnded):
            self._ended = message
        else:
            self._received(message)
