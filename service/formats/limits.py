"""The bounds on assets, as the configuration sets them."""

from __future__ import annotations

from typing import Protocol

from service.formats.types import AssetLimits


class HasLimits(Protocol):
    """The part of the configuration that concerns assets."""

    @property
    def max_triangles(self) -> int: ...

    @property
    def max_texels(self) -> int: ...

    @property
    def max_asset(self) -> int: ...

    @property
    def parse_seconds(self) -> float: ...

    @property
    def parse_memory(self) -> int: ...


def asset_limits(config: HasLimits | None) -> AssetLimits:
    if config is None:
        return AssetLimits()
    return AssetLimits(
        max_triangles=config.max_triangles,
        max_texels=config.max_texels,
        max_file=config.max_asset,
        seconds=config.parse_seconds,
        memory=config.parse_memory,
    )
