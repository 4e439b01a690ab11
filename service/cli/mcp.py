"""`sunbox mcp`: tools for agents. They are the client's, whose own command `sunbox-mcp` is the same."""

from __future__ import annotations

import argparse

from sunbox.mcp import serve


def run(arguments: argparse.Namespace) -> int:
    return serve(arguments.url)
