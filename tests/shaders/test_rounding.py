"""Intersections as a GPU may round them, replayed in numpy: no ray slips between two triangles or past a box, and
none begins behind the surface that it leaves. The drivers at hand contract nothing and round divisions once."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from gpu.accel import bvh
from gpu.kernels.source import SHADERS
from gpu.layout import LEAF_BIT, LEAF_FIRST_MASK, ShapeKind
from tests.rounding import Driver

N = 40_000
SCALES = (1e-6, 1.0, 1e6)
ONCE = 1.0000004  # the slack that divisions ask for which are rounded once: 1 + 2 gamma(3)
Array = np.ndarray


def drivers() -> list[Driver]:
    return [Driver(contracts) for contracts in (False, True)]


def text(name: str) -> str:
    return (SHADERS / "shapes" / name).read_text()


def constant(file: str, pattern: str) -> np.float32:
    """A number of a shader, by a pattern around it."""
    found = re.search(pattern, text(file))
    assert found is not None, pattern
    return np.float32(found.group(1))


def gamma_error(n: np.float32) -> np.float32:
    ulp = np.float32(2.0**-24)
    return np.float32(n * ulp / (1 - n * ulp))


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


# Triangles


def triangle_axes(v: Array, axis: Array) -> Array:
    return np.take_along_axis(v, np.array([[1, 2, 0], [2, 0, 1], [0, 1, 2]])[axis], 1)


def triangle_shear(d: Array, driver: Driver) -> tuple[Array, Array]:
    """The axis (n,) and s (n, 3)."""
    axis = np.abs(d).argmax(1)
    e = triangle_axes(d, axis)
    return axis, driver.divide(np.concatenate([e[:, :2], np.ones_like(e[:, :1])], 1), e[:, 2:])


EDGE = re.compile(r"(precise )?float ([uvw]) = (\w\.\w) \* (\w\.\w) - (\w\.\w) \* (\w\.\w);")
EDGES = {name: (bool(word), places) for word, name, *places in EDGE.findall(text("triangle.glsl"))}


def triangle_edges(corners: list[Array], axis: Array, s: Array, driver: Driver) -> list[Array]:
    """The shader's u, v and w (n,)."""
    at = {}
    for name, corner in zip("abc", corners, strict=True):
        v = triangle_axes(corner, axis)
        at[f"{name}.x"], at[f"{name}.y"] = (v[:, k] - s[:, k] * v[:, 2] for k in (0, 1))
    return [driver.difference(*(at[place] for place in EDGES[name][1])) for name in "uvw"]


def triangle_inside(edges: list[Array]) -> Array:
    u, v, w = edges
    within = (np.minimum(u, np.minimum(v, w)) >= 0) | (np.maximum(u, np.maximum(v, w)) <= 0)
    return np.asarray(within & (u + v + w != 0))


def test_the_products_of_edges_are_precise() -> None:
    body = text("triangle.glsl").split("float triangle_hit(")[1].split("\n}")[0]
    assert EDGES.keys() == set("uvw") and all(precise for precise, _ in EDGES.values())
    assert all(f"precise vec3 {name} = triangle_axes(" in body for name in "abc")


def on_edges(rng: np.random.Generator) -> tuple[list[Array], Array]:
    """Corners a, b, c and e (n, 3) as the ray's origin sees them, and its direction: it passes through the edge of a
    and b exactly, whose products are equal."""
    a = rng.normal(size=(N, 3)).astype(np.float32)
    b = a * -np.exp2(rng.integers(-3, 4, (N, 1))).astype(np.float32)
    a[:, 2], b[:, 2] = rng.uniform(1, 2, (2, N))
    c = np.stack([-a[:, 1], a[:, 0], a[:, 2]], 1)
    e = c * np.float32([-1, -1, 1])
    return [a, b, c, e], np.tile(np.float32([0, 0, 1]), (N, 1))


def near_edges(rng: np.random.Generator) -> tuple[list[Array], Array]:
    """The same, but as near to the edge as floats come, from anywhere."""
    a, b = rng.normal(size=(2, N, 3))
    to = a + (b - a) * rng.uniform(0.1, 0.9, (N, 1))
    across = unit(np.cross(b - a, rng.normal(size=(N, 3))))
    o = (to + unit(rng.normal(size=(N, 3))) * np.exp2(rng.uniform(-2, 6, (N, 1)))).astype(np.float32)
    d = unit(to - o).astype(np.float32)
    c, e = to + across, to - across
    return [corner.astype(np.float32) - o for corner in (a, b, c, e)], d


