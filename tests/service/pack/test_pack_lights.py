"""What shines, how often it is picked, and where the tree keeps what is many."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from gpu import layout
from gpu.kernels.features import counts, flags
from gpu.layout import LightKind, ShapeBit, ShapeKind
from service.document import parse_scene
from service.pack.lights import light_bounds, lights
from service.pack.textured_emission import nearest
from service.pack.textures.words import pack_textures
from tests.documents import GREY, LAMP, Shelf, box, document, matrix_of, mesh, packed, picture, quad, sphere

MANY = {
    ShapeKind.SPHERE: ("spheres", 8, lambda i: sphere(center=[3 * i, 0, 0])),
    ShapeKind.QUAD: ("quads", 24, lambda i: quad(origin=[3 * i, 0, 0])),
    ShapeKind.BOX: ("boxes", 8, lambda i: box(transform={"translate": [9 * i, 0, 0]})),
    ShapeKind.ELLIPSOID: ("ellipsoids", 6, lambda i: sphere(center=[3 * i, 0, 0], transform={"scale": [1, 2, 1]})),
}


@pytest.mark.parametrize("kind", MANY)
def test_many_of_a_kind_go_through_the_tree(kind):
    name, few, make = MANY[kind]
    arrays = packed(*map(make, range(few))).arrays
    assert not arrays.bvh_kinds and not len(arrays.nodes)
    arrays = packed(sphere(radius=5), *map(make, range(few + 1)), quad(origin=[0, -9, 0])).arrays
    assert arrays.bvh_kinds == {kind}
    assert len(arrays.nodes) % 8 == 0 and len(arrays.nodes)
    assert set(range(1, few + 2)) <= set(getattr(arrays, name)["shape"].tolist())


def test_leaves_point_at_what_their_boxes_hold():
    rng = np.random.default_rng(5)
    shapes = [sphere(center=c, radius=0.1) for c in rng.random((40, 3)).tolist()]
    shapes += [quad(origin=c, u=[0.1, 0, 0], v=[0, 0.1, 0]) for c in rng.random((40, 3)).tolist()]
    shapes += [mesh(transform={"translate": c, "scale": 0.1}) for c in rng.random((10, 3)).tolist()]
    arrays = packed(*shapes).arrays
    assert arrays.bvh_kinds == {ShapeKind.SPHERE, ShapeKind.QUAD, ShapeKind.TRIANGLE}
    reach = {
        ShapeKind.SPHERE: (arrays.spheres["center"], arrays.spheres["radius"][:, None]),
        ShapeKind.QUAD: (arrays.quads["origin"] + (arrays.quads["u"] + arrays.quads["v"]) / 2, np.float32(0.0)),
        ShapeKind.TRIANGLE: (arrays.triangles["v1"], np.float32(0.0)),
    }
    found = {kind: set() for kind in arrays.bvh_kinds}
    for node in arrays.nodes[: len(arrays.nodes) // 8]:
        link = int(node["link"])
        if not link & layout.LEAF_BIT:
            continue
        kind = ShapeKind((link >> layout.LEAF_KIND_SHIFT) & 7)
        first, count = link & layout.LEAF_FIRST_MASK, ((link >> layout.LEAF_COUNT_SHIFT) & 15) + 1
        words = np.array([int(node[axis]) for axis in "xyz"])
        lower = np.array(arrays.node_origin) + (words & 0xFFFF) * np.array(arrays.node_scale)
        upper = np.array(arrays.node_origin) + (words >> 16) * np.array(arrays.node_scale)
        middle, radius = reach[kind]
        radius = np.broadcast_to(radius, (len(middle), 1))
        for i in range(first, first + count):
            assert np.all(lower <= middle[i] - radius[i]) and np.all(middle[i] + radius[i] <= upper)
            found[kind].add(i)
    assert {kind: len(indices) for kind, indices in found.items()} == {
        ShapeKind.SPHERE: 40, ShapeKind.QUAD: 40, ShapeKind.TRIANGLE: 120,
    }  # fmt: skip


def test_the_few_large_stand_out_of_the_tree_and_come_first():
    """Walls among small lamps, a globe under small balls: in the loop, in the way of nobody who asks the tree."""
    walls = [quad(origin=[0, 0, 0], u=[9, 0, 0], v=[0, 8, 0]), quad(origin=[0, 0, 9], u=[9, 0, 0], v=[0, 9, 0])]
    lamps = [quad(origin=[i % 6, 5, i // 6], u=[0.1, 0, 0], v=[0, 0, 0.1], material="lamp") for i in range(36)]
    balls = [sphere(center=[i, 1, 1], radius=0.1) for i in range(12)]
    arrays = packed(*lamps[:20], *walls, *lamps[20:], *balls, sphere(center=[4, -90, 4], radius=88)).arrays
    assert arrays.large == {ShapeKind.SPHERE: 1, ShapeKind.QUAD: 2}
    assert arrays.quads["shape"][:2].tolist() == [21, 20] and arrays.spheres["shape"][0] == 50
    assert sorted(arrays.quads["shape"]) == list(range(38))
    links = arrays.nodes["link"][: len(arrays.nodes) // 8]
    leaves = links[links & layout.LEAF_BIT != 0]
    found = {ShapeKind.SPHERE: set(), ShapeKind.QUAD: set()}
    for link in leaves.tolist():
        first, count = link & layout.LEAF_FIRST_MASK, ((link >> layout.LEAF_COUNT_SHIFT) & 15) + 1
        found[ShapeKind((link >> layout.LEAF_KIND_SHIFT) & 7)] |= set(range(first, first + count))
    assert found == {ShapeKind.SPHERE: set(range(1, 13)), ShapeKind.QUAD: set(range(2, 38))}
    assert np.array_equal(arrays.quads["light"] == layout.NONE, np.isin(arrays.quads["shape"], [20, 21]))
    assert {"HAS_QUADS", "HAS_BVH_QUADS", "HAS_SPHERES", "HAS_BVH_SPHERES"} <= flags(arrays)
    assert (counts(arrays)["QUAD_COUNT"], counts(arrays)["SPHERE_COUNT"]) == (2, 1)
    assert counts(arrays)["QUAD_LAMP"] == -1


def test_shapes_of_about_one_size_all_go_through_the_tree():
    assert not any(packed(*[sphere(center=[3 * i, 0, 0]) for i in range(9)]).arrays.large.values())


KINDS = {
    LightKind.SPHERE: "spheres",
    LightKind.QUAD: "quads",
    LightKind.ELLIPSOID: "ellipsoids",
    LightKind.TRIANGLE: "triangles",
    LightKind.CYLINDER: "boxes",
}
SHINING = [
    sphere(material="lamp"),
    *[quad(origin=[3 * i, 0, 0], material=("lamp", "grey")[i % 2]) for i in range(30)],
    sphere(material="lamp", transform={"scale": [1, 2, 1]}),
    *[mesh(transform={"translate": [0, 0, 3 * i]}, material=("grey", "lamp")[i % 2]) for i in range(4)],
    {"type": "cylinder", "base": [0, 1, 0], "axis": [0, 1, 0], "radius": 1, "caps": False, "material": "lamp"},
    box(material="grey"),
    sphere(),
]


@pytest.mark.parametrize("transform", [{}, {"scale": [1, 3, 0.2], "rotate": [20, 30, 40]}])
def test_the_area_of_a_cylinders_side(transform):
    """Against that of a prism of many faces."""
    pipe = {"type": "cylinder", "base": [1, 2, 3], "axis": [1, -2, 2], "radius": 0.4, "material": "lamp"}
    arrays = packed({**pipe, "transform": transform}).arrays
    sides = arrays.lights[arrays.lights["kind"] == LightKind.CYLINDER]
    (area,) = lights.areas({ShapeKind.BOX: arrays.boxes, ShapeKind.QUAD: arrays.quads,
                            ShapeKind.SPHERE: arrays.spheres, ShapeKind.ELLIPSOID: arrays.ellipsoids,
                            ShapeKind.TRIANGLE: arrays.triangles}, sides)  # fmt: skip
    across = np.linalg.svd(np.array([[1.0, -2, 2]]))[2][1:]
    turn = np.linspace(0, 2 * np.pi, 20_001)
    rim = 0.4 * np.stack([np.cos(turn), np.sin(turn)], 1) @ across
    matrix = matrix_of(transform)[:3, :3]
    faces = np.cross(np.diff(rim, axis=0) @ matrix.T, matrix @ [1, -2, 2])
    assert area == pytest.approx(np.linalg.norm(faces, axis=1).sum(), rel=1e-4)
    if not transform:
        assert area == pytest.approx(2 * np.pi * 0.4 * 3, rel=1e-5)


def test_lights_and_shapes_name_each_other():
    point = {"type": "point", "position": [1, 2, 3], "intensity": [1, 2, 3]}
    dark = {"type": "point", "position": [0, 0, 0], "intensity": 0}
    arrays = packed(*SHINING, lights=[dark, point], environment={"type": "constant", "radiance": 1}).arrays
    assert arrays.bvh_kinds == {ShapeKind.QUAD, ShapeKind.TRIANGLE}
    counts = {kind: int((arrays.lights["kind"] == kind).sum()) for kind in LightKind}
    assert counts == {
        LightKind.SPHERE: 1, LightKind.QUAD: 15, LightKind.ELLIPSOID: 1, LightKind.TRIANGLE: 24,
        LightKind.POINT: 1, LightKind.ENVIRONMENT: 1, LightKind.SPOT: 0, LightKind.DIRECTIONAL: 0,
        LightKind.CYLINDER: 1,
    }  # fmt: skip
    (lit,) = np.flatnonzero(arrays.materials["emission"].any(axis=1))
    for i, light in enumerate(arrays.lights):
        if name := KINDS.get(LightKind(int(light["kind"]))):
            shape = getattr(arrays, name)[light["index"]]
            assert shape["light"] == i and shape["material"] == light["material"] == lit
    for name in KINDS.values():
        shapes = getattr(arrays, name)
        assert np.array_equal(shapes["light"] != layout.NONE, shapes["material"] == lit)
    lamp = arrays.lights[arrays.lights["kind"] == LightKind.POINT][0]
    assert lamp["position"].tolist() == [1, 2, 3] and lamp["intensity"].tolist() == [1, 2, 3]


def test_lights_are_picked_as_their_records_say(by_power):
    lights = packed(*SHINING, environment={"type": "constant", "radiance": 1}).arrays.lights
    drawn = lights["threshold"].astype(float)
    np.add.at(drawn, lights["alias"], 1 - lights["threshold"].astype(float))
    np.testing.assert_allclose(lights["probability"], drawn / len(lights), rtol=1e-6)
    assert lights["probability"].min() > 0


@pytest.fixture
def by_power(monkeypatch):
    """As if all lights were in one place, where there is no tree of them."""
    monkeypatch.setattr(light_bounds, "worth", lambda _: False)


def pick(*shapes, **fields):
    return packed(*shapes, **fields).arrays.lights["probability"].astype(float)


def test_stronger_lights_are_picked_more_often(by_power):
    quads = [quad(material="lamp"), quad(material="lamp", u=[2, 0, 0], v=[0, 3, 0])]
    one, six = pick(*quads)
    assert (one - 0.025) * 6 == pytest.approx(six - 0.025, rel=1e-5)  # 5 % go to all alike
    # A ball of radius 1 and radiance L sends out pi L 4 pi; a point of pi L in all directions just as much.
    point = {"type": "point", "position": [0, 3, 0], "intensity": [4 * np.pi, 2 * np.pi, np.pi]}
    assert pick(sphere(material="lamp"), lights=[point]) == pytest.approx([0.5, 0.5])
    solid = sphere(material="lamp", transform={"scale": [1, 1, 1.00001]})
    assert pick(sphere(material="lamp"), solid) == pytest.approx([0.5, 0.5], abs=1e-4)
    tetra = packed(mesh(material="lamp", transform={"scale": [1, 1, 2]}))
    areas = np.linalg.norm(np.cross(tetra.arrays.triangles["v1"] - tetra.arrays.triangles["v0"],
                                    tetra.arrays.triangles["v2"] - tetra.arrays.triangles["v0"]), axis=1)  # fmt: skip
    shares = tetra.arrays.lights["probability"][tetra.arrays.triangles["light"]]
    np.testing.assert_allclose(shares, 0.95 * areas / areas.sum() + 0.05 / 12, rtol=1e-5)


def test_neither_the_sky_nor_the_lamps_starve():
    for radiance in (1e-20, 1e20):
        probability = pick(sphere(material="lamp"), environment={"type": "constant", "radiance": radiance})
        assert probability.min() >= 0.19
    assert pick(environment={"type": "constant", "radiance": 1}).tolist() == [1]


def test_brightness_of_the_sky_edits_no_table():
    tables = [
        packed(*SHINING, environment={"type": "constant", "radiance": 1, "scale": s}).arrays.lights for s in (1, 50)
    ]
    assert np.array_equal(*tables)


@pytest.mark.parametrize(
    "environment", [{"type": "constant", "radiance": 0}, {"type": "constant", "radiance": 1, "scale": 0}]
)
def test_black_sky_is_seen_but_no_light(environment):
    arrays = packed(sphere(), environment=environment).arrays
    assert arrays.environment is not None and not len(arrays.lights)


def test_radiance_scale_is_a_power_of_two_near_the_peak():
    assert packed(sphere()).arrays.radiance_scale == 1
    assert packed(sphere(material="lamp")).arrays.radiance_scale == 4
    assert packed(environment={"type": "constant", "radiance": 1e20}).arrays.radiance_scale == 2.0**66


def sky_of(pixels, is_8bit=False, **fields):
    environment = {"type": "image", "asset": "sha256:sky", **fields}
    return packed(assets=Shelf(sky=picture(pixels, is_8bit)), environment=environment)


def test_image_environment_is_taken_as_it_is():
    pixels = np.random.default_rng(1).random((4, 8, 4), dtype=np.float32)
    environment = sky_of(pixels, rotation=450, scale=2, background=False).arrays.environment
    assert np.array_equal(environment.texels, pixels[..., :3])
    assert environment.rotation == pytest.approx(np.pi / 2) and environment.scale == 2 and not environment.background
    assert len(environment.cells) >= 8 and environment.probability.shape == (4, 8)
    assert np.array_equal(sky_of(pixels[..., :1]).arrays.environment.texels, np.repeat(pixels[..., :1], 3, axis=2))


def test_eight_bits_are_decoded_from_srgb():
    texels = sky_of(np.full((1, 2, 3), [0.0, 5 / 255, 128 / 255]), is_8bit=True).arrays.environment.texels
    np.testing.assert_allclose(texels[0, 0], [0, 5 / 255 / 12.92, 0.21586050], rtol=1e-5)


def test_texels_out_of_range_are_clamped_with_a_warning():
    result = sky_of([[[-1, 0.5, 2], [1e30, 0, 0], [1, 1, 1]]])
    assert result.arrays.environment.texels.min() == 0
    assert result.arrays.environment.texels.max() == np.float32(1e20)
    assert result.warnings == [
        "/environment/asset: 1 negative texels raised to 0",
        "/environment/asset: 1 texels beyond 1e+20 lowered to it",
    ]
    bright = sky_of([[[1e18, 0, 0]]], scale=1e6)
    assert bright.arrays.environment.scale * 1e18 == pytest.approx(1e20)
    assert bright.warnings[0].startswith("/environment/scale: ")


POINT = {"type": "point", "position": [0, 3, 0], "intensity": 2}
SPOT = {
    "type": "spot", "position": [1, 2, 3], "direction": [0, 0, -5], "intensity": [1, 2, 3], "inner_angle": 20,
    "outer_angle": 60,
}  # fmt: skip
SUN = {"type": "directional", "direction": [0, -4, 3], "irradiance": [3, 2, 1]}


def test_suns_with_a_disk_stand_side_by_side_behind_all_lights_but_the_sky():
    disk = {**SUN, "angular_diameter": 10}
    dark = [{**POINT, "intensity": 0}, {**SUN, "irradiance": 0}, {**SPOT, "inner_angle": 0, "outer_angle": 0}]
    lights = packed(quad(material="lamp"), lights=[disk, SUN, SPOT, disk, POINT, *dark],
                    environment={"type": "constant", "radiance": 1}).arrays.lights  # fmt: skip
    kinds = [LightKind.QUAD, LightKind.SPOT, LightKind.POINT, *[LightKind.DIRECTIONAL] * 3, LightKind.ENVIRONMENT]
    assert lights["kind"].tolist() == kinds
    assert (lights["spread"][3:] > 0).tolist() == [False, True, True, False]
    np.testing.assert_allclose(lights["direction"][3], [0, -0.8, 0.6], rtol=1e-6)
    half = np.radians(5)
    assert lights["spread"][4] == pytest.approx(1 - np.cos(half), rel=1e-6)
    np.testing.assert_allclose(lights["intensity"][4], np.array([3, 2, 1]) / (np.pi * np.sin(half) ** 2), rtol=1e-6)


def test_spots_and_suns_are_picked_by_their_power(by_power):
    cone = 2 * np.pi * (1 - (np.cos(np.radians(20)) + np.cos(np.radians(60))) / 2)
    share = np.array([cone * np.dot([1, 2, 3], [0.2126, 0.7152, 0.0722]), 4 * np.pi * 2])
    np.testing.assert_allclose(pick(lights=[SPOT, POINT]), 0.95 * share / share.sum() + 0.025, rtol=1e-5)
    # Through a disk around a ball of radius 1, 3 ** .5 around its corners, whether from a point or from a disk.
    for sun in (SUN, {**SUN, "angular_diameter": 30}):
        through = 3 * np.pi * np.dot([3, 2, 1], [0.2126, 0.7152, 0.0722])
        expected = through / (through + 4 * np.pi * 2)
        assert pick(sphere(), lights=[POINT, sun])[1] == pytest.approx(expected, rel=1e-5)
    assert pick(sphere(), lights=[POINT, {**SUN, "irradiance": 1e9}])[0] == pytest.approx(0.2)


def test_sides_that_shine_count():
    materials = {"grey": {"type": "diffuse", "albedo": 0}}
    materials |= {
        side: {"type": "diffuse", "albedo": 0, "emission": 1, "emission_sides": side} for side in ("front", "both")
    }
    one, two = pick(quad(material="front"), quad(material="both"), materials=materials)
    assert (two - 0.025) == pytest.approx(2 * (one - 0.025), rel=1e-5)
    assert pick(sphere(material="front"), sphere(material="both"), materials=materials) == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("count", [1, 30])
def test_hidden_shapes_carry_their_bit(count):
    shapes = [sphere(), *[quad(origin=[3 * i, 0, 0], visible_to_camera=False) for i in range(count)]]
    shapes += [mesh(double_sided=False, visible_to_camera=False), box(visible_to_camera=False), box()]
    arrays = packed(*shapes).arrays
    assert arrays.spheres["shape"].tolist() == [0]
    assert sorted(arrays.quads["shape"].tolist()) == [ShapeBit.HIDDEN | i for i in range(1, count + 1)]
    assert set(arrays.triangles["shape"].tolist()) == {ShapeBit.HIDDEN | ShapeBit.SINGLE_SIDED | (count + 1)}
    assert arrays.boxes["shape"].tolist() == [ShapeBit.HIDDEN | (count + 2), count + 3]


def test_each_light_and_each_way_to_pass_raises_its_flag():
    """A scene that uses none of it raises none: it runs the kernel that it ran before there were any."""
    every = {"HAS_SPOT_LIGHTS", "HAS_DIRECTIONAL_LIGHTS", "HAS_SUN_DISKS", "HAS_HIDDEN_SHAPES", "HAS_OPACITY",
             "HAS_EMISSION_BOTH"}  # fmt: skip

    def raised(*shapes, grey=None, lamp=None, **fields):
        materials = {"grey": {**GREY, **(grey or {})}, "lamp": {**LAMP, **(lamp or {})}}
        return flags(packed(*shapes, materials=materials, **fields).arrays) & every

    assert raised(sphere(), quad(material="lamp"), lights=[POINT], grey={"emission_sides": "both"}) == set()
    assert raised(lights=[SPOT]) == {"HAS_SPOT_LIGHTS"}
    assert raised(lights=[SUN]) == {"HAS_DIRECTIONAL_LIGHTS"}
    assert raised(lights=[{**SUN, "angular_diameter": 1}]) == {"HAS_DIRECTIONAL_LIGHTS", "HAS_SUN_DISKS"}
    assert raised(box(), box(visible_to_camera=False)) == {"HAS_HIDDEN_SHAPES"}
    assert raised(grey={"alpha": 0.5}) == {"HAS_OPACITY"}
    assert raised(grey={"alpha": 0.5, "alpha_cutoff": 0.5}) == set()
    assert raised(lamp={"emission_sides": "both"}) == {"HAS_EMISSION_BOTH"}


WARMED = """
from numba.core.registry import CPUDispatcher
from gpu.accel import light_tree, light_tree_build, light_tree_clusters
from service.pack import pack, warm_light_tree
from service.document import parse_scene
def compiled():
    modules = (light_tree, light_tree_build, light_tree_clusters)
    found = [each for module in modules for each in vars(module).values() if isinstance(each, CPUDispatcher)]
    return sum(len(each.signatures) for each in found)
