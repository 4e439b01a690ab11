"""glTF files as scene documents: what stands where, under which light, seen by which camera."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

from service.document import parse_scene
from service.formats import MeshData, scene_import
from service.pack import pack
from service.pack.geometry import instances
from service.server.assets import AssetStore
from tests.gltf_files import QUAD, QUAD_FACES, QUAD_UVS, Gltf
from tests.service.formats.scenes import corners, imported, noted

HALF = math.sqrt(0.5)


@pytest.mark.parametrize("name", ["NORMAL", "TEXCOORD_0", "TANGENT", "COLOR_0"])
def test_what_is_not_finite_is_told_by_its_place(store: AssetStore, name: str) -> None:
    rows = {"POSITION": QUAD, "NORMAL": np.ones((4, 3), "<f4"), "TEXCOORD_0": QUAD_UVS.copy(),
            "TANGENT": np.ones((4, 4), "<f4"), "COLOR_0": np.ones((4, 3), "<f4")}  # fmt: skip
    rows[name][2, 0] = np.inf
    file = Gltf()
    material = file.add("materials", {"extensions": {"KHR_materials_anisotropy": {"anisotropyStrength": 0.5}}})
    file.node(mesh=file.mesh(file.primitive(rows, material=material)))
    found = imported(store, file)
    told = noted(found)[f"/meshes/0/primitives/0/attributes/{name}"]
    assert re.match(r"item 2 of /accessors/[0-9]+ is not finite: \[inf", told)
    mesh = store.mesh(found.document["shapes"][0]["asset"])
    assert len(mesh.faces) == 2
    assert all(
        np.isfinite(rows).all() for rows in (mesh.normals, mesh.uvs, mesh.colors, mesh.tangents) if rows is not None
    )


def test_the_alpha_of_vertices_counts_where_the_material_fades(store: AssetStore) -> None:
    colors = np.array([[255, 255, 255, 255], [255, 255, 255, 0], [255, 255, 255, 51], [255, 0, 255, 255]], np.uint8)
    for mode, width in (("OPAQUE", 3), ("BLEND", 4), ("MASK", 4)):
        file = Gltf()
        material = file.add("materials", {"alphaMode": mode})
        file.node(mesh=file.mesh(file.primitive({"POSITION": QUAD, "COLOR_0": colors}, material=material)))
        found = imported(store, file)
        mesh = store.mesh(found.document["shapes"][0]["asset"])
        assert mesh.colors is not None and mesh.colors.shape == (4, width) and not found.warnings
        assert np.allclose(mesh.colors, (colors / 255)[:, :width])


def test_hidden_nodes_are_not_there(store: AssetStore) -> None:
    """KHR_node_visibility: with all below them, lights too; and required extensions that change nothing are read."""
    file = Gltf()
    mesh = file.mesh()
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]},
                               "KHR_materials_variants": {"variants": [{"name": "red"}]}}  # fmt: skip
    file.tree["extensionsRequired"] = ["KHR_node_visibility", "KHR_materials_variants"]
    lamp = file.node(False, extensions={"KHR_lights_punctual": {"light": 0}})
    child = file.node(False, mesh=mesh, extensions={"KHR_node_visibility": {"visible": True}})
    file.node(mesh=mesh, children=[child, lamp], extensions={"KHR_node_visibility": {"visible": False}})
    file.node(mesh=mesh, extensions={"KHR_node_visibility": {}})
    found = imported(store, file)
    assert len(found.document["shapes"]) == 1 and not found.lit
    assert not found.warnings


def test_nodes_of_a_mesh_are_its_instances(store: AssetStore, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its triangles are held once."""
    monkeypatch.setattr(instances, "LEAST", 1)
    monkeypatch.setattr(instances, "WORTH", 0)
    file = Gltf()
    mesh = file.mesh()
    for x in range(3):
        file.node(mesh=mesh, translation=[x, 0, 0], scale=[-1, 1, 1 + x])
    arrays = pack(parse_scene(imported(store, file).document), store).arrays
    assert len(arrays.instances) == 3 and len(arrays.triangles) == len(QUAD_FACES.reshape(-1, 3))
    assert sorted(arrays.instances["side"]) == [-1, -1, -1]


def test_nodes_share_their_mesh_and_mirror(store: AssetStore) -> None:
    file = Gltf()
    mesh = file.mesh()
    child = file.node(False, mesh=mesh, rotation=[0, HALF, 0, HALF])
    file.node(mesh=mesh, children=[child], translation=[1, 2, 3], scale=[-2, 1, 1])
    first, second = imported(store, file).document["shapes"]
    assert first["asset"] == second["asset"] and first["asset"].startswith("sha256:")
    mirrored = QUAD * [-2, 1, 1] + [1, 2, 3]
    assert np.allclose(corners(store, first), mirrored[QUAD_FACES.reshape(-1, 3)])
    turned = np.stack([0 * QUAD[:, 0], QUAD[:, 1], -QUAD[:, 0]], axis=1) * [-2, 1, 1] + [1, 2, 3]
    assert np.allclose(corners(store, second), turned[QUAD_FACES.reshape(-1, 3)], atol=1e-6)


