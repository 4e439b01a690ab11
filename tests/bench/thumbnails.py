"""The editor's pictures of the presets, rendered by the service: `python -m tests.bench thumbnails`.

They go to web/thumbnails, beside the scene in which the editor shows edited materials and an index of what each was
taken of. Only pictures that are out of date are taken again.
"""

from __future__ import annotations

import hashlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from PIL import Image

from service.bench import machine
from service.bench.latency import server
from service.document import presets
from tests.bench import thumbnail_stages as stages

FOLDER = Path(__file__).resolve().parents[2] / "web" / "thumbnails"
SETTINGS = {
    "materials": {"width": 144, "height": 144, "max_bounces": 12, "seed": 1, "denoise": True, "clamp": 3},
    "scenes": {"width": 168, "height": 112, "max_samples": 96, "max_bounces": 12, "seed": 1, "denoise": True},
    "environments": {"width": 112, "height": 112, "max_samples": 64, "max_bounces": 4, "seed": 1},
}
SAMPLES = 24  # of a material, whose picture is denoised
# The noise of Sobol' points behind clear glass is even enough for the denoiser to take it for a pattern in the glass.
SEEN_THROUGH = {"max_samples": 40, "sampler": "independent"}
MORE: dict[Any, dict[str, Any]] = {
    stages.clear: SEEN_THROUGH,
    stages.drops: SEEN_THROUGH,
    stages.bubble: SEEN_THROUGH,
    stages.window: SEEN_THROUGH,
    stages.cut: {"max_samples": 64, "max_bounces": 24, "clamp": 30},
    stages.lantern: SEEN_THROUGH | {"max_samples": 96},
}
KERNELS = Path.home() / ".cache"  # where the driver keeps them for everybody
PATIENCE_S = 1800.0
QUALITY = 88  # of WebP: below that a smooth ball has rings


def scene(kind: str, name: str) -> dict[str, Any]:
    """What a preset is shown in: a material on the stage that suits it, an environment round a mirror ball."""
    document = presets.get(kind, name)
    if kind == "scenes":
        return document
    if kind == "environments":
        return {
            "version": 1,
            "camera": {"position": [0, 0.4, 4], "target": [0, 0, 0], "vfov": 34},
            "environment": document | {"background": True},
            "materials": {"mirror": presets.get("materials", "chrome")},
            "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "mirror"}],
        }
    return stages.shown(name, document)


def settings(kind: str, name: str) -> dict[str, Any]:
    if kind != "materials":
        return SETTINGS[kind]
    stage = stages.chosen(name, stages.surface(presets.get(kind, name)))
    return SETTINGS[kind] | {"max_samples": SAMPLES} | MORE.get(stage, {})


def fingerprint(kind: str, name: str) -> str:
    """Of a preset in what it is shown in: a picture with another one is out of date.

    The meshes of our stages are left out, because their last digits differ among machines.
    """
    document = scene(kind, name)
    if kind == "materials":
        for shape in document["shapes"]:
            for numbers in ("vertices", "faces"):
                shape.pop(numbers, None)
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]


def picture(kind: str, name: str) -> Path:
    """Materials lie at the top, the others in folders of their own."""
    return FOLDER / ("" if kind == "materials" else kind) / f"{name}.webp"


def wanted() -> dict[str, dict[str, str]]:
    """The fingerprints of the presets, by kind and name."""
    return {
        kind: {each["name"]: fingerprint(kind, each["name"]) for each in presets.names(kind)} for kind in SETTINGS
    }


def run() -> int:
    index = FOLDER / "index.json"
    taken = json.loads(index.read_text()) if index.exists() else {}
    now = wanted()
    taken = {kind: {name: taken.get(kind, {}).get(name) for name in every} for kind, every in now.items()}
    missing = [
        (kind, name)
        for kind, every in now.items()
        for name, mark in every.items()
        if taken[kind][name] != mark or not picture(kind, name).exists()
    ]
    caches = machine.shader_caches(KERNELS)
    with (
        tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder,
        server(folder, SUNBOX_AHEAD="off", **caches) as (port, _),
    ):
        for kind, name in missing:
            body = json.dumps({"scene": scene(kind, name), "settings": settings(kind, name)}).encode()
            request = Request(
                f"http://127.0.0.1:{port}/v1/render?format=png", body, {"Content-Type": "application/json"}
            )
            picture(kind, name).parent.mkdir(exist_ok=True)
            with urlopen(request, timeout=PATIENCE_S) as answer:
                image = Image.open(io.BytesIO(answer.read())).convert("RGB")
            image.save(picture(kind, name), quality=QUALITY, method=6)
            # At once: whoever stops it goes on later.
            taken[kind][name] = now[kind][name]
            index.write_text(json.dumps(taken, indent=1) + "\n")
    return 0
