"""What every child does that parses strangers' files or texts: how it begins, and how it works on one of them."""

from __future__ import annotations

import fcntl
import importlib
import json
import os
import socket
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict

from service.system.confined.limits import bound, confine, unbind
from service.system.confined.rights import renounce


def begin(niceness: int, modules: Iterable[str] = ()) -> socket.socket:
    """The socket to the parent, whose descriptor is the child's first argument. The child has given up all rights
    that it does not need, and has sent the parent their list. Before, while it could open files, it has imported
    `modules`.
    """
    link = socket.socket(fileno=int(sys.argv[1]))
    for name in modules:
        importlib.import_module(name)
    link.sendmsg([json.dumps(asdict(renounce(confine(niceness)))).encode()])
    return link


@contextmanager
def bounded(link: socket.socket, memory: int, seconds: float) -> Iterator[None]:
    """A context in which the child may take no more than this many bytes beyond what it has and seconds of processor
    time, and which ends with the parent."""
    try:
        bound(memory, seconds)
        # A signal when the parent hangs up, which ends the process by default, even inside a library's loop.
        fcntl.fcntl(link, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(link, fcntl.F_SETFL, fcntl.fcntl(link, fcntl.F_GETFL) | os.O_ASYNC)
        yield
    finally:
        fcntl.fcntl(link, fcntl.F_SETFL, fcntl.fcntl(link, fcntl.F_GETFL) & ~os.O_ASYNC)
        unbind()