warm_light_tree()
warm = compiled()
lamps = [{"type": "point", "position": [i, 2, i % 7], "intensity": 4} for i in range(300)]
scene = {"version": 1, "camera": {"position": [0, 0, 5], "target": [0, 0, 0]}, "lights": lamps,
    "materials": {"a": {"type": "diffuse", "albedo": 0.5, "emission": 2}},
    "shapes": [{"type": "box", "min": [0, 0, 0], "max": [1, 1, 1], "material": "a"}]}
assert len(pack(parse_scene(scene), None).arrays.light_tree)
print(warm, compiled())
"""


def test_the_first_lamps_find_the_builder_warm():
    done = subprocess.run([sys.executable, "-c", WARMED], capture_output=True, text=True, check=True)
    warm, after = map(int, done.stdout.split())
    assert warm == after > 0


@pytest.mark.parametrize("wrap", [["clamp", "repeat"], ["mirror", "clamp"], ["repeat", "mirror"]])
def test_the_light_of_an_image_is_that_of_the_texel_that_each_axis_wraps_to(wrap):
    """Of places in the middle of texels, by which textured lamps are weighed."""
    pixels = np.random.default_rng(4).random((3, 4, 3)).astype(np.float32)
    scene = parse_scene(document(quad(material="m"), materials={"m": {**GREY, "emission": {"texture": "t"}}},
                                 textures={"t": {"asset": "sha256:t", "wrap": wrap}}))  # fmt: skip
    _, uses, texels, _ = pack_textures(scene, scene, Shelf(t=picture(pixels)), None, None)
    places = [(x, y) for x in range(-8, 12) for y in range(-6, 9)]
    found = nearest(uses[0], texels, np.array([((x + 0.5) / 4, (y + 0.5) / 3) for x, y in places]))
    index = {
        "clamp": lambda i, n: min(max(i, 0), n - 1), "repeat": lambda i, n: i % n,
        "mirror": lambda i, n: min(i % (2 * n), 2 * n - 1 - i % (2 * n)),
    }  # fmt: skip
    for (x, y), texel in zip(places, found, strict=True):
        assert (texel == pixels[2 - index[wrap[1]](y, 3), index[wrap[0]](x, 4)]).all(), (x, y)