def test_a_mesh_carries_uv_upwards_normals_and_colours(store: AssetStore) -> None:
    normals, colors = np.tile(np.array([0, 0, 2], "<f4"), (4, 1)), np.array([[255, 128, 0, 255]] * 4, np.uint8)
    file, second = Gltf(), QUAD_UVS[::-1] * np.float32(0.5)
    rows = {"POSITION": QUAD, "NORMAL": normals, "TEXCOORD_0": QUAD_UVS, "TEXCOORD_1": second, "COLOR_0": colors}
    primitive = file.primitive(rows)
    file.tree["accessors"][primitive["attributes"]["COLOR_0"]]["normalized"] = True
    file.node(mesh=file.mesh(primitive))
    (shape,) = imported(store, file).document["shapes"]
    mesh = store.mesh(shape["asset"])
    assert np.array_equal(mesh.normals, [[0, 0, 1]] * 4) and "smooth" not in shape
    assert np.allclose(mesh.uvs, QUAD_UVS * [1, -1] + [0, 1]) and np.allclose(mesh.uvs_1, second * [1, -1] + [0, 1])
    assert mesh.colors is not None and np.allclose(mesh.colors, [[1, 128 / 255, 0]] * 4)  # linear, not sRGB


def test_without_normals_triangles_are_flat(store: AssetStore) -> None:
    file = Gltf()
    file.node(mesh=file.mesh())
    (shape,) = imported(store, file).document["shapes"]
    assert shape["smooth"] is False and shape["double_sided"] is False


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (4, QUAD_FACES, [[0, 1, 2], [0, 2, 3]]),
        (4, None, [[0, 1, 2]]),
        (5, np.array([0, 1, 3, 2], np.uint8), [[0, 1, 3], [1, 2, 3]]),
        (6, np.array([0, 1, 2, 3], "<u4"), [[1, 2, 0], [2, 3, 0]]),
        (6, None, [[1, 2, 0], [2, 3, 0]]),
    ],
)
def test_primitives_with_area(store: AssetStore, mode: int, indices: Any, expected: list[list[int]]) -> None:
    file = Gltf()
    rows = {"POSITION": QUAD[:3] if mode == 4 and indices is None else QUAD}
    file.node(mesh=file.mesh(file.primitive(rows, indices, mode=mode), file.primitive(rows, None, mode=1)))
    found = imported(store, file)
    (shape,) = found.document["shapes"]
    assert np.array_equal(corners(store, shape), QUAD[expected])
    assert "no area" in noted(found)["/meshes/0/primitives/1"]


def test_primitives_of_one_buffer_take_only_their_vertices(store: AssetStore) -> None:
    file = Gltf()
    position = file.accessor(QUAD)
    halves = [
        {"attributes": {"POSITION": position}, "indices": file.accessor(faces)} for faces in np.split(QUAD_FACES, 2)
    ]
    file.node(mesh=file.mesh(*halves))
    shapes = imported(store, file).document["shapes"]
    assert [len(store.mesh(shape["asset"]).vertices) for shape in shapes] == [3, 3]
    for shape in shapes:
        vertices = store.mesh(shape["asset"]).vertices
        assert store.info(shape["asset"]).bounds == [vertices.min(0).tolist(), vertices.max(0).tolist()]
    assert np.array_equal(np.concatenate([corners(store, s) for s in shapes]), QUAD[QUAD_FACES.reshape(-1, 3)])


def test_quantised_positions(store: AssetStore) -> None:
    """KHR_mesh_quantization: whole numbers that a node's scale makes metres."""
    file = Gltf()
    file.tree["extensionsRequired"] = ["KHR_mesh_quantization"]
    rows = {"POSITION": np.append((QUAD * 100).astype("<i2"), np.zeros((4, 1), "<i2"), axis=1)[:, :3].copy()}
    file.node(mesh=file.mesh(file.primitive(rows)), scale=[0.01, 0.01, 0.01])
    (shape,) = imported(store, file).document["shapes"]
    assert np.allclose(corners(store, shape), QUAD[QUAD_FACES.reshape(-1, 3)])


