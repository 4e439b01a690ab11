"""First frames at the socket of a real server whose caches are empty: every slider of every built-in scene, the
change to that scene, and the thumbnail of each material preset. Then the change to each scene, and the thumbnails
again, on a server that was left alone until it had compiled what it foresees.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from service.bench import latency
from service.document import presets
from tests.bench import thumbnails
from tests.bench.sliders import sliders

GOLDEN = 0.618  # no value comes twice
THUMBNAIL = {"width": 256, "height": 256, "max_samples": 16, "denoise": True, "seed": 1}
PATIENCE_S = 120.0
QUIET_S = 60.0  # without a new kernel: none of those that are foreseen takes as long
LONGEST_S = 600.0

Row = dict[str, Any]


def measure(scenes: Sequence[str], told: Callable[[str], None], moves: int) -> Row:
    """Milliseconds: a row for each scene, with every move of every slider; and of thumbnails, with and without the
    compilation of a kernel."""
    rows = []
    for name in scenes:
        told(f"first frames of {name}")
        rows.append(_scene(name, moves))
    told("changes of scene, foreseen")
    for row, change_ms in zip(rows, _foreseen_changes(scenes), strict=True):
        row["change_foreseen_ms"] = change_ms
    told("thumbnails")
    return {"scenes": rows, "thumbnails": _thumbnails()}


def _scene(name: str, moves: int) -> Row:
    """The scene is shown twice, after the editor's first one: what it needs is compiled at the first time. Then each
    slider is moved, at once after the one before it."""
    before = _another(name)
    with (
        tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder,
        latency.server(folder) as (port, began),
        latency.open_stream(port) as stream,
    ):
        editor = latency.Editor(port, stream, before)
        row: Row = {"name": name, "start_ms": editor.start(began)}
        for key in ("change_ms", "change_again_ms"):
            row[key] = editor.show(name)
            if key == "change_ms":
                editor.show(before)
        row["sliders"] = {}
        document = editor.scene
        for slider in sliders(document):
            shares = [(GOLDEN * (k + 1)) % 1 for k in range(moves)]
            row["sliders"][slider.name] = [editor.change(slider.patch(document, share)) for share in shares]
            editor.change(slider.restore(document))
    return row


def _another(name: str) -> str:
    """A built-in scene that a client changes from: the editor's first one, where that is another."""
    if name != presets.DEFAULT_SCENE:
        return presets.DEFAULT_SCENE
    return next(entry["name"] for entry in presets.names("scenes") if entry["name"] != name)


def _foreseen_changes(scenes: Sequence[str]) -> list[float]:
    """The change to each scene, once the server has compiled what it foresees."""
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder, latency.server(folder) as (port, began):
        _wait_for_quiet(Path(folder, "sunbox", "kernels"))
        with latency.open_stream(port) as stream:
            editor = latency.Editor(port, stream, _another(scenes[0]))
            editor.start(began)
            return [editor.show(name) for name in scenes]


def _wait_for_quiet(records: Path) -> None:
    """Return when no kernel was recorded for some time."""
    began = changed = time.monotonic()
    count = 0
    while time.monotonic() - changed < QUIET_S and time.monotonic() - began < LONGEST_S:
        time.sleep(1)
        found = len(list(records.glob("*"))) if records.exists() else 0
        if found != count:
            count, changed = found, time.monotonic()


def _thumbnails() -> list[Row]:
    """Each preset of a material twice, so that its kernel is there the second time, and once more when the server has
    been left alone, as all that it compiles before takes some of the machine."""
    rows = list[Row]()
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as folder, latency.server(folder) as (port, _):
        for name in (entry["name"] for entry in presets.names("materials")):
            scene = thumbnails.scene("materials", name)
            first_ms, again_ms = (_render_ms(port, scene, seed) for seed in (1, 2))
            rows.append({"name": name, "first_ms": first_ms, "again_ms": again_ms})
        _wait_for_quiet(Path(folder, "sunbox", "kernels"))
        for row in rows:
            scene = thumbnails.scene("materials", row["name"])
            row["left_alone_ms"] = _render_ms(port, scene, seed=3)
    return rows


def _render_ms(port: int, scene: Row, seed: int) -> float:
    body = json.dumps({"scene": scene, "settings": {**THUMBNAIL, "seed": seed}}).encode()
    url = f"http://127.0.0.1:{port}/v1/render?format=webp"
    began = time.perf_counter()
    with urlopen(Request(url, body, {"Content-Type": "application/json"}), timeout=PATIENCE_S) as answer:
        answer.read()
    return 1e3 * (time.perf_counter() - began)


def percentiles(times: Sequence[float]) -> tuple[float, float, float]:
    """Median, 95th percentile and greatest."""
    ordered = sorted(times)
    return ordered[len(ordered) // 2], ordered[int(0.95 * len(ordered))], ordered[-1]


def table(document: Row) -> str:
    """A row for each scene: the change to it, cold, again and foreseen; all moves of its sliders, the first move of
    each, the worst slider."""
    heads = ["change", "again", "foreseen", "sliders", "p50", "p95", "max", "first p95", "max"]
    lines = [f"{'first frames, ms':20}" + "".join(f"{head:>10}" for head in heads) + "  worst slider, by its median"]
    for row in document["scenes"]:
        found = row["sliders"]
        everything = percentiles([ms for times in found.values() for ms in times])
        first = percentiles([times[0] for times in found.values()])
        medians = {name: percentiles(times)[0] for name, times in found.items()}
        worst = max(medians, key=lambda name: medians[name])
        changes = [row[f"change_{which}ms"] for which in ("", "again_", "foreseen_")]
        figures = [*changes, len(found), *everything, *first[1:]]
        cells = "".join(f"{figure:10.0f}" for figure in figures)
        lines.append(f"{row['name']:20}{cells}  {worst} {medians[worst]:.0f}")
    lines += ["", f"{'thumbnails, ms':20}" + "".join(f"{head:>10}" for head in ("p50", "p95", "max"))]
    for key, words in (("first_ms", "first"), ("again_ms", "again"), ("left_alone_ms", "left alone")):
        times = percentiles([row[key] for row in document["thumbnails"]])
        lines.append(f"{words:20}" + "".join(f"{ms:10.0f}" for ms in times))
    return "\n".join(lines)
