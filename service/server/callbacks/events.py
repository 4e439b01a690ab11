"""What is told of an end: some hundred bytes, with ids by which the rest can be asked for."""

from __future__ import annotations

import json
import time
from typing import Any

from service.server.renders.status import iso
from service.server.storage.callback_rows import Kind

OF_RENDERS = (
    "id", "state", "label", "created", "started", "ended", "reason", "samples", "noise", "elapsed_s", "problem",
)  # fmt: skip
OF_BATCHES = ("id", "state", "label", "created", "counts")
LONGEST = 500  # characters of each part of a problem: the rest is in the render's status


def event(of: Kind, status: dict[str, Any]) -> str:
    """The body of a callback, as JSON: `type` and `timestamp` are those of Standard Webhooks."""
    names = OF_RENDERS if of == "render" else OF_BATCHES
    data: dict[str, Any] = {name: status[name] for name in names if name in status}
    if (problem := data.get("problem")) is not None:
        parts = (name for name in ("type", "title", "detail") if name in problem)
        data["problem"] = {name: str(problem[name])[:LONGEST] for name in parts}
    body = {"type": f"{of}.ended", "timestamp": iso(time.time()), "data": data}
    return json.dumps(body, ensure_ascii=False, separators=(",", ":"))