def test_morph_targets_by_the_weights_of_the_file(store: AssetStore) -> None:
    """The node's weights go before the mesh's; a mesh of two nodes takes two shapes."""
    file = Gltf()
    target = {"POSITION": file.accessor(np.tile(np.array([0, 0, 4], "<f4"), (4, 1)))}
    mesh = file.mesh(file.primitive(targets=[target]), weights=[0.5])
    file.node(mesh=mesh)
    file.node(mesh=mesh, weights=[0.0])
    file.node(mesh=mesh, weights=[1.0])
    heights = [corners(store, shape)[0, 0, 2] for shape in imported(store, file).document["shapes"]]
    assert heights == [2, 0, 4]


def test_a_skin_stands_as_its_joints_do(store: AssetStore) -> None:
    """The mesh's own node does not move it; each vertex follows its joints by their shares."""
    file = Gltf()
    joints = [file.node(translation=[0, 0, 5]), file.node(translation=[0, 10, 0])]
    bound = np.stack([np.eye(4), np.eye(4)]).astype("<f4")
    bound[1, 3, :3] = [0, -10, 0]  # columns first
    shares = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0.5, 0.5, 0, 0]], "<f4")
    rows = {"POSITION": QUAD, "JOINTS_0": np.tile(np.array([0, 1, 0, 0], np.uint8), (4, 1)), "WEIGHTS_0": shares}
    skin = file.add("skins", {"joints": joints, "inverseBindMatrices": file.accessor(bound.reshape(2, 16))})
    file.node(mesh=file.mesh(file.primitive(rows)), skin=skin, translation=[100, 0, 0])
    (shape,) = imported(store, file).document["shapes"]
    expected = QUAD + np.array([[0, 0, 5], [0, 0, 5], [0, 0, 0], [0, 0, 2.5]])
    assert np.allclose(corners(store, shape), expected[QUAD_FACES.reshape(-1, 3)])


def test_gpu_instances(store: AssetStore) -> None:
    file = Gltf()
    moves = np.array([[0, 0, 0], [5, 0, 0], [0, 5, 0]], "<f4")
    extension = {"attributes": {"TRANSLATION": file.accessor(moves)}}
    file.node(mesh=file.mesh(), extensions={"EXT_mesh_gpu_instancing": extension}, translation=[1, 0, 0])
    shapes = imported(store, file).document["shapes"]
    assert np.allclose([corners(store, shape)[0, 0] for shape in shapes], moves + QUAD[0] + [1, 0, 0])


def test_a_flat_transform_is_left_out_and_told(store: AssetStore) -> None:
    file = Gltf()
    mesh = file.mesh()
    file.node(mesh=mesh)
    file.node(mesh=mesh, scale=[1, 0, 1])
    found = imported(store, file)
    assert len(found.document["shapes"]) == 1 and "flat" in noted(found)["/nodes/1"]


def test_the_first_camera(store: AssetStore) -> None:
    file = Gltf()
    file.node(mesh=file.mesh())
    lens = {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "aspectRatio": 1.5}}
    file.node(camera=file.add("cameras", lens), translation=[4, 0, 0], rotation=[0, HALF, 0, HALF])
    file.node(camera=file.add("cameras", lens))
    found = imported(store, file)
    camera = found.document["camera"]
    assert camera["position"] == [4, 0, 0] and camera["vfov"] == pytest.approx(math.degrees(0.7))
    assert np.allclose(camera["target"], [0, 0, 0], atol=1e-6) and np.allclose(camera["up"], [0, 1, 0])
    assert "first camera" in noted(found)["/nodes/2/camera"]
    assert found.aspect_ratio == 1.5


def test_an_orthographic_camera_is_taken(store: AssetStore) -> None:
    file = Gltf()
    file.node(mesh=file.mesh())
    lens = {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 100}}
    file.node(camera=file.add("cameras", lens), translation=[0, 0, 5])
    found = imported(store, file)
    camera = found.document["camera"]
    assert (camera["type"], camera["height"], camera["position"]) == ("orthographic", 4, [0, 0, 5])
    assert np.allclose(camera["target"], [0, 0, 0], atol=1e-6) and found.aspect_ratio == 1.5


@pytest.mark.parametrize("scale", [[1, 1, 1], [5, 1, 3], [1, 5, 0.001], [3, 2, 1000]])
def test_a_framed_camera_sees_everything_and_fills_the_picture(store: AssetStore, scale: list[float]) -> None:
    file = Gltf()
    box = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], "<f4") + np.float32([7, 8, 9])
    file.node(mesh=file.mesh(file.primitive({"POSITION": box}, np.arange(6, dtype=np.uint8))), scale=scale)
    file.node(mesh=file.mesh(file.primitive({"POSITION": box}, np.array([5, 6, 7], np.uint8))), scale=scale)
    camera = imported(store, file).document["camera"]
    back = np.subtract(camera["position"], camera["target"])
    back /= np.linalg.norm(back)
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    seen = (box * scale - camera["position"]) @ np.stack([right, np.cross(back, right), -back]).T
    assert seen[:, 2].min() > 0
    extent = np.abs(seen[:, :2] / seen[:, 2:]).max() / math.tan(math.radians(camera["vfov"] / 2))
    assert 0.85 < extent < 1


