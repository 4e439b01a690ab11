"""The tree of boxes: whole, tight, in the right order for every octant, and never missing what a ray meets."""

import itertools

import numpy as np
import pytest

from gpu.accel import bvh, bvh_build
from gpu.accel.sah import Split
from gpu.errors import SceneTooLarge
from gpu.layout import (
    LEAF_BIT,
    LEAF_COUNT_SHIFT,
    LEAF_FIRST_MASK,
    LEAF_KIND_SHIFT,
    LEAF_MAX_COUNT,
    TREELET_BIT,
    TREELET_MAX_NODES,
    ShapeKind,
)

RNG_SEED = 7


def soup(n, size=None):
    rng = np.random.default_rng(RNG_SEED)
    size = size or n ** (-1 / 3)
    return (rng.random((n, 1, 3)) + rng.normal(size=(n, 3, 3)) * 0.4 * size).astype(np.float32)


def terrain(side):
    x, z = np.meshgrid(np.linspace(-1, 1, side + 1), np.linspace(-1, 1, side + 1))
    p = np.stack([x, 0.2 * np.sin(5 * x) * np.cos(4 * z), z], axis=-1)
    a, b, c, d = p[:-1, :-1], p[1:, :-1], p[1:, 1:], p[:-1, 1:]
    faces = [np.stack(corners, axis=-2).reshape(-1, 3, 3) for corners in ((a, b, c), (a, c, d))]
    return np.concatenate(faces).astype(np.float32)


def flat():
    return terrain(12) * np.float32([1, 0, 1])


def needles():
    """Boxes without area, along one axis."""
    steps = np.repeat(np.geomspace(1e-6, 1e6, 300)[:, None], 3, axis=1)
    return np.stack([steps * [1, 0, 0], steps * [1.01, 0, 0], steps * [1.005, 0, 0]], axis=1).astype(np.float32)


TRIANGLES = {
    "one": soup(1),
    "two": soup(2),
    "soup": soup(600),
    "dense soup": soup(200, size=1.0),
    "terrain": terrain(16),
    "flat": flat(),
    "same": np.repeat(soup(1), 100, axis=0),
    "far": soup(300) + np.float32([3.0, -3.5, 2.0]),
    "huge": soup(300) * np.float32(1e9),
    "tiny": soup(300) * np.float32(1e-12),
    "needles": needles(),
}


def boxes(triangles):
    return triangles.min(axis=1), triangles.max(axis=1)


def build(triangles, treelet=0, **options):
    kinds = np.full(len(triangles), ShapeKind.TRIANGLE, np.uint8)
    tree = bvh.build(*boxes(triangles), kinds, **options)
    return tree, bvh.thread(tree, treelet)[0]


def unpack(tree, nodes):
    """(lower, upper) float32 as a shader computes them, (n, 3) each."""
    words = np.stack([nodes["x"], nodes["y"], nodes["z"]], axis=-1)
    origin, scale = np.float32(tree.origin), np.float32(tree.scale)
    return origin + (words & 0xFFFF).astype(np.float32) * scale, origin + (words >> 16).astype(np.float32) * scale


def leaf(link):
    """(kind, first, count)"""
    return (link >> LEAF_KIND_SHIFT) & 7, link & LEAF_FIRST_MASK, ((link >> LEAF_COUNT_SHIFT) & 15) + 1


def hits(origin, direction, triangles):
    """Distances along one ray, inf where it misses [Moeller and Trumbore 1997], float64."""
    v0, e1, e2 = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(direction, e2)
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = 1.0 / np.sum(e1 * p, axis=1)
        s = origin - v0
        u = np.sum(s * p, axis=1) * inverse
        q = np.cross(s, e1)
        v = np.sum(q * direction, axis=1) * inverse
        t = np.sum(e2 * q, axis=1) * inverse
        return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & np.isfinite(t), t, np.inf)


