"""From the configuration to a server that answers: what can be refused at once is refused first, and the renderers'
processes start before the application is imported, which takes as long as their own start."""

from __future__ import annotations

import ipaddress
import logging
import resource
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace

from service.config import Config, cores, unknown_variables
from service.renderers.local.process import EarlyStart
from service.renderers.pool.devices import missing_device, renderer_specs
from service.renderers.pool.pool import RendererSpec
from service.server.storage.data_lock import FolderInUse, locked
from service.system.confined import hide
from service.system.cpu import set_steps
from service.system.memory import MemoryBudget
from service.system.shared_memory import return_freed

DESCRIPTORS = 65_536
# Python's switch interval: how long a computing thread may delay the event loop after each of its system calls. With
# the default, 5 ms, an answer of ten calls takes 50 ms while a scene is being validated.
SWITCH_S = 0.001
OPEN_TO_ALL = (
    "serving without a key: whoever reaches this address can render, and can read, replace and delete what is saved; "
    "set SUNBOX_API_KEY, or listen on 127.0.0.1 (in a container: publish the port on 127.0.0.1)"
)
CROWDED = (
    "SUNBOX_DEVICES asks for more renderers on the processor than it has cores: together they are slower than one "
    "for each core"
)

log = logging.getLogger(__name__)


def run(config: Config) -> int:
    """Print the address and serve until SIGINT or SIGTERM. Returns the exit code: 1 where it could not start."""
    return_freed()
    hide()
    sys.setswitchinterval(SWITCH_S)
    set_steps(config.nice)
    if unknown := unknown_variables():
        log.warning("these variables are no settings and change nothing", {"names": ",".join(unknown)})
    if (reason := missing_device(config)) is not None:
        log.error("did not start", {"reason": reason})
        return 1
    if config.software_renderers > cores():
        log.warning(CROWDED, {"renderers": config.software_renderers, "cores": cores()})
    most = min(config.max_connections, _take_descriptors() // 2)  # files, scenes and images take others
    try:
        listener = listen(config.host, config.port)
    except OSError as error:
        log.error("could not listen", {"host": config.host, "port": config.port, "error": error.strerror or error})
        return 1
    host = listener.getsockname()[0]
    if not config.api_key and not ipaddress.ip_address(host).is_loopback:
        log.warning(OPEN_TO_ALL, {"host": host})
    try:
        with listener, locked(config.data_dir), _started(config) as places:
            from service.server import app

            return app.serve(config, listener, most, places)
    except FolderInUse as error:
        log.error("did not start", {"reason": error})
        return 1


@contextmanager
def _started(config: Config) -> Iterator[list[RendererSpec]]:
    """The specifications of the renderers, whose processes start now; none where they are on other machines."""
    with ExitStack() as stack:
        places = [] if config.ray is not None else renderer_specs(config, MemoryBudget(config.memory).limit)
        options = (replace(place.options, name=place.place.id) for place in places)
        starts = [stack.enter_context(closing(EarlyStart(each))) for each in options]
        yield [replace(place, start=start) for place, start in zip(places, starts, strict=True)]


def _take_descriptors() -> int:
    """Raise the limit of descriptors as far as the system allows, and return it. Each client, scene and asset takes
    some; a shell's default, 1 024, is made for programs that wait with select().
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = DESCRIPTORS if hard == resource.RLIM_INFINITY else min(hard, DESCRIPTORS)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
        return most
    return DESCRIPTORS if soft == resource.RLIM_INFINITY else soft


BACKLOG = 2048
# TCP keep-alive: a peer that vanished without closing is noticed after two minutes.
PROBE_AFTER_S, PROBE_EVERY_S, PROBES = 60, 15, 4


def listen(host: str, port: int) -> socket.socket:
    """A listening socket whose options each accepted connection inherits. Raises OSError."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.create_server((host, port), family=family, backlog=BACKLOG)
    # asyncio sets TCP_NODELAY only for sockets of a stated protocol. Without it an answer in two writes waits 40 ms
    # for the client's delayed acknowledgement of the first.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, PROBE_AFTER_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, PROBE_EVERY_S)
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPCNT, PROBES)
    return listener
