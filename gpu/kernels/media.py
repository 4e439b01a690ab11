"""What fills a scene's bodies, and the space around them."""

from __future__ import annotations

from gpu.arrays import SceneArrays
from gpu.kernels.deltas import transmits


def fills(scene: SceneArrays) -> bool:
    """Whether something absorbs, scatters or shines along the way, besides what materials absorb, or some body has a
    priority."""
    return len(scene.bodies) > 0


def scatters(scene: SceneArrays) -> bool:
    return bool((scene.bodies["scattering"] > 0).any())


def glows(scene: SceneArrays) -> bool:
    return bool((scene.bodies["emission"] > 0).any())


def ranks(scene: SceneArrays) -> bool:
    """Whether some bodies give way to others."""
    return bool((scene.bodies["priority"] != 0).any())


def attenuates(scene: SceneArrays) -> bool:
    """Whether light is lost along the way."""
    m = scene.materials
    absorbs = transmits(m) & (m["thin_walled"] == 0) & (m["attenuation_distance"] > 0)
    return bool(absorbs.any()) or fills(scene)
