"""False alarms of a verdict: pairs of pictures of one scene that differ by their seeds alone, or by the way to the
same light, and how often these are told apart."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from typing import Any

import numpy as np

from service.cli.tracing import Interrupt, Tracing
from service.document import parse_scene, parse_settings, presets
from service.document.quality import ResolvedSettings, resolve
from service.ipc.messages import View
from service.pack import Packed, pack
from service.server.routes.examples import SCENE
from service.server.verdict.comparison import of_two_documents, seeds_from, ways_of
from service.server.verdict.decision import decide
from service.server.verdict.evidence import Estimate, Evidence
from service.worker.in_process import InProcessRenderer
from tests.rendering import Images

LEVELS = (0.05, 0.01, 0.001)

# A lamp of a hundredth of the walls, and a ball of glass: caustics are fireflies.
_ROOM: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 1, 3.4], "target": [0, 1, 0]},
    "materials": {
        "wall": {"type": "diffuse", "albedo": 0.7},
        "lamp": {"type": "diffuse", "albedo": 0, "emission": 60},
        "glass": {"type": "principled", "transmission": 1, "roughness": 0.02},
        "gloss": {"type": "principled", "metallic": 1, "roughness": 0.2},
    },
    "shapes": [
        {"type": "quad", "origin": [-1, 0, 1], "u": [2, 0, 0], "v": [0, 0, -2], "material": "wall"},
        {"type": "quad", "origin": [-1, 2, -1], "u": [2, 0, 0], "v": [0, 0, 2], "material": "wall"},
        {"type": "quad", "origin": [-1, 0, -1], "u": [2, 0, 0], "v": [0, 2, 0], "material": "wall"},
        {"type": "quad", "origin": [-0.1, 1.99, -0.1], "u": [0.2, 0, 0], "v": [0, 0, 0.2], "material": "lamp"},
        {"type": "sphere", "center": [-0.4, 0.4, 0.2], "radius": 0.4, "material": "glass"},
        {"type": "sphere", "center": [0.5, 0.3, -0.3], "radius": 0.3, "material": "gloss"},
    ],
}
SCENES: dict[str, Any] = {
    "ball": SCENE,
    "cornell-spheres": presets.get("scenes", "cornell-spheres"),
    "caustics": _ROOM,
}
# Pictures as renders or files are compared: size, samples, settings.
PICTURES: tuple[tuple[int, int, dict[str, Any]], ...] = (
    (16, 4, {}),
    (32, 16, {}),
    (16, 16, {"sampler": "independent"}),
)
# Documents as they are compared: size, samples, what differs. `None`: nothing but the seeds, which are drawn for
# either side, as the same ones would give equal bits.
WAYS: tuple[tuple[int, int, dict[str, Any] | None], ...] = (
    (16, 16, None),
    (16, 64, {"sampler": "independent"}),
    (16, 64, {"estimator": "bsdf"}),
)
FEWER = 10  # times as few pairs of documents, which take some 30 renders each


class Pairs:
    """Renders in this process."""

    def __init__(self, renderer: InProcessRenderer) -> None:
        self._renderer = renderer
        self._packed: dict[str, Packed] = {}

    def estimate(self, scene: str, settings: ResolvedSettings) -> Estimate:
        if scene not in self._packed:
            self._packed[scene] = pack(parse_scene(SCENES[scene]), Images())
        with closing(Tracing(self._renderer, self._packed[scene], settings)) as tracing:
            tracing.run(Interrupt())
            color, variance = (tracing.pixels(View(aov, encoding="linear")) for aov in ("color", "variance"))
            return Estimate.of(color, variance, tracing.progress.samples)

    def of_pictures(self, scene: str, size: int, samples: int, more: dict[str, Any], count: int) -> Iterator[float]:
        """p-values of pictures of two seeds each."""
        settings = _settings(size, samples, more)
        for k in range(count):
            a, b = (self.estimate(scene, replace(settings, seed=2 * k + each)) for each in (0, 1))
            yield decide(Evidence(a, b)).p_value

    def of_documents(
        self, scene: str, size: int, samples: int, other: dict[str, Any] | None, count: int
    ) -> Iterator[float]:
        """p-values of two documents, all samples being taken."""
        first, second = _settings(size, samples, {}), _settings(size, samples, other or {})
        for k in range(count):
            schedule = of_two_documents(samples, 2 * k)
            others = seeds_from(2 * k + 1) if other is None else (group.seed for group in schedule.groups)
            found, p = None, 1.0
            for group, seed in zip(schedule.groups, others, strict=False):
                a = self.estimate(scene, replace(first, seed=group.seed, max_samples=group.samples))
                b = self.estimate(scene, replace(second, seed=seed, max_samples=group.samples))
                if found is None:
                    found = Evidence(a, b, ways_of(first) == ways_of(second))
                else:
                    found.add(a, b)
                if group.look:
                    p = min(p, decide(found, schedule.looks).p_value)
            yield p


def run(count: int, progress: Any = lambda text: None) -> list[dict[str, Any]]:
    """A row for each scene and kind of pair: how many of `count` pairs are below each level."""
    rows = []
    with InProcessRenderer(None) as renderer:
        pairs = Pairs(renderer)
        for scene in SCENES:
            for size, samples, more in PICTURES:
                progress(f"{scene}, pictures, {size}, {samples}, {more}")
                found = list(pairs.of_pictures(scene, size, samples, more, count))
                rows.append(_row(scene, "pictures of two seeds", size, samples, more, found))
            for size, samples, other in WAYS:
                progress(f"{scene}, documents, {size}, {samples}, {other}")
                fewer = max(count // FEWER, 1)
                found = list(pairs.of_documents(scene, size, samples, other, fewer))
                kind = "documents of two seeds" if other is None else "documents"
                rows.append(_row(scene, kind, size, samples, other or {}, found))
    return rows


def table(rows: list[dict[str, Any]]) -> str:
    """As Markdown."""
    heads = ["scene", "pairs", "size", "samples", "differ in", "count", *(f"below {level:g}" for level in LEVELS)]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for row in rows:
        differ = ", ".join(map(str, row["settings"].values())) or "seeds"
        cells = [row["scene"], row["kind"], row["size"], row["samples"], differ, row["count"], *row["below"].values()]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


def _settings(size: int, samples: int, more: dict[str, Any]) -> ResolvedSettings:
    document = {"width": size, "height": size, "max_samples": samples, "max_bounces": 4, **more}
    return resolve(parse_settings(document))


def _row(
    scene: str, kind: str, size: int, samples: int, settings: dict[str, Any], found: list[float]
) -> dict[str, Any]:
    p = np.array(found)
    below = {f"{level:g}": int((p < level).sum()) for level in LEVELS}
    return {
        "scene": scene, "kind": kind, "size": size, "samples": samples, "settings": settings, "count": len(p),
        "below": below, "least": float(p.min()),
    }  # fmt: skip
