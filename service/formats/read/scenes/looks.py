"""How a document's materials look from far: enough to meter a scene and to find its lamps."""

from __future__ import annotations

from typing import Any

from service.colorimetry import LUMINANCE
from service.formats.surface.open_pbr import NITS

TEXTURE = 0.3  # the assumed mean of an image
BLACKEST, WHITEST = 0.04, 0.9  # reflectances: black plastic shines, and nothing reflects everything


def is_clear(material: dict[str, Any]) -> bool:
    """True if light may pass."""
    passes = bool(material.get("transmission")) or bool(material.get("transmission_weight"))
    return passes or "alpha" in material or "geometry_opacity" in material


def albedo(material: dict[str, Any]) -> float:
    """0 of an unlit surface."""
    if material["type"] == "diffuse":
        return 0.0
    return min(max(_mean(material.get("base_color", 1.0)), BLACKEST), WHITEST)


def emission(material: dict[str, Any]) -> float:
    """The luminance of its radiance."""
    own = NITS * float(material.get("emission_luminance", 0.0)) * _mean(material.get("emission_color", 1.0))
    return own + _mean(material.get("emission", 0.0))


def _mean(value: Any) -> float:
    """The luminance of a colour of a document."""
    if isinstance(value, dict):
        return TEXTURE * _mean(value.get("factor", 1.0))
    return float(LUMINANCE @ value) if isinstance(value, list | tuple) else float(value)
