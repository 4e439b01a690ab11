"""Verdicts: do two documents or pictures differ beyond noise."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from sunbox import files
from sunbox.async_job import AsyncPicture
from sunbox.transport import Transport

ID = re.compile(r"[0-9a-f]{32}|sha256:[0-9a-f]{64}")


@dataclass(frozen=True)
class Region:
    """A rectangle in pixels from the top left in which two pictures differ."""

    x: int
    y: int
    width: int
    height: int
    p_value: float


@dataclass(frozen=True)
class Verdict:
    """`different` is `p_value` < 1 - confidence. The figures have the noise in them: `mean_difference` of b - a and
    `rmse` are of linear luminance, `psnr` (dB, None where the pictures are equal), `flip` and `ssim` of what a screen
    shows. `samples`: those of each pixel of `a` and `b`. `map`: the PNG of the map, where one was asked for."""

    different: bool
    p_value: float
    mean_difference: float
    rmse: float
    psnr: float | None
    flip: float
    ssim: float
    samples: dict[str, int]
    regions: list[Region]
    map: bytes | None = field(default=None, repr=False)


async def compare(
    transport: Transport, a: Any, b: Any, confidence: float, map: str | None, settings: dict[str, Any]
) -> Verdict:
    """Raises OSError, ValueError, TypeError, SunboxError."""
    body = {name: await _side(transport, side, settings, f"/{name}/scene") for name, side in (("a", a), ("b", b))}
    query = "" if map is None else "?" + urlencode({"format": "png", "map": map})
    data = files.text(body | {"confidence": confidence}).encode()
    # The answer comes when the verdict is known, and nothing before it.
    answer = await transport.request(
        "POST", f"/v1/compare{query}", data, {"content-type": "application/json"}, patient=True
    )
    found = answer.json() if map is None else json.loads(answer.headers["sunbox-verdict"])
    known = {name: found[name] for name in Verdict.__dataclass_fields__ if name in found}
    known["regions"] = [Region(**each) for each in found["regions"]]
    return Verdict(**known, map=None if map is None else answer.content)


async def _side(transport: Transport, side: Any, settings: dict[str, Any], pointer: str) -> Any:
    """A document with its settings, or the id of a picture."""
    if isinstance(id := getattr(side, "id", None), str):
        return id
    picture = getattr(side, "_picture", side)  # of the blocking client
    if isinstance(picture, AsyncPicture):  # this process rendered it
        return await transport.upload(await picture.exr(), "picture.exr")
    if isinstance(side, str) and ID.fullmatch(side):
        return side
    if not isinstance(side, dict) and Path(side).suffix.lower() == ".exr":
        return await transport.upload_file(Path(side))
    given: dict[str, Any] = {}
    if isinstance(side, dict) and "scene" in side:
        side, given = side["scene"], dict(side.get("settings") or {})
    return {"scene": await transport.uploaded(side, pointer), "settings": given | settings}
