"""Messages between the server and the gateway beside the renderers' own."""

from __future__ import annotations

import pickle
import socket
from dataclasses import dataclass
from typing import Any

MOST_BYTES = 64 * 1024  # of a control message


@dataclass(frozen=True)
class Join:
    """Asks the gateway to join a cluster. It is told once, before all else."""

    address: str  # as in SUNBOX_RAY
    renderers: int | None  # SUNBOX_RAY_RENDERERS
    gpu: bool  # SUNBOX_REQUIRE_GPU
    options: dict[str, Any]  # of a renderer's process: the fields of Options that are for any node
    nodes_s: float = 15.0  # for nodes to join a head that was started just before, and renders nothing itself
    patience_s: float = 60.0  # for a head that does not answer, or a cluster of our own to start on a busy machine


@dataclass(frozen=True)
class Joined:
    """The gateway has joined a cluster, in which there are to be so many renderers."""

    address: str  # HOST:PORT of the cluster's head
    local: bool  # it was started for this server
    renderers: int
    resources: dict[str, float]  # that each of them declares
    room: int  # for so many of them, as the cluster is now


@dataclass(frozen=True)
class Refused:
    """The gateway can't join, and ends."""

    detail: str


@dataclass(frozen=True)
class Alive:
    """The gateway says now and then that it is neither hung nor stopped."""


@dataclass(frozen=True)
class Open:
    """Asks for a renderer; the end of its supervisor's channel goes along."""

    number: int


@dataclass(frozen=True)
class Release:
    """Asks to give what a renderer has back to the cluster; it can be opened again."""

    number: int


# --- on a renderer's own channel, to its process object in the server ---


@dataclass(frozen=True)
class ProcessEnded:
    """The last message: why the renderer ended, and the task that it worked on (0: none)."""

    cause: str
    task: int = 0


def send(end: socket.socket, message: object, descriptor: int | None = None) -> None:
    """Raises OSError where the other end is gone."""
    socket.send_fds(end, [pickle.dumps(message)], [] if descriptor is None else [descriptor])


def receive(end: socket.socket) -> tuple[Any, int | None] | None:
    """The next message and the descriptor that came with it; None when the other end is gone."""
    try:
        data, descriptors, _, _ = socket.recv_fds(end, MOST_BYTES, 1)
    except ConnectionError:
        return None
    return (pickle.loads(data), descriptors[0] if descriptors else None) if data else None