def test_lights(store: AssetStore) -> None:
    """A candela is a watt per steradian; the spot's other falloff is listed, and its angles are half-angles."""
    file = Gltf()
    file.node(mesh=file.mesh())
    lights = [
        {"type": "point", "color": [1, 0.5, 0], "intensity": 10, "range": 3},
        {"type": "directional", "intensity": 2},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
    ]
    file.tree["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    for k in range(3):
        # Turned about x: the -z that lights shine along becomes -y.
        turn = [-HALF, 0, 0, HALF]
        file.node(extensions={"KHR_lights_punctual": {"light": k}}, translation=[0, 3, 0], rotation=turn)
    found = imported(store, file)
    point, sun, spot = found.document["lights"]
    assert point == {"type": "point", "position": [0, 3, 0], "intensity": [10, 5, 0]}
    assert sun["irradiance"] == [2, 2, 2] and np.allclose(sun["direction"], [0, -1, 0])
    assert (spot["inner_angle"], spot["outer_angle"]) == pytest.approx((math.degrees(0.1), math.degrees(0.2)))
    assert spot["intensity"] == [1, 1, 1]
    assert {"/extensions/KHR_lights_punctual/lights/0/range", "/extensions/KHR_lights_punctual/lights/2/spot"} <= set(
        noted(found)
    )
    assert "environment" not in found.scene({"type": "constant", "radiance": 1})


def test_without_lights_there_is_the_default_environment(store: AssetStore) -> None:
    file = Gltf()
    file.node(mesh=file.mesh())
    environment = {"type": "constant", "radiance": 1}
    assert imported(store, file).scene(environment)["environment"] == environment


def test_what_is_not_had_is_listed_with_its_place(store: AssetStore) -> None:
    file = Gltf().of({"extensions": {"KHR_materials_subsurface": {}, "EXT_a/b": {}}})
    file.add("animations", {"channels": [], "samplers": []})
    file.tree["extensionsUsed"] = ["KHR_materials_subsurface"]
    places = noted(imported(store, file))
    assert {"/materials/0/extensions/KHR_materials_subsurface", "/materials/0/extensions/EXT_a~1b"} <= set(places)
    assert "/animations/0/samplers" in places, "one that moves nothing"


def test_a_document_outlives_its_parts(store: AssetStore) -> None:
    """They are made again from the file where they are gone."""
    file = Gltf()
    file.node(mesh=file.mesh(), translation=[3, 3, 3])
    info = store.add(file.glb())
    before = store.scene(info.id).document
    part = before["shapes"][0]["asset"]
    store._files.file(part).write_bytes(b"")  # as after a loss of power
    assert not store.holds(part)
    assert store.scene(info.id).document == before
    assert isinstance(store.mesh(part), MeshData)


def test_a_broken_image_is_named_and_left_out(store: AssetStore) -> None:
    """The factors of what it coloured remain, and other textures."""
    file = Gltf()
    image = file.add("images", {"bufferView": file.view(b"\x89PNG\r\n\x1a\n" + bytes(50))})
    broken, sound = file.add("textures", {"source": image}), file.texture(np.full((2, 2, 3), 9, np.uint8))
    rough = {"baseColorTexture": {"index": broken}, "baseColorFactor": [0.5, 1, 1, 1]}
    rough["metallicRoughnessTexture"] = {"index": sound}
    file.of({"normalTexture": {"index": broken}, "pbrMetallicRoughness": rough})
    found = imported(store, file)
    (material,) = found.document["materials"].values()
    assert material["base_color"] == [0.5, 1, 1] and "normal_map" not in material
    assert len(found.document["textures"]) == 1 and material["roughness"]["texture"] in found.document["textures"]
    assert noted(found)["/images/0"].endswith("; the image is left out")


def test_what_an_older_importer_made_is_made_anew(store: AssetStore, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its warnings and its exposure would be those of then."""
    file = Gltf()
    file.node(mesh=file.mesh(), name="imported twice")
    monkeypatch.setattr(scene_import, "IMPORTER", scene_import.IMPORTER - 1)
    info = store.add(file.glb())
    monkeypatch.undo()
    made: list[str] = []
    parse = store.loader.sandbox.parse_scene
    monkeypatch.setattr(store.loader.sandbox, "parse_scene", lambda *given: made.append(info.id) or parse(*given))
    assert store.scene(info.id).importer == scene_import.IMPORTER and len(made) == 1
    store.add(file.glb())
    assert len(made) == 1