def trace(tree, nodes, lower, upper, ordered, origin, direction, count=None):
    """(nearest distance, nodes visited): the shader's traversal, its box tests in float32."""
    octant = sum(1 << k for k in range(3) if direction[k] < 0)
    count = tree.count if count is None else count
    at, end = octant * count, (octant + 1) * count
    after = last = None
    start = np.float32(origin)
    inverse = np.float32(1) / np.where(direction == 0, np.float32(1e-30), np.float32(direction))
    nearest, visited = np.inf, 0
    while last or at < end:
        visited += 1
        link = int(nodes["link"][at])
        with np.errstate(over="ignore"):
            t0, t1 = (lower[at] - start) * inverse, (upper[at] - start) * inverse
        enter, leave = np.minimum(t0, t1).max(), np.maximum(t0, t1).min()
        hit = enter <= leave and leave >= 0 and enter <= nearest
        if link & LEAF_BIT:
            if hit:
                _, first, size = leaf(link)
                nearest = min(nearest, hits(origin, direction, ordered[first : first + size]).min())
            at += 1
        elif link & TREELET_BIT:
            at += 1
            if hit:
                after, at = at, 8 * count + (link & LEAF_FIRST_MASK)
                last = at + (link >> LEAF_COUNT_SHIFT & TREELET_MAX_NODES)
        else:
            at = at + 1 if hit else link
        if at == last:
            at, last = after, None
    return nearest, visited


@pytest.mark.parametrize("name", TRIANGLES)
def test_every_octant_holds_every_primitive_once(name):
    triangles = TRIANGLES[name]
    tree, nodes = build(triangles)
    assert sorted(tree.order) == list(range(len(triangles)))
    assert len(nodes) == 8 * tree.count
    for octant in nodes.reshape(8, -1):
        links = octant["link"][octant["link"] & LEAF_BIT != 0].astype(np.int64)
        places = [np.arange(first, first + count) for _, first, count in map(leaf, links)]
        assert max(map(len, places)) <= LEAF_MAX_COUNT
        assert sorted(np.concatenate(places)) == list(range(len(triangles)))


@pytest.mark.parametrize("name", TRIANGLES)
def test_boxes_hold_what_is_under_them_with_room_to_spare(name):
    triangles = TRIANGLES[name]
    tree, nodes = build(triangles)
    lower, upper = unpack(tree, nodes)
    low, high = (b[tree.order] for b in boxes(triangles))
    assert np.all(upper > lower)
    for octant in range(8):
        ends = []  # (place where it ends, lower, upper) of the boxes around this node
        for at in range(octant * tree.count, (octant + 1) * tree.count):
            while ends and ends[-1][0] == at:
                ends.pop()
            if ends:
                assert np.all(lower[at] >= ends[-1][1]) and np.all(upper[at] <= ends[-1][2])
            link = int(nodes["link"][at])
            if link & LEAF_BIT:
                _, first, count = leaf(link)
                assert np.all(lower[at] < low[first : first + count])
                assert np.all(upper[at] > high[first : first + count])
            else:
                assert at + 2 < link <= (ends[-1][0] if ends else (octant + 1) * tree.count)
                ends.append((link, lower[at], upper[at]))


def rays(triangles, count):
    """In all octants, from outside and from within, towards the triangles, some parallel to axes and planes."""
    rng = np.random.default_rng(RNG_SEED)
    low, high = triangles.min(axis=(0, 1)).astype(np.float64), triangles.max(axis=(0, 1)).astype(np.float64)
    size = (high - low).max()
    directions = [np.array(d) for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)]
    directions += [rng.normal(size=3) for _ in range(count)]
    for k, direction in enumerate(directions):
        triangle = triangles[rng.integers(len(triangles))].astype(np.float64)
        target = rng.dirichlet([1, 1, 1]) @ triangle
        unit = np.float32(direction / np.linalg.norm(direction)).astype(np.float64)
        origin = target - unit * size * (0.05, 1.0, 5.0)[k % 3]
        yield np.float32(origin).astype(np.float64), unit


@pytest.mark.parametrize("treelet", [0, 6])
@pytest.mark.parametrize("name", [n for n in TRIANGLES if n != "needles"])
def test_traversal_finds_what_brute_force_finds(name, treelet):
    triangles = TRIANGLES[name]
    tree, _ = build(triangles)
    nodes, count = bvh.thread(tree, treelet)
    lower, upper = unpack(tree, nodes)
    ordered = triangles[tree.order].astype(np.float64)
    met = 0
    for origin, direction in rays(triangles, 60):
        expected = hits(origin, direction, ordered).min()
        found, _ = trace(tree, nodes, lower, upper, ordered, origin, direction, count)
        assert found == expected
        met += np.isfinite(expected)
    assert met > 20


