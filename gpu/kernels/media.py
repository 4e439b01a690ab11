"""Media that fill a scene's bodies, and the space around them."""

from __future__ import annotations

import numpy as np

from gpu.arrays import SceneArrays
from gpu.kernels.deltas import transmits
from gpu.layout.models import WALKING, of


def fills(scene: SceneArrays) -> bool:
    """True if something absorbs, scatters or shines along the way, besides what materials absorb, or some body has a
    priority."""
    return len(scene.bodies) > 0


def walks(scene: SceneArrays) -> bool:
    """True if light walks under a surface, once it has a `subsurface`."""
    m = scene.materials
    given = of(m, WALKING) & (m["subsurface"] > 0) & (m["subsurface_radius"] > 0).any(axis=1)
    return bool((given & (m["thin_walled"] == 0)).any())


def scatters(scene: SceneArrays) -> bool:
    return bool((scene.bodies["scattering"] > 0).any()) or walks(scene) or bool(_clouded(scene).any())


def _clouded(scene: SceneArrays) -> np.ndarray:
    """Materials that scatter behind their surface."""
    m = scene.materials
    out: np.ndarray = _absorbing(scene) & (m["scatter_color"] > 0).any(axis=1)
    return out


def _absorbing(scene: SceneArrays) -> np.ndarray:
    m = scene.materials
    out: np.ndarray = transmits(m) & (m["thin_walled"] == 0) & (m["attenuation_distance"] > 0)
    return out


def glows(scene: SceneArrays) -> bool:
    return bool((scene.bodies["emission"] > 0).any())


def ranks(scene: SceneArrays) -> bool:
    """True if some bodies give way to others."""
    return bool((scene.bodies["priority"] != 0).any())


def attenuates(scene: SceneArrays) -> bool:
    """True if light is lost along the way."""
    return bool(_absorbing(scene).any()) or fills(scene) or walks(scene)
