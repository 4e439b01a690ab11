"""Closed rooms, rays aimed at their edges and corners: every one is met, and none that leaves its wall gets out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.pack.geometry import instances
from tests.extremes.scenes import Seen, ball, icosphere, packed, placed, quad, rows
from tests.rays import to_world, trace
from tests.rendering import document

EDGES = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]  # of that cube


def _walls() -> list[dict[str, Any]]:
    out = []
    for a, b, _, d in FACES:
        out.append(quad("m", EDGES[a].tolist(), (EDGES[b] - EDGES[a]).tolist(), (EDGES[d] - EDGES[a]).tolist()))
    return out


def _cube() -> dict[str, Any]:
    faces = [f for a, b, c, d in FACES for f in ([a, b, c], [a, c, d])]
    return {"type": "mesh", "vertices": EDGES.tolist(), "faces": faces, "smooth": False, "material": "m"}


ROOMS: dict[str, list[dict[str, Any]]] = {
    "six quads": _walls(),
    "a box": [{"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": "m"}],
    "a mesh of a cube": [_cube()],
    "an icosahedron": [icosphere("m", 0)],
    "1 280 triangles": [icosphere("m", 3)],
    "an instance": [icosphere("m", 3), icosphere("m", 3, translate=[9, 0, 0])],
    "a sphere": [ball("m")],
}
PLACES = {
    "upright": {},
    "turned": {"rotate": [20, 30, 40]},
    "aside": {"translate": [3, 3, 3]},
    "turned, aside": {"rotate": [20, 30, 40], "translate": [7.3, 7.3, 7.3]},
    "1e-4": {"scale": 1e-4, "translate": [3e-4, 3e-4, 3e-4]},
    "1e5": {"scale": 1e5, "rotate": [5, 0, 0], "translate": [3e5, 1e5, 3e5]},
}
N = 100_000


@pytest.fixture(autouse=True)
def worth(monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes share their triangles, whatever that spares."""
    monkeypatch.setattr(instances, "WORTH", 0)


def _corners(room: str) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the room's edges (n, 3) each."""
    shape = ROOMS[room][0]
    if shape["type"] == "mesh":
        v, f = np.array(shape["vertices"]), np.array(shape["faces"])
        return v[f].reshape(-1, 3), v[np.roll(f, 1, 1)].reshape(-1, 3)
    if shape["type"] == "sphere":
        ends = np.random.default_rng(3).normal(size=(2, 1000, 3))
        return ends[0], ends[1]
    pairs = [(a, b) for a in EDGES for b in EDGES if (a != b).sum() == 1]
    return np.array([a for a, _ in pairs]), np.array([b for _, b in pairs])


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("room", ROOMS)
def test_no_ray_leaves_a_closed_room(gpu: Renderer, room: str, place: str) -> None:
    matrix = to_world({"transform": PLACES[place]})
    made = packed(document([placed(s, matrix) for s in ROOMS[room]])).arrays
    rng = np.random.default_rng(1)
    a, b = _corners(room)
    which, along = rng.integers(0, len(a), N), rng.random((N, 1))
    along[: N // 4] = 0  # at the corners themselves
    target = a[which] * (1 - along) + b[which] * along
    o = rng.uniform(-0.3, 0.3, (N, 3))
    o, target = (p @ matrix[:3, :3].T + matrix[:3, 3] - made.origin for p in (o, target))
    o = o.astype(np.float32).astype(float)
    d = target - o
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    scene = gpu.load(made)
    hits, _, leaves = trace(gpu, scene, o, d, rng.normal(size=(N, 3)))
    scene.release()
    assert (hits[:, 3] >= 0).all()
    assert (leaves[:, 0] == 1).all()


def _dark(shapes: list[dict[str, Any]]) -> dict[str, Any]:
    """A room seen from inside, without light, under a sky and a sun a million times as bright as day."""
    return document(
        shapes, {"m": {"type": "diffuse", "albedo": 0.9}},
        camera={"position": [0.2, 0.1, 0.6], "target": [-0.6, -0.5, -0.6], "vfov": 100},
        environment={"type": "constant", "radiance": 1e6},
        lights=[{"type": "directional", "direction": [-0.5, -1, -0.3], "irradiance": 1e8}],
    )  # fmt: skip


@pytest.mark.parametrize(
    "room", rows({r: r for r in ("six quads", "a box", "a mesh of a cube")}, {r: r for r in ROOMS})
)
def test_a_dark_room_stays_dark(gpu: Renderer, room: str) -> None:
    seen = Seen(gpu, _dark(ROOMS[room]), 64, max_bounces=4)
    assert seen.color.max() == 0


# That a ray which leaves a convex shape outwards does not meet it again is in test_shapes. Here two share a place.
TOUCHING = {
    "a ball in a ball": [ball("m"), ball("m", radius=1 - 1e-6)],
    "two floors": [quad("m", (-1, -1, 0), (2, 0, 0), (0, 2, 0)), quad("m", (-1, -1, 0), (2, 0, 0), (0, 2, 0))],
}


@pytest.mark.parametrize("row", TOUCHING)
def test_faces_that_coincide_show_no_pattern(gpu: Renderer, row: str) -> None:
    """Lit evenly from all around, convex bodies look even: radiance times albedo, whichever face is met."""
    camera = {"position": [1.5, 2, 4], "target": [0, 0, 0], "vfov": 24}
    scene = document(TOUCHING[row], environment={"type": "constant", "radiance": 1}, camera=camera)
    seen = Seen(gpu, scene, 64, max_bounces=1).color[..., 0]
    inner = seen[seen < 0.55]
    assert inner.size > 500
    assert inner.min() > 0.35
    assert inner.mean() == pytest.approx(0.5, abs=0.01)
