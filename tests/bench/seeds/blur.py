"""A blurred environment: how much noise it removes, and how much of the picture."""

from __future__ import annotations

import time
from typing import Any

from service.document import presets
from tests.bench.seeds.stage import Document, Stage, rmse, sheet, shown

DEGREES = (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0)
SIZE, SAMPLES, MANY = 96, 16, 1024
WAYS: dict[str, dict[str, Any]] = {
    "uniform": {"estimator": "uniform", "sampler": "independent"},
    "bsdf": {"estimator": "bsdf"},
    "mis": {},
}


def measure(stage: Stage) -> list[dict[str, Any]]:
    """A row for each blur: noise by estimator, the bias, milliseconds of packing the scene."""
    side, many = stage.either((SIZE, MANY), (16, 16))
    rows: list[dict[str, Any]] = []
    seen: list[list[Any]] = [[], []]
    sharp = None
    for degrees in stage.either(DEGREES, (0.0, 20.0)):
        stage.told(f"environment blurred by {degrees:g} degrees")
        began = time.process_time()
        arrays = stage.packed(scene(degrees))
        pack_ms = 1e3 * (time.process_time() - began)
        truth = stage.image(arrays, side, side, many, max_bounces=2, filter="box", seed=1000)
        sharp = truth if sharp is None else sharp
        noisy = {
            way: stage.image(arrays, side, side, SAMPLES, max_bounces=2, filter="box", **settings)
            for way, settings in WAYS.items()
        }
        mean = float(sharp.mean())
        rows.append({
            "degrees": degrees,
            "noise": {way: rmse(pixels, truth) / mean for way, pixels in noisy.items()},
            "error": {way: rmse(pixels, sharp) / mean for way, pixels in noisy.items()},
            "bias": rmse(truth, sharp) / mean,
            "pack_ms": pack_ms,
        })  # fmt: skip
        seen[0].append(shown(noisy["uniform"], -0.5))
        seen[1].append(shown(truth, -0.5))
    stage.pictures["blur"] = sheet(seen)
    return rows


def scene(degrees: float) -> Document:
    """A satin ball on a floor, under a sky with a small sun."""
    return {
        "version": 1,
        "camera": {"position": [0, 1.3, 4.6], "target": [0, 0.85, 0], "vfov": 34},
        "environment": {**presets.get("environments", "clear-sky"), "blur": degrees},
        "materials": {
            "ball": {"type": "principled", "base_color": [0.7, 0.16, 0.08], "roughness": 0.35},
            "floor": {"type": "diffuse", "albedo": 0.4},
        },
        "shapes": [
            {"type": "sphere", "center": [0, 1, 0], "radius": 1, "material": "ball"},
            {"type": "quad", "origin": [-20, 0, 20], "u": [40, 0, 0], "v": [0, 0, -40], "material": "floor"},
        ],
    }
