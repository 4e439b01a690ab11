"""Documents that the API's description shows; each is sent to a real server by a test."""

from __future__ import annotations

from typing import Any

MATERIAL: dict[str, Any] = {"type": "principled", "base_color": "#b03020", "roughness": 0.4, "clearcoat": 1}
SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 1.2, 4], "target": [0, 0.6, 0]},
    "environment": {"type": "constant", "radiance": 0.6},
    "lights": [{"type": "point", "position": [2, 4, 3], "intensity": 60}],
    "materials": {"coat": MATERIAL, "floor": {"type": "diffuse", "albedo": 0.5}},
    "shapes": [
        {"type": "sphere", "center": [0, 0.7, 0], "radius": 0.7, "material": "coat"},
        {"type": "quad", "origin": [-5, 0, 5], "u": [10, 0, 0], "v": [0, 0, -10], "material": "floor"},
    ],
}
RENDER: dict[str, Any] = {"scene": SCENE, "settings": {"width": 256, "height": 256, "max_samples": 16}}
SWEEP = {"path": "/materials/coat/roughness", "values": [0.1, 0.3, 0.6]}
BATCH: dict[str, Any] = {"scene": SCENE, "settings": {"width": 64, "height": 64, "max_samples": 16}, "over": [SWEEP]}
_OTHER = SCENE | {"materials": SCENE["materials"] | {"coat": MATERIAL | {"roughness": 0.6}}}
COMPARISON: dict[str, Any] = {
    "a": {"scene": SCENE, "settings": {"width": 64, "height": 64, "max_samples": 64}},
    "b": {"scene": _OTHER, "settings": {"width": 64, "height": 64, "max_samples": 64}},
    "confidence": 0.999,
}
ASSET = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
ASSET_ID = "sha256:697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713"
RENDER_ID, BATCH_ID = "441087dd744f74d508321f94400431cb", "dbb92beda1a9131ab3a1c15544ea67ac"
ANY_DOCUMENT: dict[str, Any] = {"type": "object"}
METAL: dict[str, Any] = {"type": "metal_rough", "base_color": [1, 0.78, 0.34], "metallic": 1, "roughness": 0.3}
CONVERSION: dict[str, Any] = {"material": METAL, "to": "microfacet", "choose": {"distribution": "beckmann"}}
CONVERTED = {"type": "microfacet", "diffuse": 0, "alpha": 0.0636, "f0": [1, 0.78, 0.34], "distribution": "beckmann"}
BSDF: dict[str, Any] = {"material": METAL, "wo": [[0.6, 0, 0.8]], "wi": [[0, 0, 1], [-0.6, 0, 0.8]]}
ALBEDO: dict[str, Any] = {"material": METAL, "cosines": [0.1, 0.5, 1], "samples": 1024}
TERMS: dict[str, Any] = {"material": METAL, "cosines": [0.1, 0.5, 1]}