@pytest.mark.parametrize("split", Split)
@pytest.mark.parametrize("name", ["soup", "same", "flat"])
def test_every_way_of_splitting_makes_a_whole_tree(name, split):
    triangles = TRIANGLES[name]
    tree, nodes = build(triangles, split=split)
    assert sorted(tree.order) == list(range(len(triangles)))
    lower, upper = unpack(tree, nodes)
    ordered = triangles[tree.order].astype(np.float64)
    for origin, direction in rays(triangles, 8):
        found, _ = trace(tree, nodes, lower, upper, ordered, origin, direction)
        assert found == hits(origin, direction, ordered).min()


def test_splits_are_what_they_are_called():
    """In a row of boxes that lie ever farther apart."""
    start = 1.1 ** np.arange(64)[:, None, None] * [1, 0, 0]
    triangles = (start + np.random.default_rng(RNG_SEED).random((64, 3, 3)) * 0.01).astype(np.float32)
    middle = triangles.min(axis=1)[:, 0] + triangles.max(axis=1)[:, 0]
    below = {}
    for split in (Split.OBJECT_MEDIAN, Split.SPATIAL_MEDIAN):
        tree, _ = build(triangles, split=split)
        left = int(tree.rows[0, bvh_build.LINK])
        below[split] = [leaves_under(tree, slot) for slot in (left, left + 1)]
    assert [len(places) for places in below[Split.OBJECT_MEDIAN]] == [32, 32]
    low, high = (middle[places] for places in below[Split.SPATIAL_MEDIAN])
    halfway = (middle.min() + middle.max()) / 2
    assert low.max() < halfway <= high.min() and len(low) > 50


def leaves_under(tree, slot):
    """The primitives of a subtree."""
    link = int(tree.rows[slot, bvh_build.LINK])
    if not link & LEAF_BIT:
        return leaves_under(tree, link) + leaves_under(tree, link + 1)
    _, first, count = leaf(link)
    return tree.order[first : first + count].tolist()


def test_bins_are_those_that_were_asked_for():
    """More bins find better splits; those of the product err little from the most."""
    triangles = soup(3000)
    costs = {split: cost(*build(triangles, split=split)) for split in Split}
    assert costs[Split.SAH_16] < costs[Split.SAH_5] < costs[Split.OBJECT_MEDIAN]
    assert len(set(costs.values())) == len(costs)
    assert costs[Split.SAH] < 1.02 * costs[Split.SAH_16]


def test_near_boxes_come_first():
    triangles = soup(2000)
    tree, nodes = build(triangles)
    lower, upper = unpack(tree, nodes)
    ordered = triangles[tree.order].astype(np.float64)
    octants = nodes.reshape(8, -1)
    visited = {"own": 0, "opposite": 0}
    for origin, direction in rays(triangles, 40):
        visited["own"] += trace(tree, nodes, lower, upper, ordered, origin, direction)[1]
        turned = np.concatenate([octants[7 - o] for o in range(8)])
        shift = (np.arange(8) - np.arange(7, -1, -1)).repeat(tree.count) * tree.count
        inner = turned["link"] & LEAF_BIT == 0
        turned["link"][inner] = (turned["link"][inner].astype(np.int64) + shift[inner]).astype(np.uint32)
        corners = unpack(tree, turned)
        visited["opposite"] += trace(tree, turned, *corners, ordered, origin, direction)[1]
    assert visited["own"] < 0.8 * visited["opposite"]


def cost(tree, nodes):
    """Expected work of a ray that meets the root: boxes and primitives, weighted by area."""
    lower, upper = (b[: tree.count].astype(np.float64) for b in unpack(tree, nodes))
    x, y, z = (upper - lower).T
    area = x * y + y * z + z * x
    link = nodes["link"][: tree.count].astype(np.int64)
    inside = np.where(link & LEAF_BIT, ((link >> LEAF_COUNT_SHIFT) & 15) + 1, 0)
    return float((area * (bvh_build.NODE_COST + inside)).sum() / area[0])


