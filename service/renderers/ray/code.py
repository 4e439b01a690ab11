"""The code that a node runs: other code would give other bits, or not understand a message."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).parents[3]
# All that decides about a picture's bits and about what messages mean.
FOLDERS = ("gpu", "shaders", "service/ipc", "service/renderers", "service/worker")
SUFFIXES = {".py", ".glsl", ".comp"}


@cache
def version() -> str:
    """The version of Sunbox with a digest of its code: a checkout keeps its version while its code changes."""
    digest = hashlib.sha256()
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in SUFFIXES:
                digest.update(f"{path.relative_to(ROOT)}\0".encode() + path.read_bytes() + b"\0")
    return f"{metadata.version('sunbox')}+{digest.hexdigest()[:12]}"


def difference(host: str, there: str) -> str | None:
    """The error about a node with another version than this process has; None where they are the same."""
    if there == version():
        return None
    return (
        f"SUNBOX_RAY: host {host} has Sunbox {there}, and this server has {version()}. "
        "Install the same Sunbox on all nodes of the Ray cluster, and restart Ray there."
    )
