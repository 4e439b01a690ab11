"""Speed: paths per second on scenes of each kind, compile times, latencies of the editor, the cost of triangles."""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from gpu import Renderer, RenderSettings
from gpu.accel import bvh
from gpu.layout import ShapeKind
from service.bench import latency, machine, timing
from service.bench.scenes import BenchAssets, Case, cases, mesh_on_plane, standing
from service.document import parse_scene
from service.formats import MeshData
from service.pack import pack

SIZE = timing.SIZE


@dataclass(frozen=True)
class Options:
    runs: int
    mesh_file: Path | None = None
    environment_file: Path | None = None


def measure(options: Options, progress: Callable[[str], None]) -> dict[str, Any]:
    """The machine, a row for each case, latencies; `progress` is called with the name of each measurement."""
    rows = []
    for case in cases():
        progress(f"{case.name}, {case.max_bounces} bounces")
        rows.append(_in_fresh_processes(case, options))
    grown = growth(progress)
    progress("server start and slider moves")
    return {
        "machine": machine.describe(rows[0]["renderer"]),
        "size": [SIZE, SIZE],
        "scenes": [{key: value for key, value in row.items() if key != "renderer"} for row in rows],
        "growth": grown,
        "latency": latency.measure(),
        "rooms": latency.rooms(progress),
    }


def _in_fresh_processes(case: Case, options: Options) -> dict[str, Any]:
    """The first process finds an empty shader cache, the second one what the first left there."""
    with tempfile.TemporaryDirectory(prefix="sunbox-bench-") as cache:
        rows = []
        for runs in (0, options.runs):
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
                rows.append(process.submit(_measure_case, case, options, runs, cache).result())
    return {**rows[1], "compile_cold_ms": rows[0]["compile_ms"], "compile_warm_ms": rows[1].pop("compile_ms")}


def _measure_case(case: Case, options: Options, runs: int, cache: str) -> dict[str, Any]:
    os.environ |= machine.shader_caches(cache)
    began = time.perf_counter()
    assets = BenchAssets(options.mesh_file, options.environment_file)
    packed = pack(parse_scene(case.scene), assets)
    pack_ms = 1e3 * (time.perf_counter() - began)
    renderer = Renderer()
    settings = RenderSettings(width=SIZE, height=SIZE, max_bounces=case.max_bounces)
    picture = renderer.picture(renderer.load(packed.arrays), settings)
    row: dict[str, Any] = {
        "name": case.name,
        "max_bounces": case.max_bounces,
        "triangles": len(packed.arrays.triangles),
        "pack_ms": pack_ms,
        "compile_ms": picture.compile_ms,
        "renderer": renderer.info,
    }
    if runs:
        seconds = timing.seconds_per_sample(picture, runs)
        row["ms_per_sample"] = 1e3 * statistics.median(seconds)
        row["spread"] = (max(seconds) - min(seconds)) / statistics.median(seconds)
        row["mpaths_per_s"] = SIZE * SIZE / statistics.median(seconds) / 1e6
    renderer.close()
    return row


def table(document: dict[str, Any]) -> str:
    """The document for people: a row for each scene, then the latencies, then the machine."""
    name = max(len(row["name"]) for row in document["scenes"])
    lines = [f"{'512 x 512':{name}}  bounces  Mpaths/s  ms/sample  spread  compile cold  warm ms"]
    for row in document["scenes"]:
        lines.append(
            f"{row['name']:{name}}  {row['max_bounces']:7}  {row['mpaths_per_s']:8.2f}  {row['ms_per_sample']:9.1f}"
            f"  {100 * row['spread']:4.0f} %  {row['compile_cold_ms']:12.0f}  {row['compile_warm_ms']:7.0f}"
        )
    lines += ["", _growth_table(document["growth"]), ""]
    for key, value in document["latency"].items():
        lines.append(f"{key.removesuffix('_ms').replace('_', ' '):24}{value:8.1f} ms")
    rooms = document["rooms"]
    lines.append(f"\n{'update to first frame, ms':24}  slider p50    p95  camera p50    p95")
    for room, at in rooms.items():
        slider, camera = ((at[f"{hand}_p50_ms"], at[f"{hand}_p95_ms"]) for hand in ("slider", "camera"))
        lines.append(f"{room:24}  {slider[0]:10.0f}  {slider[1]:5.0f}  {camera[0]:10.0f}  {camera[1]:5.0f}")
    lines.append("")
    lines += [f"{key:10} {value}" for key, value in document["machine"].items()]
    return "\n".join(lines)


GROWTH_LEVELS = range(3, 9)  # 1 280, 5 120, ... 1 310 720 triangles
GROWTH_BOUNCES, GROWTH_RUNS = 4, 3
BUMPS = 9  # bumps around the ball, about


def growth(progress: Callable[[str], None], levels: range = GROWTH_LEVELS) -> list[dict[str, float]]:
    """A row for each level: triangles, the time to build the tree, milliseconds for a sample of every pixel."""
    return [_growth_row(ball(level), progress) for level in levels]


def ball(level: int) -> MeshData:
    """A ball of the same form at each level, up to the size of a triangle."""
    round_ = trimesh.creation.icosphere(subdivisions=level)
    x, y, z = (BUMPS * round_.vertices).T
    bumps = 1 + 0.12 * np.sin(x + 0.3) * np.sin(y + 1) * np.sin(z + 2)
    mesh = trimesh.Trimesh(round_.vertices * bumps[:, None], round_.faces, process=False)
    return standing(MeshData(mesh.vertices, mesh.faces.astype(np.int32), np.array(mesh.vertex_normals)))


class _One(BenchAssets):
    def __init__(self, mesh: MeshData) -> None:
        super().__init__()
        self._one = mesh

    def mesh(self, ref: str) -> MeshData:
        return self._one


def _growth_row(mesh: MeshData, progress: Callable[[str], None]) -> dict[str, float]:
    progress(f"{len(mesh.faces)} triangles")
    corners = mesh.vertices[mesh.faces].astype(np.float32)
    kinds = np.full(len(corners), int(ShapeKind.TRIANGLE), np.uint8)
    seconds = []
    for _ in range(1 + GROWTH_RUNS):
        began = time.perf_counter()
        bvh.build(corners.min(axis=1), corners.max(axis=1), kinds)
        seconds.append(time.perf_counter() - began)
    build_s = statistics.median(seconds[1:])  # the first one may compile
    with Renderer() as renderer:
        scene = renderer.load(pack(parse_scene(mesh_on_plane()), _One(mesh)).arrays)
        picture = renderer.picture(scene, RenderSettings(timing.SIZE, timing.SIZE, GROWTH_BOUNCES))
        rates = timing.seconds_per_sample(picture, GROWTH_RUNS)
    n = len(kinds)
    return {"triangles": n, "build_s": build_s, "build_mtri_per_s": n / build_s / 1e6,
            "ms_per_sample": 1e3 * statistics.median(rates)}  # fmt: skip


def _growth_table(rows: list[dict[str, float]]) -> str:
    """A table of the rows; growth like log n adds the same for each factor of four."""
    lines = [f"{'triangles':>12}  tree s  Mtri/s  ms/sample   added"]
    before = None
    for row in rows:
        took = row["ms_per_sample"]
        added = "" if before is None else f"{took - before:+8.1f}"
        lines.append(
            f"{row['triangles']:12,.0f}  {row['build_s']:6.3f}  {row['build_mtri_per_s']:6.2f}  {took:9.1f}{added}"
        )
        before = took
    return "\n".join(lines)
