"""Normal maps, steep and plain."""

from __future__ import annotations

import numpy as np

from tests.rendering import Images


def facing(*normal: float) -> np.ndarray:
    """One texel of a normal map."""
    return (np.array(normal, np.float32).reshape(1, 1, 3) + 1) / 2


def steep(degrees: float, seed: int) -> np.ndarray:
    """16 x 16 normals strewn over a cone."""
    rng = np.random.default_rng(seed)
    theta, phi = np.radians(degrees) * rng.random((16, 16)), 2 * np.pi * rng.random((16, 16))
    n = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    return ((n + 1) / 2).astype(np.float32)


MAPS = Images(n=steep(60, 1), c=steep(50, 2), right=facing(0.6, 0, 0.8), up=facing(0, 0.6, 0.8))
TEXTURES = {name: {"asset": name} for name in ("n", "c", "right", "up")}