def median_cost(low, high, leaf_size=4):
    """The same for a tree that halves the longest axis of the centroids."""

    def area(ids):
        x, y, z = high[ids].max(axis=0) - low[ids].min(axis=0)
        return x * y + y * z + z * x

    def below(ids):
        if len(ids) <= leaf_size:
            return area(ids) * (bvh_build.NODE_COST + len(ids))
        middle = low[ids] + high[ids]
        ids = ids[np.argsort(middle[:, np.argmax(np.ptp(middle, axis=0))], kind="stable")]
        half = len(ids) // 2
        return area(ids) * bvh_build.NODE_COST + below(ids[:half]) + below(ids[half:])

    everything = np.arange(len(low))
    return below(everything) / area(everything)


@pytest.mark.parametrize("name", ["soup", "dense soup", "terrain", "far"])
def test_costs_less_than_halving(name):
    low, high = (b.astype(np.float64) for b in boxes(TRIANGLES[name]))
    assert cost(*build(TRIANGLES[name])) < median_cost(low, high)


def test_leaves_hold_one_kind_and_count_in_its_own_array():
    triangles = np.concatenate([soup(150), np.repeat(soup(1), 50, axis=0)])
    kinds = np.random.default_rng(RNG_SEED).integers(0, len(ShapeKind), len(triangles)).astype(np.uint8)
    tree = bvh.build(*boxes(triangles), kinds)
    nodes, _ = bvh.thread(tree)
    lower, upper = unpack(tree, nodes)
    own = {kind: [i for i in tree.order if kinds[i] == kind] for kind in ShapeKind}
    seen = []
    for at in np.flatnonzero(nodes["link"] & LEAF_BIT):
        kind, first, count = leaf(int(nodes["link"][at]))
        members = own[ShapeKind(kind)][first : first + count]
        assert len(members) == count
        assert np.all(triangles[members] > lower[at]) and np.all(triangles[members] < upper[at])
        seen += members
    assert sorted(seen) == sorted(list(range(len(triangles))) * 8)


def test_does_not_depend_on_threads(monkeypatch):
    triangles = soup(20_000)
    monkeypatch.setattr(bvh, "WORTH_THREADS", 10**9)
    alone, alone_nodes = build(triangles)
    monkeypatch.setattr(bvh, "WORTH_THREADS", 1000)
    monkeypatch.setattr(bvh.os, "cpu_count", lambda: 3)
    shared, shared_nodes = build(triangles)
    assert len(alone.regions) == 1 < len(shared.regions)
    assert np.array_equal(alone.order, shared.order)
    assert np.array_equal(alone_nodes, shared_nodes)


@pytest.mark.parametrize("name", ["soup", "terrain", "same", "needles"])
def test_treelets_are_kept_once(name):
    tree, _ = build(TRIANGLES[name])
    for treelet in (2, 9, TREELET_MAX_NODES):
        nodes, count = bvh.thread(tree, treelet)
        links = nodes["link"].astype(np.int64)
        below = links[8 * count :]
        for top in links[: 8 * count].reshape(8, -1):
            roots = top[(top & (LEAF_BIT | TREELET_BIT)) == TREELET_BIT]
            firsts, sizes = roots & LEAF_FIRST_MASK, roots >> LEAF_COUNT_SHIFT & TREELET_MAX_NODES
            assert sizes.max(initial=2) <= treelet
            assert sorted(np.concatenate([np.arange(a, a + n) for a, n in zip(firsts, sizes, strict=True)], dtype=int)
                          if len(roots) else []) == list(range(len(below)))  # fmt: skip
            leaves = np.concatenate([top, below])
            places = [np.arange(f, f + n) for _, f, n in map(leaf, leaves[leaves & LEAF_BIT != 0])]
            assert sorted(np.concatenate(places)) == list(range(len(TRIANGLES[name])))


def test_large_trees_take_few_bytes():
    tree = bvh.build(*boxes(soup(20_000)), np.full(20_000, ShapeKind.TRIANGLE, np.uint8))
    nodes, count = bvh.thread(tree)
    assert tree.count > bvh.WHOLE and nodes.nbytes < 0.2 * 8 * 16 * tree.count
    assert len(nodes) > 8 * count


def test_large_scenes_fill_their_leaves(monkeypatch):
    monkeypatch.setattr(bvh, "LARGE", 100)
    tree, nodes = build(soup(600))
    assert len(nodes) == 8 * tree.count
    assert tree.count < 300  # 8 a leaf, where splits by area would leave between 1 and 2
    monkeypatch.setattr(bvh, "MAX_PRIMITIVES", 500)
    with pytest.raises(SceneTooLarge):
        build(soup(600))
