"""Lights picked by where they are: exactly as often as it is said, none missed that gives light, one picture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, SceneArrays, layout
from gpu.accel import light_tree
from gpu.kernels.features import flags
from gpu.layout import LightKind
from service.document import parse_scene
from service.pack import PackCache, pack
from service.pack.lights import light_bounds
from tests import stats
from tests.extremes.scenes import Seen, everything, scaled
from tests.light_trees import Picker, clusters_of, head_of, nodes_of, ways
from tests.rendering import Images, document

Doc = dict[str, Any]
MATERIALS: Doc = {
    "m": {"type": "diffuse", "albedo": 0.5},
    **{f"lamp {k}": {"type": "diffuse", "albedo": 0, "emission": 10.0**k} for k in (-2, 0, 1, 3)},
    "both": {"type": "diffuse", "albedo": 0, "emission": 4, "emission_sides": "both"},
}
LAMPS = [name for name in MATERIALS if name != "m"]


def _room(seed: int, count: int = 60, spread: float = 1.0, **more: Any) -> Doc:
    """Lamps of every kind, size, side and brightness about the origin."""
    rng = np.random.default_rng(seed)
    shapes: list[Doc] = []
    standing: list[Doc] = []
    for i in range(count):
        at, size = rng.normal(size=3) * spread, 10 ** rng.uniform(-2.5, 0) * spread
        u, v = rng.normal(size=(2, 3)) * size
        name = LAMPS[rng.integers(len(LAMPS))]
        here = {"material": name, "transform": {"translate": at.tolist()}}
        kind = i % 7
        if kind == 0:
            shapes.append({"type": "sphere", "center": at.tolist(), "radius": size, "material": name})
        elif kind == 1:
            shapes.append({"type": "quad", "origin": at.tolist(), "u": u.tolist(), "v": v.tolist(), "material": name})
        elif kind == 2:
            corners = [[0, 0, 0], u.tolist(), v.tolist()]
            shapes.append({"type": "mesh", "vertices": corners, "faces": [[0, 1, 2]], "smooth": False, **here})
        elif kind == 3:
            turn = {"scale": (size * rng.uniform(0.2, 1, 3)).tolist(), "rotate": rng.uniform(0, 360, 3).tolist()}
            ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1}
            shapes.append({**ball, "material": name, "transform": {"translate": at.tolist(), **turn}})
        elif kind == 4:
            tube = {
                "type": "cylinder",
                "base": [-0.2, 0, 0.1],
                "axis": u.tolist(),
                "radius": float(np.linalg.norm(v)),
            }
            shapes.append({**tube, "caps": False, **here})
        elif kind == 5:
            standing.append({"type": "point", "position": at.tolist(), "intensity": 10 ** rng.uniform(-2, 2)})
        else:
            outer = float(rng.uniform(1, 90))
            beam = {"outer_angle": outer, "inner_angle": outer * float(rng.choice([0, 0.5, 1]))}
            spot = {"type": "spot", "position": at.tolist(), "direction": rng.normal(size=3).tolist()}
            standing.append({**spot, **beam, "intensity": 10 ** rng.uniform(-2, 2)})
    return document(shapes, MATERIALS, lights=standing, **more)


def _packed(scene: Doc) -> SceneArrays:
    used = {shape["material"] for shape in scene["shapes"]}
    kept = {name: m for name, m in scene["materials"].items() if name in used}
    return pack(parse_scene({**scene, "materials": kept}), Images()).arrays


@pytest.fixture
def pickers(gpu: Renderer) -> Iterator[Any]:
    made: list[Picker] = []

    def picker(arrays: SceneArrays) -> Picker:
        made.append(Picker(gpu, arrays))
        return made[-1]

    yield picker
    for one in made:
        one.close()


SUNS = {
    "lights": [{"type": "directional", "direction": [0, -1, 0.1], "irradiance": 2}] * 2,
    "environment": {"type": "constant", "radiance": 0.1},
}


def _places(seed: int, count: int, spread: float = 1.0) -> Iterator[tuple[np.ndarray, np.ndarray, bool]]:
    rng = np.random.default_rng(seed)
    for i in range(count):
        n = rng.normal(size=3)
        yield rng.normal(size=3) * spread * 10 ** rng.uniform(-1, 1), n / np.linalg.norm(n), i % 3 == 0


def test_lights_are_drawn_as_often_as_they_say(pickers: Any) -> None:
    scene = _room(1)
    arrays = _packed({**scene, **SUNS, "lights": scene["lights"] + SUNS["lights"]})
    picker = pickers(arrays)
    assert len(arrays.lights) == 63 and set(arrays.lights["kind"]) == set(LightKind)
    bits = np.random.default_rng(2).integers(0, 1 << 32, 200_000, dtype=np.uint32)
    for p, n, through in _places(3, 6):
        p = p.astype(np.float32) - arrays.origin
        chances, _ = picker.chances(p, n, through)
        assert chances.sum() == pytest.approx(1, abs=1e-5) and chances.min() > 0
        which, said = picker.drawn(bits, p, n, through)
        np.testing.assert_allclose(said, chances[which], rtol=1e-5)
        counts = np.bincount(which, minlength=len(chances))
        assert stats.chi_square(counts, chances * len(bits)) > stats.sidak(1e-3, 6)
    far = np.isin(arrays.lights["kind"], [LightKind.DIRECTIONAL, LightKind.ENVIRONMENT])
    shares = [picker.chances(p, n)[0][far].sum() for p, n, _ in _places(4, 3)]
    assert shares == pytest.approx([shares[0]] * 3)  # a fixed share, wherever light is asked for


def _ceiling(count: int = 20) -> Doc:
    """A grid of lamps that face down, of several brightnesses."""
    shapes = [
        {
            "type": "quad",
            "origin": [x, 3, z],
            "u": [0.05, 0, 0],
            "v": [0, 0, 0.05],
            "material": LAMPS[(3 * x + z) % 4],
        }
        for x in range(count)
        for z in range(count)
    ]
    return document(shapes, MATERIALS)


def test_far_clusters_are_drawn_as_often_as_they_say(pickers: Any) -> None:
    """Walks from under the lamps end at lamps nearby and at clusters elsewhere; from far away at clusters alone."""
    arrays = _packed(_ceiling())
    picker = pickers(arrays)
    clusters = clusters_of(arrays.light_tree)
    bits = np.random.default_rng(3).integers(0, 1 << 32, 400_000, dtype=np.uint32)
    for p, least, most in (((10, 2.8, 10), 0.5, 0.75), ((10, 0, 10), 0.75, 0.9), ((-30, -20, 40), 1.0, 1.0)):
        place = np.float32(p) - arrays.origin
        chances, _ = picker.chances(place, (0, 1, 0))
        assert chances.sum() == pytest.approx(1, abs=1e-5) and chances.min() > 0
        which, said = picker.drawn(bits, place, (0, 1, 0))
        np.testing.assert_allclose(said, chances[which], rtol=1e-5)
        counts = np.bincount(which, minlength=len(chances))
        assert stats.chi_square(counts, chances * len(bits)) > stats.sidak(1e-3, 3)
        # In a cluster where walks end, lamps differ in their chances by intensity alone.
        even = arrays.lights["probability"]
        rates = (chances - even) / arrays.lights["threshold"]
        ended = {k for some in clusters for k in some if np.ptp(rates[some]) < 1e-3 * rates[some].mean()}
        assert least <= len(ended) / len(rates) <= most


def test_near_numbers_draw_near_lights(pickers: Any) -> None:
    """What a stratified sampler had gained is kept: in order, the numbers go through the lights once."""
    arrays = _packed(_room(5))
    even = int(head_of(arrays.light_tree)["even"]) << 2
    bits = np.linspace(even, (1 << 32) - 1, 50_000).astype(np.uint32)
    which, _ = pickers(arrays).drawn(bits, (0.3, 0.2, 0.1), (0, 1, 0))
    assert (np.diff(which) != 0).sum() == len(set(which.tolist())) - 1


def _outline(arrays: SceneArrays, k: int) -> tuple[np.ndarray, np.ndarray | None]:
    """Places (n, 3) of light k, and the unit normals there of a shape, float64."""
    light = arrays.lights[k]
    kind = LightKind(int(light["kind"]))
    rng = np.random.default_rng(k)
    if kind in (LightKind.SPHERE, LightKind.ELLIPSOID, LightKind.CYLINDER):
        q = rng.normal(size=(400, 3)) * [1, kind != LightKind.CYLINDER, 1]
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        if kind == LightKind.SPHERE:
            ball = arrays.spheres[light["index"]]
            return ball["center"] + float(ball["radius"]) * q, q
        solid = (arrays.ellipsoids if kind == LightKind.ELLIPSOID else arrays.boxes)[light["index"]]
        rows = np.stack([solid["row_x"], solid["row_y"], solid["row_z"]]).astype(float)
        out = q @ rows
        along = rng.uniform(-1, 1, (400, 1)) * [0, kind == LightKind.CYLINDER, 0]
        return solid["center"] + (q + along) @ np.linalg.inv(rows).T, out / np.linalg.norm(out, axis=1, keepdims=True)
    a, b = rng.random((2, 400, 1))
    if kind == LightKind.QUAD:
        quad = arrays.quads[light["index"]]
        places = quad["origin"] + a * quad["u"].astype(float) + b * quad["v"].astype(float)
        return places, np.broadcast_to(quad["normal"].astype(float), places.shape)
    if kind == LightKind.TRIANGLE:
        tri = arrays.triangles[light["index"]]
        v0, v1, v2 = (tri[name].astype(float) for name in ("v0", "v1", "v2"))
        across = np.cross(v1 - v0, v2 - v0)
        places = v0 + np.minimum(a, b) * (v1 - v0) + np.abs(a - b) * (v2 - v0)
        return places, np.broadcast_to(across / np.linalg.norm(across), places.shape)
    return light["position"].astype(float)[None], None


def _lit(arrays: SceneArrays, k: int, p: np.ndarray, n: np.ndarray, through: bool) -> bool:
    """Whether any of many places of light k sends light to p from in front of n."""
    light = arrays.lights[k]
    both = arrays.materials["emission_sides"][light["material"]] == 2
    places, out = _outline(arrays, k)
    wi = places - p
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    lit = wi @ n > 1e-5
    if through:
        lit |= wi @ n < -1e-5
    if out is not None and not both:
        lit &= np.einsum("ij,ij->i", out, wi) < -1e-5
    if light["kind"] == LightKind.SPOT:
        d = light["direction"].astype(float)
        off = d + np.linalg.norm(d) * wi[0]
        lit &= float(light["spread"]) - off @ off > 1e-4
    return bool(lit.any())


@pytest.mark.parametrize("spread", [1.0, 1e-4, 1e5])
def test_no_light_that_gives_anything_is_held_for_dark(pickers: Any, spread: float) -> None:
    """In the air, on lamps, at their edges and in the middle of them, from facing surfaces and from glass."""
    lit, dark = 0, 0
    for seed in range(4):
        arrays = _packed(_room(10 + seed, 48, spread))
        picker = pickers(arrays)
        own = nodes_of(arrays.light_tree).center[[way[-1] for way in ways(arrays)]]
        rng = np.random.default_rng(seed)
        places = [*_places(20 + seed, 8, spread)]
        for k in rng.integers(0, len(own), 6).tolist():  # on a lamp, or as near as float32 can be
            n = rng.normal(size=3)
            places.append((own[k], n / np.linalg.norm(n), False))
        quads = arrays.quads[arrays.quads["light"] != layout.NONE]
        for quad in quads[:3]:  # on its edge, along it
            places.append((quad["origin"].astype(float), quad["normal"].astype(float), False))
            u = quad["u"].astype(float)
            places.append((quad["origin"] + 0.5 * u, u / np.linalg.norm(u), False))
        for p, n, through in places:
            p = p.astype(np.float32)
            _, least = picker.chances(p, n, through)
            for k in range(len(arrays.lights)):
                if _lit(arrays, k, p.astype(float), n, through):
                    assert least[k] > 0, (seed, k, p, n)
                    lit += 1
                else:
                    dark += least[k] == 0
    assert lit > 1500 and dark > 500  # and what is behind, or turned away, is mostly known


def test_nodes_hold_what_is_under_them() -> None:
    arrays = _packed(_room(30, 90))
    nodes = nodes_of(arrays.light_tree)
    paths = ways(arrays)
    assert max(map(len, paths)) < 16 and len(nodes.link) == 2 * len(arrays.lights)
    step = 1 / float(head_of(arrays.light_tree)["inverse_step"])
    for k, way in enumerate(paths):
        places, out = _outline(arrays, k)
        both = arrays.materials["emission_sides"][arrays.lights["material"][k]] == 2
        for node in way:
            assert np.linalg.norm(places - nodes.center[node], axis=1).max() <= nodes.radius[node]
            if out is not None and not both:
                assert np.arccos(np.clip(out @ nodes.axis[node], -1, 1)).max() <= nodes.cone[node] + 1e-6
                assert nodes.beyond[node] == pytest.approx(np.pi / 2)
        assert nodes.radius[way[-1]] <= 1.4 * np.linalg.norm(np.ptp(places, axis=0)) + 2 * step  # nor much more
        above = [sum(nodes.intensity[p[-1]] for p in paths if node in p) for node in way[:-1]]
        np.testing.assert_allclose(nodes.intensity[way[:-1]], above, rtol=0.08)


def test_one_light_is_no_tree(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(light_bounds, "worth", lambda _: True)
    with pytest.raises(ValueError, match="1 lights"):
        _packed(document([], MATERIALS, lights=[{"type": "point", "position": [0, 1, 0], "intensity": 1}]))


def test_packed_in_pieces_it_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = _packed(_room(31)).light_tree
    monkeypatch.setattr(light_tree, "PIECE", 7)
    assert np.array_equal(_packed(_room(31)).light_tree, whole)


ODD: dict[str, list[Doc]] = {
    "one place": [{"type": "point", "position": [1, 2, 3], "intensity": 1}] * 40,
    "ever brighter": [{"type": "point", "position": [i, 0, 0], "intensity": 10.0 ** (i - 20)} for i in range(40)],
    "ever farther": [{"type": "point", "position": [2.0**i * 1e-3, 0, 0], "intensity": 1} for i in range(40)],
    "far away": [{"type": "point", "position": [9e8 + i, -1e9, i], "intensity": 1e20} for i in range(40)],
}  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_odd_crowds_are_drawn_as_often_as_they_say(pickers: Any, name: str) -> None:
    arrays = _packed(document([], MATERIALS, lights=ODD[name]))
    assert max(map(len, ways(arrays))) <= 32
    picker, bits = pickers(arrays), np.random.default_rng(1).integers(0, 1 << 32, 20_000, dtype=np.uint32)
    for p in ((0, 0, 0), (1, 2, 3), (1e9, -1e9, 1e9)):
        chances, _ = picker.chances(p, (0, 1, 0))
        assert chances.sum() == pytest.approx(1, abs=1e-5)
        assert chances.min() > 0.02 / 40  # none is lost, whatever the others are
        counts = np.bincount(picker.drawn(bits, p, (0, 1, 0))[0], minlength=40)
        assert stats.chi_square(counts, chances * len(bits)) > stats.sidak(1e-3, 12)


def _both(gpu: Renderer, monkeypatch: pytest.MonkeyPatch, scene: Doc, **settings: Any) -> tuple[Seen, Seen]:
    """By the tree, and by the table of powers that small scenes have."""
    seen = []
    for worth in (True, False):
        monkeypatch.setattr(light_bounds, "worth", lambda _, worth=worth: worth)
        seen.append(
            Seen(gpu, scene, **{"samples": 128, "sampler": "independent", "width": 48, "height": 32, **settings})
        )
    return seen[0], seen[1]


@pytest.mark.slow
def test_the_picture_is_that_of_the_table(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every shape, light and material, glass and the two-sided among them."""
    tree, table = _both(gpu, monkeypatch, everything(), max_bounces=4)
    assert tree.deviation(table, 16) < 2.0
    error = np.sqrt(tree.variance.mean() + table.variance.mean()) / np.sqrt(48 * 32)
    assert abs(tree.color.mean() - table.color.mean()) < 5 * error


