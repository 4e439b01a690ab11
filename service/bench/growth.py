"""The cost of triangles: one bumpy ball, of some thousand to a million triangles, seen from one place."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np
import trimesh

from gpu import Renderer, RenderSettings
from gpu.accel import bvh
from gpu.layout import ShapeKind
from service.bench import timing
from service.bench.scenes import BenchAssets, mesh_on_plane, standing
from service.document import parse_scene
from service.formats import MeshData
from service.pack import pack

LEVELS = range(3, 9)  # 1 280, 5 120, ... 1 310 720 triangles
BOUNCES, RUNS = 4, 3
BUMPS = 9  # bumps around the ball, about


def measure(told: Callable[[str], None], levels: range = LEVELS) -> list[dict[str, float]]:
    """A row for each level: triangles, the time to build the tree, milliseconds for a sample of every pixel."""
    return [_row(ball(level), told) for level in levels]


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


def _row(mesh: MeshData, told: Callable[[str], None]) -> dict[str, float]:
    told(f"{len(mesh.faces)} triangles")
    corners = mesh.vertices[mesh.faces].astype(np.float32)
    kinds = np.full(len(corners), int(ShapeKind.TRIANGLE), np.uint8)
    seconds = []
    for _ in range(1 + RUNS):
        began = time.perf_counter()
        bvh.build(corners.min(axis=1), corners.max(axis=1), kinds)
        seconds.append(time.perf_counter() - began)
    build_s = statistics.median(seconds[1:])  # the first one may compile
    with Renderer() as renderer:
        scene = renderer.load(pack(parse_scene(mesh_on_plane()), _One(mesh)).arrays)
        picture = renderer.picture(scene, RenderSettings(timing.SIZE, timing.SIZE, BOUNCES))
        rates = timing.seconds_per_sample(picture, RUNS)
    n = len(kinds)
    return {"triangles": n, "build_s": build_s, "build_mtri_per_s": n / build_s / 1e6,
            "ms_per_sample": 1e3 * statistics.median(rates)}  # fmt: skip


def table(rows: list[dict[str, float]]) -> str:
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
