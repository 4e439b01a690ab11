"""Every shape against a float64 answer; and rays that leave a surface do not meet it again, at any scale."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.document import parse_scene
from service.pack import pack
from tests.rays import ball_mesh, to_world, trace
from tests.rendering import Images, document

TURNED = {"translate": [0.3, -0.2, 0.1], "rotate": [20, -35, 50], "scale": [0.5, 1.3, -0.8]}
ROWS: dict[str, dict[str, Any]] = {
    "sphere": {"type": "sphere", "center": [0.2, -0.1, 0.3], "radius": 0.9},
    "turned sphere": {
        "type": "sphere", "center": [0, 0, 0], "radius": 1, "transform": {"rotate": [30, 40, 50], "scale": 0.7},
    },
    "ellipsoid": {"type": "sphere", "center": [0, 0, 0], "radius": 1, "transform": TURNED},
    "quad": {"type": "quad", "origin": [-1, -0.5, 0.2], "u": [2, 0.3, 0], "v": [0.2, 1, 0.5]},
    "turned quad": {"type": "quad", "origin": [-1, -1, 0], "u": [2, 0, 0], "v": [0, 2, 0], "transform": TURNED},
    "disk": {"type": "disk", "center": [0.2, -0.1, 0.3], "normal": [1, 2, -3], "radius": 0.9},
    "level disk": {"type": "disk", "center": [0, 0, 0], "normal": [0, -1, 0], "radius": 1.2},
    "turned disk": {"type": "disk", "center": [0, 0, 0], "normal": [0, 0, 2], "radius": 1, "transform": TURNED},
    "box": {"type": "box", "min": [-0.7, -0.4, -0.9], "max": [0.5, 0.8, 0.3]},
    "turned box": {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "transform": TURNED},
    "cylinder": {"type": "cylinder", "base": [0.1, -0.6, 0.2], "axis": [0.3, 1.1, -0.5], "radius": 0.6},
    "upright cylinder": {"type": "cylinder", "base": [0, -1, 0], "axis": [0, 1.7, 0], "radius": 0.8},
    "tube": {"type": "cylinder", "base": [0, -0.5, 0.9], "axis": [0, 0.8, -1.3], "radius": 0.7, "caps": False},
    "turned cylinder": {"type": "cylinder", "base": [0, 0, -1], "axis": [0, 0, 2], "radius": 1, "transform": TURNED},
    "turned tube": {"type": "cylinder", "base": [0, -1, 0], "axis": [0, 2, 0], "radius": 1, "caps": False,
                    "transform": TURNED},
}  # fmt: skip
N = 20_000


def expected(shape: dict[str, Any], o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance (nan: none) and outward unit normal, in float64, by way of the shape's own space."""
    m = to_world(shape)
    inverse = np.linalg.inv(m[:3, :3])
    o, d = (o - m[:3, 3]) @ inverse.T, d @ inverse.T
    with np.errstate(all="ignore"):
        if shape["type"] == "sphere":
            f = o - np.array(shape["center"])
            a, b, c = (d * d).sum(1), (f * d).sum(1), (f * f).sum(1) - shape["radius"] ** 2
            root = np.sqrt(b * b - a * c)
            near, far = (-b - root) / a, (-b + root) / a
            t = np.where(near > 0, near, np.where(far > 0, far, np.nan))
            n = f + t[:, None] * d
        elif shape["type"] == "quad":
            u, v = np.array(shape["u"], float), np.array(shape["v"], float)
            n = np.broadcast_to(np.cross(u, v), o.shape)
            t = ((np.array(shape["origin"]) - o) * n).sum(1) / (d * n).sum(1)
            p = o + t[:, None] * d - shape["origin"]
            s = p @ np.linalg.pinv(np.stack([u, v], 1)).T
            t = np.where((s >= 0).all(1) & (s <= 1).all(1) & (t > 0), t, np.nan)
        elif shape["type"] == "disk":
            n = np.broadcast_to(np.array(shape["normal"], float), o.shape)
            t = ((np.array(shape["center"]) - o) * n).sum(1) / (d * n).sum(1)
            off = np.linalg.norm(o + t[:, None] * d - shape["center"], axis=1)
            t = np.where((off <= shape["radius"]) & (t > 0), t, np.nan)
        elif shape["type"] == "cylinder":
            t, n = _cylinder(shape, o, d)
        else:
            lo, hi = np.array(shape["min"]), np.array(shape["max"])
            ta, tb = (lo - o) / d, (hi - o) / d
            near, far = np.minimum(ta, tb).max(1), np.maximum(ta, tb).min(1)
            t = np.where(near <= far, np.where(near > 0, near, np.where(far > 0, far, np.nan)), np.nan)
            q = (o + t[:, None] * d - (lo + hi) / 2) / ((hi - lo) / 2)
            n = np.where(np.abs(q) == np.abs(q).max(1, keepdims=True), np.sign(q), 0)
        n = n @ inverse
        return t, n / np.linalg.norm(n, axis=1, keepdims=True)


