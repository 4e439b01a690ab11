"""Documents that the API's description shows, each of which is sent to a real server by a test, and answers beside
them.
"""

from __future__ import annotations

import json
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

DRIVER = "llvmpipe (LLVM 19.1.7, 256 bits) 4.5 (Core Profile) Mesa 25.0.7"
ALIVE = {"status": "ok"}
NAMED = {"name": "my-scene", "title": "My scene"}
STATUS: dict[str, Any] = {
    "id": RENDER_ID,
    "state": "running",
    "label": "poster",
    "priority": 0,
    "created": "2026-11-25T13:27:53.152Z",
    "started": "2026-11-25T13:27:53.169Z",
    "ended": None,
    "reason": None,
    "samples": 64,
    "noise": 0.0439,
    "elapsed_s": 1.11,
    "setup_s": 0.31,
    "eta_s": 3.34,
    "forecast": {"high": {"samples": 1024, "seconds": 17.8, "noise": 0.011}},
    "warnings": [],
    "renderers": 1,
    "not_divided": None,
    "settings": {
        "width": 256,
        "height": 256,
        "max_samples": 256,
        "max_bounces": 8,
        "time_limit": None,
        "target_noise": None,
        "seed": 0,
        "quality": "balanced",
        "estimator": "mis",
        "sampler": "sobol",
        "filter": "blackman_harris",
        "roulette_depth": 3,
        "resolution_scale": 1,
        "adaptive": False,
        "clamp": None,
        "caustics": None,
        "filter_glossy": 0.0,
        "denoise": False,
    },
}
DONE = STATUS | {"state": "done", "ended": "2026-11-25T13:27:58.006Z", "reason": "max_samples"}


DONE |= {"samples": 256, "noise": 0.022, "elapsed_s": 4.45, "eta_s": 0, "renderers": 0}


WAITING = STATUS | {"state": "queued", "started": None, "samples": 0, "noise": None, "elapsed_s": 0, "setup_s": 0}


WAITING |= {"eta_s": None, "forecast": None, "renderers": 0}


INFO: dict[str, Any] = {
    "version": "0.1.0",
    "renderer": {"renderer": "llvmpipe (LLVM 19.1.7, 256 bits)", "vendor": "Mesa", "software": True},
    "renderers": [{"id": "0", "device": "0", "host": "studio", "vendor": "Mesa", "driver": DRIVER, "state": "ready"}],
    "sandbox": {"no_new_privileges": True, "no_network": True, "seccomp": True},
    "memory": {"limit": 12638257152, "used": {"scenes": 21545840, "pictures": 267386880}},
    "limits": {"max_pixels": 16777216, "max_body": 268435456},
    "quality": {"draft": {"max_samples": 16, "max_bounces": 3, "roulette_depth": 2, "resolution_scale": 1}},
    "formats": {
        "pictures": ["png", "exr"],
        "animations": ["webp"],
        "meshes": ["obj", "ply", "stl"],
        "scenes": ["glb", "gltf", "zip"],
        "images": ["png", "exr", "hdr"],
        "luts": ["cube"],
        "materials": ["zip"],
        "exports": ["glb"],
        "compressions": ["draco", "meshopt"],
        "missing": {"ktx2": "opengl-basisu"},
    },
    "tone_maps": ["linear", "agx", "aces2", "ocio:Display P3 - Display/ACES 2.0 - SDR 100 nits (P3 D65)"],
}
SCHEMAS = {
    "scene": {"title": "Scene", "type": "object", "required": ["version", "camera", "materials", "shapes"]},
    "settings": {"title": "Settings", "type": "object", "properties": {"width": {"type": "integer", "default": 512}}},
    "view": {"title": "ViewMessage", "type": "object"},
}
UPLOADED = {
    "id": ASSET_ID,
    "kind": "mesh",
    "format": "obj",
    "bytes": 32,
    "vertices": 3,
    "triangles": 1,
    "bounds": [[0, 0, 0], [1, 1, 0]],
    "warnings": [],
}
BATCH_STATUS = {
    "id": BATCH_ID,
    "state": "running",
    "label": None,
    "priority": 0,
    "created": "2026-11-25T13:27:54.868Z",
    "counts": {"queued": 1, "running": 1, "done": 1, "cancelled": 0, "failed": 0},
    "renders": [
        {"id": f"{BATCH_ID[:24]}{step:08x}", "state": state}
        for step, state in enumerate(("done", "running", "queued"))
    ],
    "eta_s": 4.2,
}
CALLBACK = {
    "id": "msg_7c1f0d6a3b1e4c52a9d81f60",
    "kind": "render",
    "of": RENDER_ID,
    "url": "https://hooks.example.org/sunbox",
    "state": "due",
    "attempts": 1,
    "created": "2026-11-25T13:27:53.152Z",
    "next": "2026-11-25T13:28:03.311Z",
    "ended": None,
    "status": 503,
    "error": "it answered 503",
}
F = [[[0.0699, 0.0545, 0.0238], [15.3, 11.9, 5.21]]]
VERDICT = {
    "different": True,
    "p_value": 1.5e-10,
    "mean_difference": -0.00211,
    "rmse": 0.0241,
    "psnr": 36,
    "flip": 0.0274,
    "ssim": 0.982,
    "differing": {"share": 0.21, "difference": 0.043},
    "samples": {"a": 32, "b": 32},
    "regions": [{"x": 16, "y": 16, "width": 32, "height": 32, "p_value": 1.5e-10}],
}
METRICS = "# TYPE sunbox_frames_total counter\nsunbox_frames_total 0.0\n"


