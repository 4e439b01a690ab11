"""The assets that the presets use, made on demand: nothing binary is kept in the repository."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache

from service.document.presets import computed, environments, metalwork, plants, subjects, tabletop, upholstery

ASSETS: dict[str, Callable[[], bytes]] = {
    "studio": environments.studio,
    "softbox": environments.softbox,
    "clear-sky": environments.clear_sky,
    "sunset": environments.sunset,
    "overcast": environments.overcast,
    "torus-knot": subjects.torus_knot,
    "shader-ball": subjects.shader_ball,
    "shader-ball-stand": subjects.stand,
    "cyclorama": subjects.cyclorama,
    "night-studio": environments.night_studio,
    "tumbler": tabletop.tumbler,
    "whisky": tabletop.whisky,
    "water-glass": tabletop.water_glass,
    "water": tabletop.water,
    "ice": tabletop.ice,
    "wax": tabletop.wax,
    "flame": tabletop.flame,
    "flame-foot": tabletop.flame_foot,
    "plate": tabletop.plate,
    "linen-cloth": upholstery.linen_cloth,
    "linen-weave": upholstery.linen_weave,
    "perfume-bottle": tabletop.bottle,
    "perfume-collar": tabletop.collar,
    "perfume-cap": tabletop.cap,
    "orange": plants.orange,
    "orange-half": plants.half,
    "orange-slice": plants.slice_,
    "orange-leaf": plants.leaf,
    "car-door": metalwork.door,
    "car-fender": metalwork.fender,
    "chair-cushion": upholstery.cushion,
    "chair-back": upholstery.back,
    "chair-buttons": upholstery.buttons,
    "chair-arm": upholstery.arm,
    "chair-pillow": upholstery.pillow,
    "chair-leg": upholstery.leg,
    "bare-tree": plants.bare_tree,
    "disney-parameters-labels": computed.parameter_labels,
    "disney-grid-labels": computed.grid_labels,
    "watch-case": metalwork.case,
    "watch-markers": metalwork.markers,
    "watch-hands": metalwork.hands,
    "watch-crown": metalwork.crown,
    "watch-strap": metalwork.strap,
    "watch-stitches": metalwork.stitches,
}


@cache
def asset(name: str) -> bytes:
    return ASSETS[name]()


@cache
def asset_id(name: str) -> str:
    return f"sha256:{hashlib.sha256(asset(name)).hexdigest()}"
