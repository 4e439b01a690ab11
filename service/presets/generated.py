"""The assets that the presets use, made on demand: nothing binary is kept in the repository."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache

from service.presets import cyclorama, knot, shader_ball, skies, studio

ASSETS: dict[str, Callable[[], bytes]] = {
    "studio": studio.studio,
    "softbox": studio.softbox,
    "clear-sky": skies.clear_sky,
    "sunset": skies.sunset,
    "overcast": skies.overcast,
    "torus-knot": knot.torus_knot,
    "shader-ball": shader_ball.shader_ball,
    "shader-ball-stand": shader_ball.stand,
    "cyclorama": cyclorama.cyclorama,
}


@cache
def asset(name: str) -> bytes:
    return ASSETS[name]()


@cache
def asset_id(name: str) -> str:
    return f"sha256:{hashlib.sha256(asset(name)).hexdigest()}"
