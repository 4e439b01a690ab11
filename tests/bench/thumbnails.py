"""The editor's pictures of the material presets, rendered by the service: `python -m tests.bench thumbnails`.

They go to web/thumbnails, beside the scene that they are taken in and an index of what each was taken of.
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

FOLDER = Path(__file__).resolve().parents[2] / "web" / "thumbnails"
SETTINGS = {"width": 112, "height": 112, "max_samples": 256, "max_bounces": 12, "seed": 1}
PATIENCE_S = 120.0


def scene(material: dict[str, Any]) -> dict[str, Any]:
    """The studio's set under its lamps, with `material` on the sphere."""
    document: dict[str, Any] = json.loads((FOLDER / "studio.json").read_text())
    document["environment"] = presets.get("environments", "studio")
    document["materials"]["subject"] = material
    return document


def fingerprint(material: dict[str, Any]) -> str:
    """Of a preset and of what it is photographed in: a picture with another one is out of date."""
    return hashlib.sha256(json.dumps(scene(material), sort_keys=True).encode()).hexdigest()[:16]


def run() -> int:
    index: dict[str, str] = {}
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder, server(folder) as (port, _):
        for name in (entry["name"] for entry in presets.names("materials")):
            material = presets.get("materials", name)
            body = json.dumps({"scene": scene(material), "settings": SETTINGS}).encode()
            request = Request(
                f"http://127.0.0.1:{port}/v1/render?format=webp", body, {"Content-Type": "application/json"}
            )
            with urlopen(request, timeout=PATIENCE_S) as answer:
                (FOLDER / f"{name}.webp").write_bytes(answer.read())
            index[name] = fingerprint(material)
    (FOLDER / "index.json").write_text(json.dumps(index, indent=1) + "\n")
    return 0
