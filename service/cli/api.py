"""A server, as the command line asks it: the package `sunbox`, whose errors end the command. And a server of this
machine's own, for as long as a command needs one.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from service.cli import BadInput, Failed, configuration, health

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
    """The mistakes, a line for each field."""
    title = f"{error.title}: " if error.title else ""
    return [f"{pointer or '/'}: {detail}" for pointer, detail in error.errors] or [f"{title}{error.detail}"]


ENDS_S = 20.0  # for a server that ends
# Serves until the process of this id ends, however it ends.
PROGRAM = """
import sys
from service.cli.program import main
from service.system.lifeline import end_with
if end_with(int(sys.argv[1])):
    sys.exit(main(["serve", "--host", "127.0.0.1", "--port", "0"]))
"""


@contextmanager
def server_or_local(url: str | None) -> Iterator[Client]:
    """The server at an address, or without one a server that renders here and stores nothing. Raises as `server`."""
    if url is not None:
        with server(url) as client:
            yield client
        return
    with (
        tempfile.TemporaryDirectory(prefix="sunbox-") as folder,
        _local_server(Path(folder)) as address,
        server(address) as client,
    ):
        yield client


@contextmanager
def _local_server(folder: Path) -> Iterator[str]:
    """The address of a server whose data lie in a folder. Ctrl-C is for this process, which ends the server then."""
    environment = {**os.environ, "SUNBOX_DATA_DIR": str(folder / "data"), "SUNBOX_HOST": "127.0.0.1"}
    command = [sys.executable, "-P", "-c", PROGRAM, str(os.getpid())]
    with (folder / "log").open("w+") as said_there:
        process = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=said_there, text=True, start_new_session=True
        )
        try:
            assert process.stdout is not None
            said = process.stdout.readline()
            if "http://" not in said:
                said_there.seek(0)
                raise Failed("no server could be started here", *said_there.read().splitlines()[-3:])
            yield said[said.index("http://") :].strip().rstrip("/")
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(ENDS_S)
            process.kill()
