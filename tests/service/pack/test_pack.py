"""From the document to arrays: nothing lost, nothing turned inside out, nothing done twice."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from gpu import layout
from gpu.layout import ShapeBit
from gpu.layout.models import NUMBERS
from service.document import parse_scene
from service.pack import CacheBudget, PackCache, pack_camera, pack_materials
from service.problems import InvalidDocument
from tests.documents import (
    CAMERA,
    LAMP,
    MIRRORED,
    Few,
    Shelf,
    box,
    cube_data,
    document,
    matrix_of,
    mesh,
    packed,
    picture,
    quad,
    refused,
    sphere,
)


def test_camera_is_orthonormal_and_right_handed():
    scene = parse_scene({**document(), "camera": {"position": [1, 2, 3], "target": [4, 0, -5], "up": [0.3, 2, 0.1]}})
    camera = pack_camera(scene.camera)
    axes = np.array([camera[name] for name in ("right", "up", "forward")], np.float64)
    rounding = np.finfo(np.float32).eps
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=rounding)
    np.testing.assert_allclose(np.cross(axes[0], axes[1]), -axes[2], atol=rounding)
    assert camera["up"][1] > 0
    assert camera["focus_distance"] == pytest.approx(np.sqrt(9 + 4 + 64))
    assert camera["half_height"] == pytest.approx(np.tan(np.radians(20)))


def test_camera_looks_as_a_photographer_would():
    camera = packed().arrays.camera  # from +Z towards the origin: +X is on the right
    assert camera["right"] == pytest.approx((1, 0, 0))
    assert np.dot(camera["forward"], (0, -1, -5)) == pytest.approx(np.sqrt(26))


REQUIRED = {
    "diffuse": {"albedo": 0.25},
    "metal_rough": {"base_color": 0.25, "metallic": 0.5, "roughness": 0.75},
    "blinn_phong": {"diffuse": 0.25, "specular": 0.5, "shininess": 7},
    "phong": {"diffuse": 0.25, "specular": 0.5, "shininess": 7},
    "measured": {"asset": "sha256:" + 64 * "0"},
}
MEMBERS = {
    ("diffuse", "albedo"): "base_color",
    ("blinn_phong", "diffuse"): "base_color",
    ("blinn_phong", "specular"): "phong_specular",
    ("phong", "diffuse"): "base_color",
    ("phong", "specular"): "phong_specular",
    ("microfacet", "diffuse"): "base_color",
    ("microfacet", "f0"): "specular_color",
    ("openpbr", "base_diffuse_roughness"): "diffuse_roughness",
    ("openpbr", "base_metalness"): "metallic",
    ("openpbr", "transmission_depth"): "attenuation_distance",
    ("openpbr", "transmission_scatter"): "scatter_color",
    ("openpbr", "transmission_scatter_anisotropy"): "scatter_g",
    ("openpbr", "subsurface_weight"): "subsurface",
    ("openpbr", "subsurface_radius_scale"): "subsurface_radius",
    ("openpbr", "subsurface_scatter_anisotropy"): "subsurface_g",
    ("openpbr", "specular_weight"): "specular",
    ("openpbr", "specular_roughness"): "roughness",
    ("openpbr", "specular_roughness_anisotropy"): "anisotropic",
    ("openpbr", "specular_ior"): "ior",
    ("openpbr", "transmission_weight"): "transmission",
    ("openpbr", "transmission_color"): "attenuation_color",
    ("openpbr", "coat_weight"): "clearcoat",
    ("openpbr", "coat_roughness"): "clearcoat_roughness",
    ("openpbr", "coat_roughness_anisotropy"): "coat_anisotropy",
    ("openpbr", "fuzz_weight"): "sheen",
    ("openpbr", "fuzz_color"): "sheen_color",
    ("openpbr", "fuzz_roughness"): "sheen_roughness",
    ("openpbr", "thin_film_weight"): "film_weight",
    ("openpbr", "thin_film_ior"): "film_ior",
    ("openpbr", "geometry_opacity"): "opacity",
}


@pytest.mark.parametrize("model", NUMBERS)
def test_every_number_of_a_material_has_its_place(model):
    required = REQUIRED.get(model, {})
    plain = parse_scene({**document(), "materials": {"m": {"type": model, **required}}})
    fields = type(plain.materials["m"]).model_fields
    seen = set()
    own = set(fields) - {
        "type",
        "asset",
        "emission_sides",
        "alpha",
        "alpha_cutoff",
        "normal_map",
        "clearcoat_normal_map",
        "height",
        "thin_walled",
        "abbe",  # see test_dispersion
    }
    if model == "microfacet":  # the rest has a record of its own
        own = {"emission", "diffuse", "f0", "ior"}
    if model == "openpbr":  # its emission is a product, its tangents become angles, its films are in micrometres
        own = {name for name in own if not name.startswith(("emission", "geometry", "transmission_disp"))}
        own = own - {"thin_film_thickness", "subsurface_radius"} | {"geometry_opacity"}
    for i, name in enumerate(sorted(own)):
        coloured = isinstance(getattr(plain.materials["m"], name), tuple) or name in (
            "sheen_color",
            "subsurface_radius",
            "conductor_eta",
            "conductor_k",
            "diffuse_transmission_color",
        )
        value = [0.1, 0.2, 0.3] if coloured else (1.1 if name.endswith("ior") else 0.1) + 0.0101 * i
        other = {"conductor_eta": "conductor_k", "conductor_k": "conductor_eta"}.get(name)  # either needs the other
        material = {"type": model, **required, name: value} | ({other: 3} if other else {})
        record = pack_materials(parse_scene({**document(), "materials": {"m": material}}))[0]
        assert record["model"] == NUMBERS[model]
        places = [m for m in layout.Material.members if np.array_equal(record[m], np.float32(value))]
        assert places == [MEMBERS.get((model, name), name)]
        seen.update(places)
    assert seen == {MEMBERS.get((model, name), name) for name in own}


def test_what_passes_diffuse_light_is_a_thin_wall():
    def packed(**members):
        scene = {**document(), "materials": {"m": {"type": "principled", **members}}}
        return pack_materials(parse_scene(scene))[0]

    assert packed()["thin_walled"] == 0 and packed(transmission=1)["thin_walled"] == 0
    assert packed(thin_walled=True)["thin_walled"] == 1
    assert packed(diffuse_transmission=0.1)["thin_walled"] == 1
    assert packed()["diffuse_transmission_color"][0] == layout.ABSENT


def test_openpbr_shines_in_nits_and_its_tangents_are_angles():
    material = {"type": "openpbr", "emission_luminance": 683, "emission_color": [1, 0.5, 2], "geometry_opacity": 0.5}
    material |= {"geometry_tangent": [1, 1, 0], "geometry_coat_tangent": [0, -2, 1]}
    record = pack_materials(parse_scene({**document(), "materials": {"m": material}}))[0]
    np.testing.assert_allclose(record["emission"], [1, 0.5, 2])
    assert record["anisotropic_rotation"] == 45 and record["coat_rotation"] == -90
    assert record["opacity"] == 0.5 and record["cutoff"] == layout.ABSENT


@pytest.mark.parametrize(
    ("given", "opacity", "sides"),
    [
        ({}, 1, 1),
        ({"alpha": 0.25, "emission_sides": "both"}, 0.25, 2),
        ({"alpha": 0.25, "alpha_cutoff": 0.25, "emission_sides": "front"}, 1, 1),
        ({"alpha": 0.25, "alpha_cutoff": 0.26}, 0, 1),
    ],
)
def test_opacity_and_sides_are_what_alpha_and_its_cutoff_say(given, opacity, sides):
    material = {"type": "disney", **given}
    record = pack_materials(parse_scene({**document(), "materials": {"m": material}}))[0]
    assert (record["opacity"], record["emission_sides"]) == (opacity, sides)


def test_materials_stand_as_shapes_wear_them_and_keep_the_numbers_of_the_document():
    arrays = packed(sphere(material="lamp"), sphere()).arrays
    assert [m["emission"][0] for m in arrays.materials] == [4, 0]
    assert arrays.spheres["material"].tolist() == [0, 1] and arrays.material_numbers == (1, 0)
    lone = packed(sphere(material="lamp")).arrays
    assert len(lone.materials) == 1 and lone.material_numbers == (1,), "nothing else is drawn"


def test_sphere_turned_and_scaled_evenly_stays_a_sphere():
    transform = {"translate": [1, 2, 3], "rotate": [10, 20, 30], "scale": 2}
    arrays = packed(sphere(), sphere(center=[1, 0, 0], radius=0.5, transform=transform)).arrays
    assert len(arrays.spheres) == 2 and not len(arrays.ellipsoids)
    matrix = matrix_of(transform)
    record = arrays.spheres[1]
    np.testing.assert_allclose(record["center"], (matrix @ [1, 0, 0, 1])[:3], rtol=1e-6)
    assert record["radius"] == pytest.approx(1.0) and record["shape"] == 1
    q, w = record["rotation"][:3].astype(float), float(record["rotation"][3])
    for v in np.eye(3):
        turned = v + 2 * np.cross(q, np.cross(q, v) + w * v)
        np.testing.assert_allclose(turned, matrix[:3, :3] @ v / 2, atol=1e-6)


@pytest.mark.parametrize("turn", [[180, 0, 0], [0, 180, 0], [0, 0, 180], [180, 90, 0], [0, 0, 0]])
def test_half_turns_have_quaternions_too(turn):
    record = packed(sphere(transform={"rotate": turn})).arrays.spheres[0]
    q, w = record["rotation"][:3].astype(float), float(record["rotation"][3])
    turned = np.array([v + 2 * np.cross(q, np.cross(q, v) + w * v) for v in np.eye(3)]).T
    np.testing.assert_allclose(turned, matrix_of({"rotate": turn})[:3, :3], atol=1e-6)


def solid_matrix(solid):
    """Object from world."""
    rows = np.stack([solid["row_x"], solid["row_y"], solid["row_z"]]).astype(float)
    return lambda p: rows @ (p - solid["center"])


@pytest.mark.parametrize("transform", [{"scale": [1, 2, 3], "rotate": [5, 6, 7]}, MIRRORED, {"scale": -1}])
def test_other_spheres_are_ellipsoids(transform):
    arrays = packed(sphere(center=[1, 2, 3], radius=0.5, transform=transform)).arrays
    assert not len(arrays.spheres)
    matrix = matrix_of(transform)
    to_object = solid_matrix(arrays.ellipsoids[0])
    for direction in np.eye(3):
        world = matrix @ [*(np.array([1, 2, 3]) + 0.5 * direction), 1]
        np.testing.assert_allclose(to_object(world[:3] - arrays.origin), direction, atol=2e-6)


def test_box_is_the_cube_under_a_map():
    arrays = packed(box(transform=MIRRORED)).arrays
    to_object = solid_matrix(arrays.boxes[0])
    corner = (matrix_of(MIRRORED) @ [1, -2, 3, 1])[:3]
    np.testing.assert_allclose(to_object(corner), [1, -1, 1], atol=2e-6)


@pytest.mark.parametrize("transform", [None, MIRRORED])
def test_box_that_shines_is_six_quads_facing_outwards(transform):
    placed = {} if transform is None else {"transform": transform}
    arrays = packed(box(material="lamp", **placed)).arrays
    matrix = np.eye(4) if transform is None else matrix_of(transform)
    assert len(arrays.quads) == 6 and not len(arrays.boxes)
    center = matrix[:3, 3]
    for record in arrays.quads:
        middle = record["origin"] + record["u"] / 2 + record["v"] / 2
        assert np.dot(record["normal"], middle - center) > 0
    np.testing.assert_allclose(arrays.lights["index"], range(6))
    # The volume by the divergence theorem: the faces are whole, and each is where it belongs.
    heights = np.einsum("ij,ij->i", arrays.quads["normal"], arrays.quads["origin"] - center)
    assert (heights * arrays.quads["area"]).sum() / 3 == pytest.approx(48 * abs(np.linalg.det(matrix)), rel=1e-5)


def test_faces_of_a_shining_box_are_seen_upright():
    quads = packed(box(material="lamp")).arrays.quads
    for record in quads:
        normal, u, v = (record[name] / np.linalg.norm(record[name]) for name in ("normal", "u", "v"))
        np.testing.assert_allclose(np.cross(u, v), normal, atol=1e-6)
        if abs(normal[1]) > 0.5:
            assert np.allclose(u, [1, 0, 0]) and np.allclose(v, [0, 0, -normal[1]])
        else:
            assert np.allclose(v, [0, 1, 0])


@pytest.mark.parametrize("transform", [{"rotate": [1, 2, 3]}, {"scale": [1, 2, 3], "rotate": [9, 8, 7]}, MIRRORED])
def test_quad_keeps_its_front_and_its_coordinates(transform):
    record = packed(quad(u=[2, 0, 0.5], v=[0.3, 1, 0], transform=transform)).arrays.quads[0]
    matrix = matrix_of(transform)[:3, :3]
    outward = np.linalg.inv(matrix).T @ np.cross([2, 0, 0.5], [0.3, 1, 0])
    np.testing.assert_allclose(record["normal"], outward / np.linalg.norm(outward), atol=1e-6)
    np.testing.assert_allclose(record["u"], matrix @ [2, 0, 0.5], rtol=1e-5, atol=1e-6)
    p = 0.25 * record["u"] + 0.75 * record["v"]
    assert np.dot(p, record["dual_u"]) == pytest.approx(0.25 * record["u_length"], abs=1e-6)
    assert np.dot(p, record["dual_v"]) == pytest.approx(0.75 * record["v_length"], abs=1e-6)
    assert record["area"] == pytest.approx(np.linalg.norm(np.cross(record["u"], record["v"])), rel=1e-5)
    assert record["u_length"] * np.linalg.norm(record["v"]) == pytest.approx(record["area"], rel=1e-6)
    assert record["v_length"] * np.linalg.norm(record["u"]) == pytest.approx(record["area"], rel=1e-6)


def test_shapes_know_the_document_and_single_sided_ones_say_so():
    triangles = packed(mesh(), mesh(double_sided=False)).arrays.triangles
    assert sorted(triangles["shape"]) == 12 * [0] + 12 * [1 | ShapeBit.SINGLE_SIDED]


def test_too_small_to_trace_is_left_out_with_a_word():
    result = packed(sphere(radius=1e-30), sphere(), box(transform={"scale": 1e-20}))
    assert len(result.arrays.spheres) == 1 and not len(result.arrays.boxes)
    assert [w.split(":")[0] for w in result.warnings] == ["/shapes/0", "/shapes/2"]


def test_out_of_reach_is_refused_at_the_transform():
    assert refused(sphere(), quad(transform={"scale": 1e6, "translate": [1e9, 0, 0]}, u=[1e5, 0, 0])) == [
        "/shapes/1/transform"
    ]
    assert refused(mesh(transform={"scale": 1e9, "rotate": [0, 0, 1]}, vertices=[[9, 0, 0], [0, 9, 0], [0, 0, 9]],
                        faces=[[0, 1, 2]])) == ["/shapes/0/transform"]  # fmt: skip
    packed(sphere(center=[1e9, 1e9, 1e9], radius=1e9))


def test_scene_near_the_origin_keeps_its_numbers():
    assert packed(sphere(center=[3, 0, 0])).arrays.origin == (0, 0, 0)
    assert packed().arrays.origin == (0, 0, 0)


def test_far_scene_is_moved_to_the_origin_before_it_is_rounded():
    far = np.array([1e6, -2e6, 3e6])
    shapes = [sphere(center=(far + 0.25).tolist()), box(transform={"translate": far.tolist()}),
              quad(origin=far.tolist()), mesh(transform={"translate": far.tolist()})]  # fmt: skip
    lights = [{"type": "point", "position": (far + 1).tolist(), "intensity": 1}]
    camera = {"position": (far + np.array([0, 0, 5])).tolist(), "target": far.tolist()}
    arrays = packed(*shapes, lights=lights, camera=camera).arrays
    shift = far - np.array(arrays.origin)
    assert np.abs(shift).max() < 20 and np.array_equal(shift, np.rint(shift))
    assert np.array_equal(arrays.spheres[0]["center"], shift + 0.25)
    assert np.array_equal(arrays.boxes[0]["center"], shift)
    assert np.array_equal(arrays.quads[0]["origin"], shift)
    assert np.array_equal(arrays.triangles["v0"].min(axis=0), shift)
    assert np.array_equal(arrays.lights[0]["position"], shift + 1)
    assert np.array_equal(arrays.camera["position"], shift + np.array([0, 0, 5]))


def test_mistakes_name_their_place():
    assert refused(sphere(), mesh(asset="sha256:gone")) == ["/shapes/1/asset"]
    assert refused(environment={"type": "image", "asset": "sha256:gone"}) == ["/environment/asset"]
    assert refused(mesh(), sphere(), mesh(asset="sha256:cube"), assets=Shelf(cube=cube_data()), limits=Few(20)) == [
        "/shapes/2"
    ]
    packed(mesh(), mesh(), limits=Few(24))


def test_cache_keeps_what_an_edit_leaves_alone():
    shelf, cache = Shelf(cube=cube_data(), sky=picture(np.ones((2, 4, 3)))), PackCache()
    sky = {"type": "image", "asset": "sha256:sky"}

    def again(shape=None, **fields):
        shape = shape or mesh(asset="sha256:cube")
        return packed(shape, mesh(), assets=shelf, cache=cache, **{"environment": sky, **fields}).arrays

    first = again()
    painted = {"grey": {"type": "disney", "roughness": 0.2}, "lamp": LAMP}
    edited = again(materials=painted, environment={**sky, "rotation": 30, "scale": 3}, camera={**CAMERA, "vfov": 20})
    assert edited.triangles is first.triangles and edited.nodes is first.nodes
    assert edited.environment.texels is first.environment.texels
    assert edited.environment.rotation == pytest.approx(np.pi / 6)
    assert edited.materials["roughness"][0] == np.float32(0.2)
    assert shelf.fetched == ["sha256:cube", "sha256:sky"]
    assert again(shape=mesh(asset="sha256:cube", transform={"scale": 2})).triangles is not first.triangles
    assert again(materials={"grey": LAMP, "lamp": LAMP}).triangles is not first.triangles
    assert again().triangles is first.triangles


def test_documents_share_their_environments():
    """A one-shot render has no cache of its own, and the tables of the studio take longer than its scene."""
    shelf, shared = Shelf(sky=picture(np.ones((2, 4, 3)))), PackCache()
    sky = {"type": "image", "asset": "sha256:sky"}

    def light(cache=None, **more):
        lit = packed(mesh(), assets=shelf, cache=cache, environments=shared, environment={**sky, **more})
        return lit.arrays.environment

    first = light()
    assert light(rotation=30).cells is first.cells
    assert light(cache=PackCache()).cells is first.cells, "one that is edited, too"
    edited = light(cache=PackCache(), blur=20)
    assert light(blur=20).cells is not edited.cells, "nobody else asks for what a slider passes"
    shelf.known.clear()
    for cache in (None, PackCache()):
        with pytest.raises(InvalidDocument):
            light(cache)


def test_cache_forgets_the_oldest_and_trusts_no_path():
    cache = PackCache(entries=2)
    first = packed(mesh(), cache=cache).arrays.triangles
    for i in range(3):
        packed(mesh(transform={"scale": i + 2}), cache=cache)
    assert packed(mesh(), cache=cache).arrays.triangles is not first
    shelf = Shelf()
    shelf.known["cube.obj"] = cube_data()
    for _ in range(2):
        packed(mesh(asset="cube.obj"), assets=shelf, cache=cache)
    assert shelf.fetched == ["cube.obj", "cube.obj"]
    small = PackCache(budget=CacheBudget(1))
    kept = packed(mesh(), cache=small).arrays.triangles
    assert packed(mesh(), cache=small).arrays.triangles is kept


def test_small_scenes_load_no_compiler():
    """Nor does it take more than the 3700 lines of Python that it takes now, and a third."""
    code = """
import sys
from tests.counting import python_lines
from service.pack import pack
from service.document import parse_scene
scene = parse_scene({"version": 1, "camera": {"position": [0, 0, 5], "target": [0, 0, 0]},
    "environment": {"type": "constant", "radiance": 1}, "materials": {"a": {"type": "diffuse", "albedo": 0.5}},
    "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "a"}]})
pack(scene, None)
print(sorted({"numba", "trimesh", "scipy", "moderngl"} & set(sys.modules)), python_lines(lambda: pack(scene, None)))
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded, lines = result.stdout.rsplit(" ", 1)
    assert loaded == "[]"
    assert int(lines) < 5000
