"""`sunbox-mcp [--url URL]`: eight tools for agents, by the Model Context Protocol on stdin and stdout."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from urllib.parse import urlsplit

MISSING = (
    "error: the tools for agents need the official SDK of the Model Context Protocol: "
    "pip install './client[mcp]' in a checkout of Sunbox"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """The exit code. Serves until stdin ends."""
    parser = argparse.ArgumentParser("sunbox-mcp", description="Tools for agents, on stdin and stdout (MCP).")
    add_arguments(parser)
    return serve(parser.parse_args(arguments).url)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = "the server's address (default: SUNBOX_URL, or http://127.0.0.1:8000); SUNBOX_API_KEY is sent to it"
    parser.add_argument("--url", type=_address, metavar="URL", help=text)


def serve(url: str | None) -> int:
    """The exit code."""
    try:
        import mcp.server  # noqa: F401 (the error is about this package, and no other one)
    except ImportError:
        print(MISSING, file=sys.stderr)
        return 1
    from sunbox.agent_tools import agent_server

    try:
        server = agent_server(url)
    except ValueError as error:  # SUNBOX_URL
        print(f"error: {error}", file=sys.stderr)
        return 2
    server.run()
    return 0


def _address(text: str) -> str:
    if urlsplit(text).scheme not in ("http", "https") or not urlsplit(text).netloc:
        raise argparse.ArgumentTypeError(f"{text!r} is not an address such as http://127.0.0.1:8000")
    return text


if __name__ == "__main__":
    sys.exit(main())
