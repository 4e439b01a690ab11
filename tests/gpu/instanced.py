"""One mesh without symmetries, seen twice: turned, and mirrored."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.extremes.scenes import icosphere, quad
from tests.rendering import Images, document

Doc = dict[str, Any]
SKY = {"type": "constant", "radiance": 0.6}
SUN = {"type": "directional", "direction": [-1, -2, -1], "irradiance": 2, "angular_diameter": 3}
FLOOR = quad("white", (-9, -1.4, 9), (18, 0, 0), (0, 0, -18))
TURNED = {"translate": [-1.2, 0.1, 0], "rotate": [20, 30, 40]}
MIRRORED = {"translate": [1.1, 0, 0.2], "rotate": [10, 0, 60], "scale": [-0.6, 1.2, 0.8]}
RNG = np.random.default_rng(2)
IMAGES = Images(t=RNG.integers(0, 256, (16, 16, 4)).astype(np.uint8))


def bumpy(**more: Any) -> Doc:
    """An icosphere that no symmetry maps onto itself, with texture coordinates and colours."""
    ball = icosphere("m", 3)
    v = np.array(ball["vertices"])
    uvs = np.stack([v[:, 0], v[:, 1] + 0.3 * v[:, 2]], axis=1)
    v *= 1 + 0.15 * np.sin(5 * v[:, :1]) * np.cos(4 * v[:, 1:2] + 1)
    return {**ball, "vertices": v.tolist(), "uvs": uvs.tolist(), **more}


def two(material: Doc, *more: Doc, **mesh: Any) -> Doc:
    shapes = [bumpy(transform=TURNED, **mesh), bumpy(transform=MIRRORED, **mesh), FLOOR, *more]
    materials = {"m": material, "white": {"type": "diffuse", "albedo": 0.6}}
    texture = {"asset": "t", "scale": [2, 2]}
    textures = {"t": texture, "n": {**texture, "color_space": "linear"}}
    used = {name: value for name, value in textures.items() if f"'texture': '{name}'" in str(material)}
    lit = {"environment": SKY, "lights": [SUN]}
    return document(shapes, materials, textures=used, camera={"position": [0, 1, 5.5], "target": [0, 0, 0]}, **lit)