@pytest.mark.parametrize("factor", [1e-4, 1e5])
def test_in_any_size_it_is_the_same(gpu: Renderer, factor: float) -> None:
    one, other = Seen(gpu, everything(), max_bounces=2), Seen(gpu, scaled(everything(), factor), max_bounces=2)
    assert other.alike(one) > 0.99


def _hall(count: int) -> Doc:
    """A long low room under many small lamps."""
    rng = np.random.default_rng(3)
    walls = [
        ([0, 0, 0], [0, 0, 8], [40, 0, 0]),
        ([0, 4, 0], [40, 0, 0], [0, 0, 8]),
        ([0, 0, 0], [40, 0, 0], [0, 4, 0]),
    ]
    shapes: list[Doc] = [{"type": "quad", "origin": o, "u": u, "v": v, "material": "m"} for o, u, v in walls]
    for center in rng.uniform((0, 3, 0), (40, 4, 8), (count, 3)).tolist():
        shapes.append({"type": "sphere", "center": center, "radius": 0.03, "material": "lamp 3"})
    camera = {"position": [1, 1.7, 4.4], "target": [20, 1.3, 3.6], "vfov": 60}
    return document(shapes, {k: MATERIALS[k] for k in ("m", "lamp 3")}, camera=camera)


@pytest.mark.slow
def test_it_pays(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """The relative variance of as many samples in a hall of 100 lamps; less than a third was measured."""
    tree, table = (seen.variance / (seen.color**2 + 0.01) for seen in _both(gpu, monkeypatch, _hall(100), samples=64))
    assert table.mean() > 2.5 * tree.mean()


def test_lights_in_one_place_keep_their_table_and_raise_no_flag() -> None:
    def packed(*places: float, **more: Any) -> SceneArrays:
        balls = [
            {"type": "sphere", "center": [x, 0, 0], "radius": 1, "material": f"lamp {k}"}
            for k, x in zip((0, 1, 3, -2), places, strict=False)
        ]
        return _packed(document(balls, MATERIALS, **more))

    corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    square = {"type": "mesh", "vertices": corners, "faces": [[0, 1, 2], [0, 2, 3]], "material": "lamp 0"}
    for alike in (
        packed(0),
        packed(0, 2),
        packed(0, 2, 4),
        _packed(document([square], MATERIALS)),
        packed(0, **SUNS),
    ):
        assert "HAS_LIGHT_TREE" not in flags(alike) and not len(alike.light_tree)
        assert alike.lights["probability"].sum() == pytest.approx(1)
    for several in (packed(0, 5), packed(0, 2, 5), packed(0, 2, 4, 6), packed(0, 5, **SUNS)):
        assert "HAS_LIGHT_TREE" in flags(several)


def test_a_large_tree_is_kept_while_its_lights_are() -> None:
    n = 48
    x, z = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    at = np.arange((n + 1) * n).reshape(n, n + 1)[:, :-1].reshape(-1)
    faces = np.concatenate([np.stack([at, at + 1, at + n + 2], 1), np.stack([at, at + n + 2, at + n + 1], 1)])
    vertices = np.stack([x, 0 * x, z], -1).reshape(-1, 3)
    mesh = {"type": "mesh", "material": "lamp 0", "faces": faces.tolist(), "vertices": vertices.tolist()}
    cache = PackCache()

    def tree(x: float, **lamp: Any) -> np.ndarray:
        ball = {"type": "sphere", "center": [x, 3, 0], "radius": 1, "material": "m"}
        materials = {"m": MATERIALS["m"], "lamp 0": {**MATERIALS["lamp 0"], **lamp}}
        return pack(parse_scene(document([mesh, ball], materials)), Images(), cache).arrays.light_tree

    first = tree(0)
    assert len(nodes_of(first).link) == 2 * 2 * n * n
    assert tree(0.25) is first  # a ball moved
    assert tree(0.25, emission=[6, 5, 4]) is first  # all lights are as many times as bright


def test_a_tree_is_the_same_with_another_share() -> None:
    lights = np.random.default_rng(1).uniform(size=(9, 3))
    flat, ones = np.tile([0.0, 0.0, 1.0], (9, 1)), np.ones(9)
    given = (lights, lights, 0 * ones, flat, -ones, 0 * ones, ones)
    (words, *_), (other, _, even, _) = (light_tree.build(*given, share, 2.0) for share in (1.0, 0.3))
    again, even_again = light_tree.with_share(words, 9, 0.3)
    assert np.array_equal(again, other) and even_again == even and not np.array_equal(again, words)
