"""How wrong the picture is under the hand: in the first 200 ms after each step of a drag, with and without the guess.

A client of the stream drags a slider, a lamp and the camera, a step every 200 ms. At each moment it sees the last
frame that came; its error is the RMSE of display values against the same document, rendered with more samples and
denoised: what is left of noise in that is a tenth of what is measured.
"""

from __future__ import annotations

import copy
import io
import json
import tempfile
import time
from collections.abc import Callable
from math import cos, sin
from statistics import mean
from typing import Any

import httpx
import numpy as np
from PIL import Image

from service.bench.latency import server
from service.document import presets
from tests.serving import Client, Picture

STEP_S = 0.2
STEPS = 5
REST_S = 6.0  # before a drag, so that there is a picture
SETTINGS = {"width": 768, "height": 432, "max_samples": 1 << 20, "max_bounces": 8}
REFERENCE_SAMPLES = 48
# What a drag does to a scene: the change at 0 to 1 of its way.
DRAGS: dict[str, tuple[str, Any]] = {
    "roughness": ("sphere-on-floor", lambda x: {"materials": {"Red paint": {"roughness": 0.15 + 0.5 * x}}}),
    "colour": (
        "sphere-on-floor",
        lambda x: {"materials": {"Red paint": {"base_color": [0.62 - 0.5 * x, 0.07, x / 2]}}},
    ),
    "metallic": ("cornell-spheres", lambda x: {"materials": {"White porcelain": {"metallic": x}}}),
    "lamp": ("cornell-spheres", lambda x: {"materials": {"Lamp": {"emission": [30.0 - 20 * x, 23.0 - 8 * x, 13.0]}}}),
    "camera": ("sphere-on-floor", lambda x: {"camera": {"position": [5.2 * sin(x / 4), 1.5, 5.2 * cos(x / 4)]}}),
}


def measure(told: Callable[[str], None]) -> dict[str, dict[str, float]]:
    """RMSE by drag: `without` and `with` the guess, and how many ms after a step the first frame came. `told` is
    called with the name of each drag."""
    out = {}
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder, server(folder) as (port, _):
        url = f"http://127.0.0.1:{port}"
        for name, (scene, change) in DRAGS.items():
            told(name)
            document = presets.get("scenes", scene)
            truths = [_truth(url, _changed(document, change((i + 1) / STEPS))) for i in range(STEPS)]
            found: dict[str, float] = {}
            for word, prior in (("without", False), ("with", True)):
                error, first_ms = _drag(url, document, change, truths, prior)
                found |= {word: error, f"{word}_first_ms": first_ms}
            out[name] = found
    return out


def table(figures: dict[str, dict[str, float]]) -> str:
    lines = ["RMSE in the first 200 ms, and ms to the first frame   without           with the guess"]
    for name, found in figures.items():
        words = (f"{found[word]:8.4f}  {found[f'{word}_first_ms']:4.0f} ms" for word in ("without", "with"))
        lines.append(f"{name:50}{'   '.join(words)}")
    return "\n".join(lines)


def _changed(document: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    out = copy.deepcopy(document)

    def merge(into: dict[str, Any], patch: dict[str, Any]) -> None:
        for name, value in patch.items():
            if isinstance(value, dict):
                merge(into[name], value)
            else:
                into[name] = value

    merge(out, json.loads(json.dumps(change)))
    return out


def _truth(url: str, scene: dict[str, Any]) -> np.ndarray:
    body = {"scene": scene, "settings": {**SETTINGS, "max_samples": REFERENCE_SAMPLES, "denoise": True}}
    answer = httpx.post(f"{url}/v1/render?format=png", json=body, timeout=600)
    answer.raise_for_status()
    return _pixels(answer.content)


def _pixels(image: bytes) -> np.ndarray:
    opened = Image.open(io.BytesIO(image)).convert("RGB")
    size = SETTINGS["width"], SETTINGS["height"]
    if opened.size != size:
        opened = opened.resize(size, Image.Resampling.BILINEAR)
    return np.asarray(opened, np.float32) / 255


def _drag(url: str, document: Any, change: Any, truths: list[np.ndarray], prior: bool) -> tuple[float, float]:
    client = Client(url)
    try:
        client.start(generation=1, scene=document, settings=SETTINGS, view={"format": "jpeg", "prior": prior})
        client.frame(1)
        client.say("update", generation=2, scene=json.loads(json.dumps(change(0.0))))  # its kernels are compiled
        shown = [client.frame(2), *_frames(client, REST_S)][-1]
        errors, firsts = [], []
        for i, truth in enumerate(truths):
            scene = json.loads(json.dumps(change((i + 1) / STEPS)))
            began = time.monotonic()
            client.say("update", generation=i + 3, scene=scene)
            frames = [frame for frame in _frames(client, STEP_S) if frame.generation == i + 3]
            moments = [began, *(frame.at for frame in frames), began + STEP_S]
            seen = [_pixels(each.image) for each in (shown, *frames)]
            spans = np.diff(moments)
            squares = [float(np.mean((pixels - truth) ** 2)) for pixels in seen]
            errors.append(float(np.sqrt(np.dot(spans, squares) / STEP_S)))
            firsts.append(1e3 * (moments[1] - began))
            shown = [shown, *frames][-1]
        return mean(errors), mean(firsts)
    finally:
        client.close()


def _frames(client: Client, seconds: float) -> list[Picture]:
    return [heard for heard in client.silence(seconds) if isinstance(heard, Picture)]
