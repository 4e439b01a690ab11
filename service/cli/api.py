"""A server, as the command line asks it: the package `sunbox`, whose errors end the command."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from service.cli import BadInput, Failed, health
from service.cli.configuration import configuration

if TYPE_CHECKING:
    from sunbox import Client, SunboxError

TIMEOUT_S = 600.0  # longest wait for a byte; event streams send a comment every 15 s
RETRIES = 8  # a minute: a server that is restarted is asked again


@contextmanager
def server(url: str | None) -> Iterator[Client]:
    """The server at an address; without one that of this environment: SUNBOX_HOST and SUNBOX_PORT, and its first
    SUNBOX_API_KEY. What it refuses is raised as BadInput, what it cannot do, or where it is not there, as Failed."""
    from sunbox import Client, Refused, SunboxError

    config = configuration()
    address = url or f"http://{_authority(config.host)}:{config.port}"
    try:
        client = Client(address, config.api_key[0] if config.api_key else "", TIMEOUT_S, RETRIES)
    except ValueError:
        raise BadInput(f"--server {url!r}: is not an address such as http://127.0.0.1:8000") from None
    try:
        with client:
            yield client
    except Refused as error:
        raise BadInput(*lines_of(error)) from None
    except SunboxError as error:
        raise Failed(*lines_of(error)) from None


def _authority(host: str) -> str:
    reachable = health.reachable(host)
    return f"[{reachable}]" if ":" in reachable else reachable


def lines_of(error: SunboxError) -> list[str]:
    """What is wrong, a line for each field."""
    title = f"{error.title}: " if error.title else ""
    return [f"{pointer or '/'}: {detail}" for pointer, detail in error.errors] or [f"{title}{error.detail}"]