def _cylinder(shape: dict[str, Any], o: np.ndarray, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    axis = np.array(shape["axis"], float)
    length, a = np.linalg.norm(axis), axis / np.linalg.norm(axis)
    f = o - np.array(shape["base"])
    ff, dd = f - (f @ a)[:, None] * a, d - (d @ a)[:, None] * a
    aa, b, c = (dd * dd).sum(1), (ff * dd).sum(1), (ff * ff).sum(1) - shape["radius"] ** 2
    root = np.sqrt(b * b - aa * c)
    found, normals = [], []
    for t in ((-b - root) / aa, (-b + root) / aa):
        height = (f + t[:, None] * d) @ a
        found.append(np.where((height >= 0) & (height <= length) & (t > 0), t, np.inf))
        normals.append(ff + t[:, None] * dd)
    for end, n in ((0.0, -a), (length, a)):
        t = (end - f @ a) / (d @ a)
        off = ff + t[:, None] * dd
        on = ((off * off).sum(1) <= shape["radius"] ** 2) & (t > 0) & shape.get("caps", True)
        found.append(np.where(on, t, np.inf))
        normals.append(np.broadcast_to(n, o.shape))
    times = np.stack(found)
    first = times.argmin(0)
    t = times.min(0)
    return np.where(np.isinf(t), np.nan, t), np.stack(normals)[first, np.arange(len(o))]


def _rays(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    o = rng.normal(size=(n, 3))
    o *= rng.choice([0.1, 3.0], (n, 1)) / np.linalg.norm(o, axis=1, keepdims=True)  # from inside and outside
    d = rng.uniform(-0.8, 0.8, (n, 3)) - o
    d[: n // 10] = np.eye(3)[rng.integers(0, 3, n // 10)] * rng.choice([-1, 1], (n // 10, 1))  # along the axes
    o = o.astype(np.float32).astype(float)
    d = (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32).astype(float)
    return o, d


@pytest.mark.parametrize("row", ROWS)
def test_hits_are_where_float64_says(gpu: Renderer, row: str) -> None:
    shape = {**ROWS[row], "material": "m"}
    rng = np.random.default_rng(7)
    o, d = _rays(rng, N)
    scene = gpu.load(pack(parse_scene(document([shape])), Images()).arrays)
    hits, _, _ = trace(gpu, scene, o, d, rng.normal(size=(N, 3)))
    t, n = expected(shape, o, d)
    met = hits[:, 3] >= 0
    edge = np.isnan(t) != ~met
    assert edge.mean() < 5e-4  # rays along an edge may go either way
    both = met & ~np.isnan(t)
    assert both.sum() > N / 10
    grazing = np.abs((n * d).sum(1)) < 0.02  # where a rounding of the ray moves the hit far
    np.testing.assert_allclose(hits[both & ~grazing, 3], t[both & ~grazing], rtol=3e-5, atol=3e-6)
    agree = (hits[both, :3] * n[both]).sum(1)
    assert (agree > 0.9999).mean() > 0.999


CLOSED = {
    "sphere": {"type": "sphere", "center": [0, 0, 0], "radius": 1},
    "ellipsoid": {"type": "sphere", "center": [0, 0, 0], "radius": 1, "transform": {"scale": [1, 0.3, 0.5]}},
    "box": {"type": "box", "min": [-0.6, -0.5, -0.4], "max": [0.5, 0.6, 0.7]},
    "quad": {"type": "quad", "origin": [-0.6, -0.5, 0], "u": [1.2, 0, 0], "v": [0, 1.1, 0]},
    "disk": {"type": "disk", "center": [0, 0.1, 0], "normal": [1, 1, 1], "radius": 0.8},
    "cylinder": {"type": "cylinder", "base": [0.1, -0.6, 0.2], "axis": [0.3, 1.1, -0.5], "radius": 0.6},
}


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
@pytest.mark.parametrize("offset", [0.0, 7.3])
@pytest.mark.parametrize("row", [*CLOSED, "mesh"])
def test_rays_that_leave_do_not_come_back(gpu: Renderer, row: str, scale: float, offset: float) -> None:
    """From outside, off a convex shape, towards any outward direction, grazing ones too: nothing may be met."""
    shape = CLOSED[row] if row != "mesh" else ball_mesh(3)
    inner = to_world(shape)
    inner = np.diag([scale, scale, scale, 1.0]) @ inner
    inner[:3, 3] += np.array([offset, -2 * offset, offset]) * scale
    placed = {**shape, "material": "m", "transform": {"matrix": inner.ravel().tolist()}}
    rng = np.random.default_rng(8)
    o = rng.normal(size=(N, 3))
    o *= 4 / np.linalg.norm(o, axis=1, keepdims=True)
    d = rng.uniform(-0.5, 0.5, (N, 3)) - o
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    packed = pack(parse_scene(document([placed])), Images()).arrays
    shift = np.array([offset, -2 * offset, offset]) * scale - np.array(packed.origin)
    scene = gpu.load(packed)
    world = o * scale + shift
    first, _, _ = trace(gpu, scene, world, d, np.ones((N, 3)))
    normal = first[:, :3].astype(float)
    away = rng.normal(size=(N, 3))
    graze = away - (away * normal).sum(1, keepdims=True) * normal
    graze /= np.linalg.norm(graze, axis=1, keepdims=True)
    towards = graze + normal * rng.choice([1e-4, 1e-2, 1.0], (N, 1))
    hits, places, leaves = trace(gpu, scene, world, d, towards)
    met = hits[:, 3] >= 0
    assert met.mean() > 0.2
    assert np.isfinite(places[met]).all()
    assert leaves[met, 0].sum() == 0


@pytest.mark.parametrize("tilt", [(0, 0, 0), (20, -35, 50)])
@pytest.mark.parametrize("slimness", [1e-4, 1e-2, 1.0, 1e5])
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e5])
def test_needles_and_coins(gpu: Renderer, slimness: float, scale: float, tilt: tuple[float, float, float]) -> None:
    """Of cylinders with this ratio of radius to length: rays from all around towards places on them hit, on the right
    face; rays that leave outwards meet nothing, and rays that leave inwards do not escape."""
    rng = np.random.default_rng(9)
    size = scale / max(1.0, slimness)
    radius, length = slimness * size, size
    turn = {"rotate": list(tilt)}
    shape = {"type": "cylinder", "base": [0, -length / 2, 0], "axis": [0, length, 0], "radius": radius}
    scene = gpu.load(pack(parse_scene(document([{**shape, "material": "m", "transform": turn}])), Images()).arrays)
    angle, side = rng.uniform(0, 2 * np.pi, N), rng.random(N) < 0.5
    around = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], 1)
    height = rng.choice([-0.5, 0.5], N)
    away = np.where(side, 1.0, 0.98 * np.sqrt(rng.random(N)))
    height = np.where(side, rng.uniform(-0.49, 0.49, N), height)
    goal = around * (away * radius)[:, None] + (height * length)[:, None] * [0, 1, 0]
    n = np.where(side[:, None], around, np.sign(height)[:, None] * [0, 1, 0])
    d = -rng.normal(size=(N, 3))
    d *= -np.sign((d * n).sum(1, keepdims=True)) / np.linalg.norm(d, axis=1, keepdims=True)
    steep = np.abs((d * n).sum(1)) > 0.3
    m = to_world({"transform": turn})[:3, :3]
    goal, d, n = goal @ m.T, d @ m.T, n @ m.T
    o = goal - 2 * scale * d
    outward = rng.normal(size=(N, 3)) * 0.3 + n
    hits, places, leaves = trace(gpu, scene, o, d, outward)
    met = hits[:, 3] >= 0
    # A float32 place is known to 2^-24 of its distance from the origin.
    room = 2.0**-18 * scale / min(radius, length)
    assert met[steep].mean() > 0.998 - 2 * room
    face = met & ((hits[:, :3] * n).sum(1) > 0.99)  # where the place tells which it is
    assert face[met & steep].mean() > 0.995 - 2 * room
    np.testing.assert_allclose(places[met & steep, :3], goal[met & steep], atol=2.0**-19 * scale, rtol=0)
    assert leaves[face, 0].sum() == 0
    depth = 2.0**-5 * min(radius, length) + 2.0**-20 * scale
    within = places[face, :3] - depth * hits[face, :3]
    inside, _, _ = trace(gpu, scene, within, rng.normal(size=within.shape), outward[face])
    assert (inside[:, 3] < 0).sum() == 0
