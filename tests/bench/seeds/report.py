"""Writes docs/experiments.md and its pictures, in docs/experiments."""

from __future__ import annotations

import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from tests.bench.seeds.page import NAME, Row, markdown
from tests.bench.seeds.spheres import NONE, OURS, UNORDERED

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"


def publish(document: Row, pictures: Mapping[str, np.ndarray], docs: Path = DOCS) -> None:
    """Writes the page, the figures as JSON and the pictures. Raises ImportError without matplotlib."""
    folder = docs / NAME
    folder.mkdir(parents=True, exist_ok=True)
    for name, pixels in {**pictures, **plots(document)}.items():
        (folder / f"{name}.webp").write_bytes(_webp(pixels, lossless=name.startswith("plot")))
    (folder / "figures.json").write_text(json.dumps(document, separators=(",", ":")) + "\n")
    (docs / f"{NAME}.md").write_text(markdown(document))


def plots(document: Row) -> dict[str, np.ndarray]:
    """Curves as pictures. Raises ImportError without matplotlib."""
    from matplotlib.figure import Figure

    field = Figure(figsize=(6, 4), layout="constrained")
    plot = field.add_subplot()
    rows = document["spheres"]
    for name in (NONE, UNORDERED, "spatial median", "object median", OURS):
        plot.loglog([row["spheres"] for row in rows], [row["ms"][name] for row in rows], "o-", label=name)
    plot.set(xlabel="spheres", ylabel="ms for a path per pixel")
    found = document["reflection"]
    models = Figure(figsize=(12, 4), layout="constrained")
    panels = (("metal", "white metal: energy"), ("gloss", "black plastic: Fresnel"), ("highlight", "highlight"))
    axes = models.subplots(1, len(panels))
    for axis, (name, title) in zip(axes, panels, strict=True):
        angles = found["highlight_angles"] if name == "highlight" else found["angles"]
        for model in found["models"]:
            values = np.array(found[name][model])
            axis.plot(angles, values / values.max() if name == "highlight" else values, label=model)
        axis.set(title=title, xlabel="degrees")
    for axis in (plot, *axes):
        axis.grid(True, which="major", alpha=0.3)
        axis.legend()
    return {"plot-spheres": _drawn(field), "plot-reflection": _drawn(models)}


def _drawn(figure: Any) -> np.ndarray:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=80)
    return np.asarray(Image.open(file).convert("RGB"))


def _webp(pixels: np.ndarray, lossless: bool) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "WEBP", quality=85, method=6, lossless=lossless)
    return file.getvalue()