@pytest.mark.parametrize("rays", [on_edges, near_edges])
def test_no_ray_slips_between_two_triangles(rays: Callable[[np.random.Generator], tuple[list[Array], Array]]) -> None:
    """The ray's own numbers are rounded as badly as may be: both triangles have the same. Contracted, edges of one
    triangle are not those of the other with another sign, and half of the rays on an edge slip through."""
    (a, b, c, e), d = rays(np.random.default_rng(5))
    axis, s = triangle_shear(d, Driver(False))
    shares = []
    for driver in drivers():
        seen = [triangle_inside(triangle_edges(list(corners), axis, s, driver)) for corners in ((a, b, c), (b, a, e))]
        aside = np.abs(np.sum(unit(np.cross(b - a, c - a)) * d, 1)) > 1e-3  # else both are seen edge-on
        shares.append(float((~(seen[0] | seen[1]) & aside).mean()))
    assert shares[0] == 0.0
    assert shares[1] > (0.4 if rays is on_edges else 1e-3), shares


# Boxes of the tree


@dataclass(frozen=True)
class Boxes:
    """The grid of a tree, and the corners of each triangle's leaf on it (n, 3)."""

    origin: Array
    scale: Array
    lower: Array
    upper: Array


def terrain(height: float) -> Array:
    """Hills of that height over a square of 2 x 2: triangles (512, 3, 3)."""
    x, z = np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17))
    p = np.stack([x, height * np.sin(5 * x) * np.cos(4 * z), z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    return np.concatenate([np.stack(corners, axis=-2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))])


def boxes_of(triangles: Array) -> Boxes:
    kinds = np.full(len(triangles), ShapeKind.TRIANGLE, np.uint8)
    tree = bvh.build(triangles.min(axis=1), triangles.max(axis=1), kinds, leaf_size=1)
    lower, upper = np.zeros((2, len(triangles), 3), np.float32)
    for node in bvh.thread(tree)[0][: tree.count]:
        link = int(node["link"])
        if link & LEAF_BIT:
            words = np.array([int(node[axis]) for axis in "xyz"])
            at = tree.order[link & LEAF_FIRST_MASK]
            lower[at], upper[at] = words & 0xFFFF, words >> 16
    return Boxes(np.float32(tree.origin), np.float32(tree.scale), lower, upper)


def traverse_box(boxes: Boxes, k: Array, o: Array, d: Array, driver: Driver) -> tuple[Array, Array]:
    """Where rays enter and leave the boxes k, before the slack is added."""
    safe = np.where(np.abs(d) < 1e-20, np.float32(1e-20), d)
    inv = driver.divide(np.ones_like(safe), safe)
    scale, bias = boxes.scale * inv, (boxes.origin - o) * inv
    near, far = (np.where((safe < 0) == flipped, boxes.lower[k], boxes.upper[k]) for flipped in (False, True))
    lo, hi = (driver.add_product(side, scale, bias) for side in (near, far))
    return np.maximum(lo.max(1), 0), hi.min(1)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("height", [0.0, 0.2])
def test_boxes_of_triangles_that_are_hit_are_entered(height: float, scale: float) -> None:
    """From one to a thousand sizes of the mesh away: towards corners and edges, along axes too."""
    triangles = (terrain(height) * scale).astype(np.float32)
    boxes, size = boxes_of(triangles), float(np.ptp(triangles, axis=(0, 1)).max())
    slack = constant("traverse.glsl", r"TRAVERSE_SLACK = ([\d.]+);")
    rng = np.random.default_rng(3)
    met, once = 0, 0
    for away, driver in product((1.0, 50.0, 1000.0), drivers()):
        k = rng.integers(len(triangles), size=N)
        weights = rng.dirichlet([1, 1, 1], N)
        weights[: N // 2, 0] = 0
        weights[: N // 5] = np.eye(3)[rng.integers(0, 3, N // 5)]
        to = np.einsum("nk,nkc->nc", weights / weights.sum(1, keepdims=True), triangles[k].astype(float))
        towards = rng.normal(size=(N, 3))
        towards[rng.random(N) < 0.1, rng.integers(3)] *= 1e-3
        axes = rng.random(N) < 0.1
        towards[axes] = np.eye(3)[rng.integers(0, 3, axes.sum())]
        d = unit(towards)
        o, d = (to - d * size * away).astype(np.float32), d.astype(np.float32)
        axis, s = triangle_shear(d, driver)
        hit = triangle_inside(
            triangle_edges([triangles[k, corner] - o for corner in range(3)], axis, s, Driver(False))
        )
        near, far = traverse_box(boxes, k, o, d, driver)
        met += int(hit.sum())
        assert not (hit & (near > far * slack)).any(), (away, driver.contracts)
        once += int((hit & (near > far * np.float32(ONCE))).sum())
    assert met > 2 * N
    assert once > 0, "the doubled slack is needed"


# Points that rays leave


def leave(p: Array, ng: Array, error: Array, w: Array, driver: Driver) -> Array:
    """The origin of a ray, as `shapes_leave` has it."""
    d = driver.dot(np.abs(ng), error)
    way = np.where(driver.dot(w, ng) < 0, -d, d)
    by = way * ng
    o = driver.add_product(np.broadcast_to(way, ng.shape), ng, p)
    beyond = np.nextafter(o, np.where(by > 0, np.float32(np.inf), np.float32(-np.inf)))
    return np.asarray(np.where(by == 0, o, beyond))


Point = tuple[Array, Array, Array]  # p, ng and error


def triangle_point(triangles: Array, uv: Array, driver: Driver) -> Point:
    v0, v1, v2 = np.moveaxis(triangles, 1, 0)
    e1, e2 = v1 - v0, v2 - v0
    across = driver.cross(e1, e2)
    twice_area = driver.root(driver.dot(across, across))
    error = gamma_error(constant("triangle.glsl", r"r\.error = gamma_error\(([\d.]+)\)")) * np.abs(triangles).sum(1)
    lengths = np.concatenate([driver.root(driver.dot(e, e)) for e in (e2 - e1, e2, e1)], 1)
    edge = lengths * driver.divide(error.max(1, keepdims=True), twice_area)
    b = np.concatenate([1 - uv[:, :1] - uv[:, 1:], uv], 1)
    b = np.maximum(b, np.minimum(edge, np.float32(1 / 3)))
    b = driver.divide(b, b.sum(1, keepdims=True))
    p = driver.add_product(b[:, 2:], v2, driver.add_product(b[:, 1:2], v1, b[:, :1] * v0))
    return p, driver.divide(across, twice_area), error


def quad_point(origin: Array, normal: Array, p: Array, driver: Driver) -> Point:
    w = p - origin
    margin = gamma_error(constant("quad.glsl", r"r\.error = gamma_error\(([\d.]+)\)"))
    error = margin * (np.abs(origin) + np.abs(w) + np.abs(p))
    return driver.add_product(-driver.dot(w, normal) * np.ones_like(w), normal, p), normal, error


def sphere_point(center: Array, radius: Array, p: Array, driver: Driver) -> Point:
    ng = driver.normalize(p - center)
    error = gamma_error(constant("sphere.glsl", r"r\.error = gamma_error\(([\d.]+)\)")) * (np.abs(center) + radius)
    return driver.add_product(radius * np.ones_like(ng), ng, center), ng, error


def leaving(ng: Array, rng: np.random.Generator) -> Array:
    """Directions to either side of a surface, most of them grazing it."""
    n = unit(ng.astype(float))
    along = unit(np.cross(n, rng.normal(size=n.shape)))
    up = rng.choice([-1, 1], (len(n), 1)) * rng.choice([1e-4, 1e-2, 1.0], (len(n), 1))
    return unit(along + n * up).astype(np.float32)


def behind(kind: str, scale: float, offset: float, share: float) -> int:
    """How many rays begin behind the surface that they leave, by the exact shape, with that share of the error."""
    rng = np.random.default_rng(2)
    place = offset * np.array([1, -2, 1])

    def drawn(*shape: int) -> Array:
        return rng.normal(size=shape)

    count = 0
    for driver in drivers():
        if kind == "sphere":
            center = ((0.1 * drawn(N, 3) + place) * scale).astype(np.float32)
            radius = (scale * rng.uniform(0.01, 1, (N, 1))).astype(np.float32)
            near = center + radius * unit(drawn(N, 3)) * (1 + 1e-6 * drawn(N, 1))
            p, ng, error = sphere_point(center, radius, near.astype(np.float32), driver)
        elif kind == "quad":
            corner, u, v = (
                part.astype(np.float32) for part in ((drawn(N, 3) + place) * scale, *drawn(2, N, 3) * scale)
            )
            normal = unit(np.cross(u.astype(float), v.astype(float))).astype(np.float32)
            near = corner.astype(float) + rng.random((N, 1)) * u + rng.random((N, 1)) * v
            p, ng, error = quad_point(corner, normal, (near * (1 + 1e-6 * drawn(N, 3))).astype(np.float32), driver)
        else:
            corners = drawn(N, 3, 3)
            if kind == "level triangle":
                corners[..., 1] = corners[:, :1, 1]
            triangles = ((corners + place) * scale).astype(np.float32)
            p, ng, error = triangle_point(triangles, rng.dirichlet([1, 1, 1], N)[:, 1:].astype(np.float32), driver)
        w = leaving(ng, rng)
        o = leave(p, ng, error * np.float32(share), w, driver).astype(float)
        if kind == "sphere":
            side, n = np.linalg.norm(o - center, axis=1) - radius[:, 0].astype(float), ng.astype(float)
        elif kind == "quad":
            n = normal.astype(float)
            side = ((o - corner) * n).sum(1)
        else:
            exact = triangles.astype(float)
            n = np.cross(exact[:, 1] - exact[:, 0], exact[:, 2] - exact[:, 0])
            side = ((o - exact[:, 0]) * n).sum(1)
        count += int((side * (w * n).sum(1) <= 0).sum())
    return count


@pytest.mark.parametrize("kind", ["triangle", "level triangle", "quad", "sphere"])
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("offset", [0.0, 7.3, 1000.0])
def test_rays_begin_on_the_side_to_which_they_leave(kind: str, scale: float, offset: float) -> None:
    """Without the margins for errors a quarter of them and more begin behind."""
    assert behind(kind, scale, offset, 1.0) == 0
    assert behind(kind, scale, offset, 0.0) > N / 4
