"""UsdPreviewSurface, as parameters of `principled` [OpenUSD, "UsdPreviewSurface Specification" 2.6]."""

from __future__ import annotations

import math
from typing import Any

from service.formats.read.usd.material_reader import Reader
from service.formats.read.usd.networks import Node

LARGEST_IOR = 4.0
DULL = 0.36  # the greatest reflectance head-on that an index up to 4 gives


def preview_surface(read: Reader) -> dict[str, Any]:
    """The material's document."""
    surface, notes = read.surface, read.notes
    out: dict[str, Any] = {
        "type": "principled",
        "base_color": read.color("diffuseColor", (0.18,) * 3),
        "roughness": read.scalar("roughness", 0.5),
    }
    ior = surface.number("ior", 1.5)
    if not 1 <= ior <= LARGEST_IOR:
        nearest = min(max(ior, 1.0), LARGEST_IOR)
        notes.add(surface.at("ior"), f"an ior of {ior:g} is not supported; {nearest:g} is used instead")
        ior = nearest
    if surface.number("useSpecularWorkflow", 0):
        _specular(read, out)
    else:
        out["metallic"] = read.scalar("metallic", 0.0)
        if ior != 1.5:
            out["ior"] = ior
    coat = read.scalar("clearcoat", 0.0)
    if coat:
        out["clearcoat"] = coat
        out["clearcoat_roughness"] = read.scalar("clearcoatRoughness", 0.01)
    emission = read.color("emissiveColor", (0.0,) * 3, 1e20)
    if isinstance(emission, dict) or max(emission):
        out["emission"] = emission
    normal = read.normal("normal")
    if normal is not None:
        out["normal_map"] = normal
    _opacity(read, out)
    for name, what in (("displacement", "displacement"), ("occlusion", "occlusion, which is traced instead")):
        if isinstance(surface.input(name), Node):
            notes.add(surface.at(name), f"{what} is not read")
    return out


def _specular(read: Reader, out: dict[str, Any]) -> None:
    """A reflectance head-on of one's own: an index of refraction and a tint, or a metal where it is too high."""
    color = read.color("specularColor", (0.0,) * 3)
    place = read.surface.at("specularColor")
    if isinstance(color, dict):
        read.notes.add(place, "a texture of specularColor is not supported; a reflectance of 0.04 is used instead")
        return
    f0 = max(color)
    if f0 >= DULL:
        if isinstance(out["base_color"], dict) or max(out["base_color"]) > 0:
            read.notes.add(place, "a surface that reflects so much is shown as a metal, without diffuseColor")
        out["base_color"], out["metallic"] = color, 1.0
        return
    root = math.sqrt(f0)
    out["ior"] = (1 + root) / (1 - root)
    if f0 and min(color) < f0:
        out["specular_color"] = [value / f0 for value in color]


def _opacity(read: Reader, out: dict[str, Any]) -> None:
    surface = read.surface
    opacity, threshold = read.scalar("opacity", 1.0), surface.number("opacityThreshold", 0.0)
    if opacity == 1:
        return
    out["alpha"] = opacity
    if threshold > 0:
        out["alpha_cutoff"] = min(threshold, 1.0)
    elif surface.value("opacityMode", "transparent") == "transparent":
        read.notes.add(
            surface.at("opacity"), "what is transparent fades with its reflections, as if it were not there"
        )
