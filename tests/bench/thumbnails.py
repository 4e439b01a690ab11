"""The editor's pictures of the presets, rendered by the service: `python -m tests.bench thumbnails`.

They go to web/thumbnails, beside the scene that materials are taken in and an index of what each was taken of. Only
pictures that are out of date are taken again.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from service import presets
from service.bench.latency import server
from service.presets import physically_based

FOLDER = Path(__file__).resolve().parents[2] / "web" / "thumbnails"
SETTINGS = {
    "materials": {"width": 112, "height": 112, "max_samples": 256, "max_bounces": 12, "seed": 1},
    "scenes": {"width": 168, "height": 112, "max_samples": 96, "max_bounces": 12, "seed": 1, "denoise": True},
    "environments": {"width": 112, "height": 112, "max_samples": 64, "max_bounces": 4, "seed": 1},
}
PATIENCE_S = 900.0


def scene(kind: str, name: str) -> dict[str, Any]:
    """What a preset is shown in: a material on the sphere of the studio's set, an environment round a mirror ball."""
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
    stage: dict[str, Any] = json.loads((FOLDER / "studio.json").read_text())
    stage["environment"] = presets.get("environments", "studio")
    if "materials" in document:
        (document,), stage["textures"] = document["materials"].values(), document["textures"]
    stage["materials"]["subject"] = document
    return stage


def fingerprint(document: dict[str, Any]) -> str:
    """Of a preset in what it is shown in: a picture with another one is out of date."""
    return hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()[:16]


def picture(kind: str, name: str) -> Path:
    """Materials lie at the top, the others in folders of their own."""
    return FOLDER / ("" if kind == "materials" else kind) / f"{name}.webp"


def wanted() -> dict[str, dict[str, str]]:
    """The fingerprints of the presets, by kind and name. Browsers ask for those of a database when they are seen."""
    names = {
        kind: [each["name"] for each in presets.names(kind) if each.get("kind") != physically_based.KIND]
        for kind in SETTINGS
    }
    return {kind: {name: fingerprint(scene(kind, name)) for name in every} for kind, every in names.items()}


def run() -> int:
    index = FOLDER / "index.json"
    taken = json.loads(index.read_text()) if index.exists() else {}
    missing = [
        (kind, name)
        for kind, all_of_it in wanted().items()
        for name, mark in all_of_it.items()
        if taken.get(kind, {}).get(name) != mark or not picture(kind, name).exists()
    ]
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder, server(folder) as (port, _):
        for kind, name in missing:
            body = json.dumps({"scene": scene(kind, name), "settings": SETTINGS[kind]}).encode()
            request = Request(
                f"http://127.0.0.1:{port}/v1/render?format=webp", body, {"Content-Type": "application/json"}
            )
            picture(kind, name).parent.mkdir(exist_ok=True)
            with urlopen(request, timeout=PATIENCE_S) as answer:
                picture(kind, name).write_bytes(answer.read())
    index.write_text(json.dumps(wanted(), indent=1) + "\n")
    return 0
