"""The tables that kernels look up, as textures: of the energy that lobes lose, and of films."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.device.uploads import Textures
from gpu.kernels import features
from gpu.layout import bindings
from gpu.tables import energy, film


def needed(flags: Container[str]) -> list[str]:
    """The names of the tables that kernels with these flags look up."""
    return ["energy"] * features.needs_tables(flags) + ["film"] * ("HAS_FILM" in flags)


def upload(context: Any, name: str) -> Textures:
    """The tables of that name, by unit, linear and clamped."""
    return _film(context) if name == "film" else _energy(context)


def _energy(context: Any) -> Textures:
    """The tables of `energy`: their first axes are folded into the third.

    The index of refraction of stretched lobes is folded into the second: a driver need support only 2 048 layers.
    """
    out = Textures()
    for name, unit in bindings.ENERGY_TEXTURES.items():
        table = getattr(energy.tables(), name)
        if name == "stretched":
            etas, aspects, steps, azimuths, cosines, _ = table.shape
            table = np.moveaxis(table, 0, 2).reshape(aspects * steps, etas * azimuths, cosines, -1)
        channels = 1 if name == "sheen" else table.shape[-1]
        height, width = table.shape[-3:-1] if channels > 1 else table.shape[-2:]
        size = (width, height, table.size // (width * height * channels))
        texture = context.texture3d(size, channels, np.ascontiguousarray(table), dtype="f4")
        texture.filter = (context.LINEAR, context.LINEAR)
        texture.repeat_x = texture.repeat_y = texture.repeat_z = False
        out[unit] = texture
    return out


def _film(context: Any) -> Textures:
    zetas, paths = film.SHAPE
    texture = contexts.texture(context, (paths, zetas), 4, "f4", film.table())
    texture.filter = (context.LINEAR, context.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return Textures({bindings.FILM_TEXTURE: texture})


class Tables:
    """The tables of a context whose kernels belong to no scene; each is uploaded when a kernel first needs it."""

    def __init__(self, context: Any) -> None:
        self._context = context
        self._uploaded: dict[str, Textures] = {}

    def textures(self, flags: Container[str]) -> dict[int, Any]:
        """Those that kernels with these flags look up, by unit."""
        out: dict[int, Any] = {}
        for name in needed(flags):
            if name not in self._uploaded:
                self._uploaded[name] = upload(self._context, name)
            out |= self._uploaded[name]
        return out

    def release(self) -> None:
        for textures in self._uploaded.values():
            textures.release()
