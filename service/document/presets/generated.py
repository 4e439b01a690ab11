"""The assets that the presets use, made on demand: nothing binary is kept in the repository."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache

from service.document.presets import (
    armchair,
    bottle,
    candle,
    car_panel,
    cloth,
    cyclorama,
    disney_charts,
    glassware,
    knot,
    orange,
    shader_ball,
    skies,
    studio,
    tree,
    watch,
)

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
    "night-studio": studio.night_studio,
    "tumbler": glassware.tumbler,
    "whisky": glassware.whisky,
    "water-glass": glassware.water_glass,
    "water": glassware.water,
    "ice": glassware.ice,
    "wax": candle.wax,
    "flame": candle.flame,
    "flame-foot": candle.flame_foot,
    "plate": candle.plate,
    "linen-cloth": cloth.linen_cloth,
    "linen-weave": cloth.linen_weave,
    "perfume-bottle": bottle.bottle,
    "perfume-collar": bottle.collar,
    "perfume-cap": bottle.cap,
    "orange": orange.orange,
    "orange-half": orange.half,
    "orange-slice": orange.slice_,
    "orange-leaf": orange.leaf,
    "car-door": car_panel.door,
    "car-fender": car_panel.fender,
    "chair-cushion": armchair.cushion,
    "chair-back": armchair.back,
    "chair-buttons": armchair.buttons,
    "chair-arm": armchair.arm,
    "chair-pillow": armchair.pillow,
    "chair-leg": armchair.leg,
    "bare-tree": tree.bare_tree,
    "disney-parameters-labels": disney_charts.parameter_labels,
    "disney-grid-labels": disney_charts.grid_labels,
    "watch-case": watch.case,
    "watch-markers": watch.markers,
    "watch-hands": watch.hands,
    "watch-crown": watch.crown,
    "watch-strap": watch.strap,
    "watch-stitches": watch.stitches,
}


@cache
def asset(name: str) -> bytes:
    return ASSETS[name]()


@cache
def asset_id(name: str) -> str:
    return f"sha256:{hashlib.sha256(asset(name)).hexdigest()}"