def _events(*statuses: dict[str, Any]) -> str:
    named = (("progress" if status["state"] == "running" else "done", status) for status in statuses)
    return "".join(f"event: {name}\ndata: {json.dumps(status)}\n\n" for name, status in named)


ANSWERS: dict[str, Any] = {
    "isAlive": ALIVE,
    "isReady": ALIVE,
    "getMetrics": METRICS,
    "getInfo": INFO,
    "getSchema": SCHEMAS,
    "listPresets": [{"name": "brass", "title": "Brass", "kind": "metal"}],
    "getPreset": SCENE,
    "uploadAsset": UPLOADED,
    "getAssetScene": SCENE,
    "getAssetMaterials": {
        "materials": {"oak": MATERIAL | {"base_color": {"texture": "oak_color"}}},
        "textures": {"oak_color": {"asset": ASSET_ID, "color_space": "srgb"}},
        "warnings": [{"pointer": "oak_ao.jpg", "detail": "ambient occlusion is left out"}],
    },
    "listDocuments": [NAMED],
    "getDocument": MATERIAL,
    "saveDocument": NAMED,
    "startRender": {"200": DONE, "202": WAITING},
    "listRenders": [STATUS],
    "getRender": STATUS,
    "followRender": _events(STATUS, DONE),
    "followRenders": _events(STATUS, DONE),
    "getRenderScene": RENDER,
    "startBatch": {"id": BATCH_ID, "renders": 3},
    "getBatch": BATCH_STATUS,
    "listCallbacks": [CALLBACK],
    "compare": VERDICT,
    "getComparison": {"samples": 48, "max_samples": 256},
    "convertMaterial": {"material": CONVERTED, "lost": []},
    "evaluateBsdf": {"f": F, "pdf": [[0.0699, 12.3]], "delta": [[]]},
    "getBsdfAlbedo": {
        "albedo": [[0.872, 0.75, 0.505], [0.977, 0.769, 0.353], [0.992, 0.773, 0.337]],
        "error": [[0.0071, 0.0059, 0.0046], [0.0036, 0.0028, 0.0013], [0.0027, 0.0022, 0.0009]],
    },
    "getBsdfTerms": {
        "distribution": [0.00263, 0.00456, 39.3],
        "geometry": [0.852, 0.992, 0.998],
        "fresnel": [[1, 0.91, 0.73], [1, 0.787, 0.361], [1, 0.78, 0.34]],
    },
}


def answer(operation: str, status: str) -> Any:
    """The example for one status of an operation; None: there is none."""
    found = ANSWERS.get(operation)
    return found.get(status) if isinstance(found, dict) and "200" in found else found
