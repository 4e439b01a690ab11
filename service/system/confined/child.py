"""What every child does that parses strangers' files or texts: how it begins, and how it works on one of them."""

from __future__ import annotations

import importlib
import json
import socket
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict

from service.system.confined.limits import bound, confine, unbind
from service.system.confined.rights import renounce
from service.system.lifeline import end_with_pipe


def begin(modules: Iterable[str] = ()) -> socket.socket:
    """The socket to the parent, whose descriptor is the child's first argument. The second is a pipe's, whose other
    end the parent holds: the child ends with it, even inside a library's loop. The third is its niceness.

    The child has given up all rights that it does not need, and has sent the parent their list. Before, while it
    could open files, it imported `modules`.
    """
    link = socket.socket(fileno=int(sys.argv[1]))
    # Not by a signal from `link`: the one that a message sends may come when the message has been read, and work on
    # it has begun.
    if not end_with_pipe(int(sys.argv[2])):
        sys.exit()
    for name in modules:
        importlib.import_module(name)
    link.sendmsg([json.dumps(asdict(renounce(confine(int(sys.argv[3]))))).encode()])
    return link


@contextmanager
def bounded(memory: int, seconds: float) -> Iterator[None]:
    """A context in which the child may take no more than this many bytes beyond what it has and seconds of processor
    time."""
    try:
        bound(memory, seconds)
        yield
    finally:
        unbind()
