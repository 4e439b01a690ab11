"""Perfectly specular light of materials, by their own numbers; textures may add to it, or take some away."""

from __future__ import annotations

import numpy as np

from gpu import layout
from gpu.layout.models import COATED, DELTA, TRANSMITTING, of, with_optional

_MATCHED = 1e-4  # an index closer to 1 neither bends nor mirrors
_WEAK = 3e-8  # `specular` that leads to such an index


def transmits(materials: np.ndarray) -> np.ndarray:
    """Materials through which light passes."""
    m = materials
    through = (m["transmission"] > 0) | ((m["thin_walled"] > 0) & (m["diffuse_transmission"] > 0))
    out: np.ndarray = of(m, TRANSMITTING) & through & (m["metallic"] < 1)
    return out


def mirrors(materials: np.ndarray) -> np.ndarray:
    """Materials that only mirror or refract."""
    m = materials
    whole = (m["metallic"] >= 1) | (m["transmission"] >= 1)
    bare = (m["clearcoat"] <= 0) & (m["sheen"] <= 0)
    out: np.ndarray = of(m, DELTA) & (m["roughness"] < layout.LEAST_ROUGHNESS) & whole & bare
    return out


def may_be_specular(materials: np.ndarray) -> np.ndarray:
    """Materials that may have a perfectly specular lobe, beside others or alone."""
    m = materials
    base = of(m, DELTA) & (m["roughness"] < layout.LEAST_ROUGHNESS)
    coat_roughness = m["clearcoat_roughness"]
    smooth_coat = (coat_roughness >= 0) & (coat_roughness < layout.LEAST_ROUGHNESS)
    coat = of(m, COATED) & (m["clearcoat"] > 0) & smooth_coat
    matched = (np.abs(m["ior"] - 1) < _MATCHED) | (m["specular"] < _WEAK)
    out: np.ndarray = base | coat | (transmits(m) & matched)
    return out


def throws_caustics(materials: np.ndarray) -> np.ndarray:
    """Materials whose perfectly specular light is much of what they send on: smooth glass, mirrors, no mere gloss."""
    m = materials
    smooth = (m["roughness"] < layout.LEAST_ROUGHNESS) & (m["roughness"] != np.float32(layout.TEXTURED))
    out: np.ndarray = of(m, DELTA) & smooth & ((m["metallic"] > 0.5) | (transmits(m) & (m["transmission"] > 0.5)))
    return out


def goes_straight(materials: np.ndarray) -> np.ndarray:
    """Materials through whose surfaces light may go straight; shaders/material/material.glsl says why these."""
    m = materials
    matched = (m["specular"] <= 0) | (np.abs(m["ior"] - 1) < _MATCHED)
    thin = m["thin_walled"] > 0
    names = ("roughness", "ior", "specular", "coat_ior", "clearcoat", "clearcoat_roughness")
    given = np.all([m[name] != np.float32(layout.TEXTURED) for name in names], axis=0)
    smooth = matched | (m["roughness"] < layout.LEAST_ROUGHNESS)
    dark = ~(m["emission"] > 0).any(axis=1)
    out: np.ndarray = transmits(m) & given & (thin | (matched & (m["dispersion"] <= 0))) & smooth & dark
    return out


def filmed(materials: np.ndarray) -> np.ndarray:
    """Materials under a thin film, whatever it lies on."""
    m = materials
    out: np.ndarray = of(m, with_optional("film_thickness")) & (m["film_thickness"] > 0) & (m["film_weight"] > 0)
    return out
