"""Scenes as files for other programs."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sunbox import files
from sunbox.transport import Transport


@dataclass(frozen=True)
class Exported:
    """A file's bytes, and what its format has no place for: `[{"pointer": ..., "detail": ...}]`."""

    data: bytes = field(repr=False)
    lost: list[dict[str, Any]]

    def save(self, path: str | Path) -> None:
        Path(path).write_bytes(self.data)


async def export(transport: Transport, scene: Any, format: str) -> Exported:
    """Raises OSError, ValueError, TypeError, SunboxError."""
    body = files.text({"scene": await transport.uploaded(scene), "format": format}).encode()
    answer = await transport.request("POST", "/v1/export", body, {"content-type": "application/json"}, patient=True)
    return Exported(answer.content, json.loads(answer.headers["sunbox-lost"]))
