"""One renderer of the cluster as its supervisor sees it."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from typing import Any, cast

from service.ipc import channel
from service.ipc.server_end import Channel
from service.renderers.local.process import Cause
from service.renderers.ray.control import ProcessEnded


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
