"""The image's HEALTHCHECK: `python -m service.cli.health` ends with 0 if the server in this container lives.

The address is that of the server's command line, `serve --host --port`, or else SUNBOX_HOST and SUNBOX_PORT.
"""

from __future__ import annotations

import argparse
import http.client
import ipaddress
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from service.cli import CommandError, configuration

TIMEOUT_S = 4.0


def main() -> int:
    serving = next(_commands(), ["serve"])
    options = argparse.ArgumentParser()
    options.add_argument("--host")
    options.add_argument("--port", type=int)
    arguments, _ = options.parse_known_args(serving)
    try:
        config = configuration(host=arguments.host, port=arguments.port)
        connection = http.client.HTTPConnection(reachable(config.host), config.port, timeout=TIMEOUT_S)
        # The server accepts this host name always.
        connection.request("GET", "/healthz", headers={"Host": "localhost"})
        status = connection.getresponse().status
    except (CommandError, OSError, http.client.HTTPException) as error:
        print(f"no answer: {error}", file=sys.stderr)
        return 1
    return 0 if status == 200 else 1


def _commands() -> Iterator[list[str]]:
    """The command line, from `serve` on, of each `sunbox serve` among the visible processes."""
    for process in sorted(Path("/proc").glob("[0-9]*"), key=lambda path: int(path.name)):
        try:
            words = os.fsdecode((process / "cmdline").read_bytes()).split("\0")[:-1]
        except OSError:  # a process that has ended, or of another user
            continue
        for index, word in enumerate(words[1:], 1):
            if word == "serve" and os.path.basename(words[index - 1]) in ("sunbox", "service.cli"):
                yield words[index:]


def reachable(host: str) -> str:
    """The address to connect to: loopback for a server that listens on all addresses."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if not address.is_unspecified:
        return host
    return "127.0.0.1" if address.version == 4 else "::1"


if __name__ == "__main__":
    raise SystemExit(main())
