"""Accessors without data of their own are zeros, wherever an accessor may stand [glTF 2.0, 3.6.2.3 and 5.1.1]."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from service.formats.errors import ParseError
from service.formats.read.gltf.importer import read_scene
from service.formats.read.gltf.merged_mesh import read_merged
from service.formats.types import AssetLimits, Pose
from tests.gltf_files import COMPONENTS, QUAD, TYPES, Gltf


def zeros(file: Gltf, kind: str, width: int, count: int, **more: Any) -> int:
    described = {"componentType": COMPONENTS[kind], "count": count, "type": TYPES[width]}
    return file.add("accessors", {**described, **more})


def with_attribute(name: str, width: int, kind: str = "float32") -> Callable[[Gltf], None]:
    def change(file: Gltf) -> None:
        made = file.primitive()
        made["attributes"][name] = zeros(file, kind, width, 4)
        file.node(mesh=file.mesh(made))

    return change


def with_target(file: Gltf) -> None:
    target = {name: zeros(file, "float32", 3, 4) for name in ("POSITION", "NORMAL")}
    made = file.primitive(targets=[target])
    file.node(mesh=file.mesh(made, weights=[1]))


def with_animation(file: Gltf) -> None:
    node = file.node(mesh=file.mesh())
    file.animation("Move", (node, "translation", "LINEAR", [0, 1], [[0, 0, 0], [1, 0, 0]]))
    file.tree["animations"][0]["samplers"][0]["output"] = zeros(file, "float32", 3, 2)


def with_one_key(file: Gltf) -> None:
    node = file.node(mesh=file.mesh())
    file.animation("Move", (node, "translation", "LINEAR", [0], [[0, 0, 0]]))
    file.tree["animations"][0]["samplers"][0]["input"] = zeros(file, "float32", 1, 1)


def with_instances(file: Gltf) -> None:
    moved = {"attributes": {"TRANSLATION": zeros(file, "float32", 3, 2)}}
    file.node(mesh=file.mesh(), extensions={"EXT_mesh_gpu_instancing": moved})


def with_skin(file: Gltf) -> None:
    joints, weights = zeros(file, "uint8", 4, 4), file.accessor(np.tile(np.array([1, 0, 0, 0], "<f4"), (4, 1)))
    made = file.primitive()
    made["attributes"] |= {"JOINTS_0": joints, "WEIGHTS_0": weights}
    joint = file.node(translation=[0, 0, 0])
    file.node(mesh=file.mesh(made), skin=file.add("skins", {"joints": [joint]}))


PLACES = {
    "NORMAL": with_attribute("NORMAL", 3),
    "TEXCOORD_0": with_attribute("TEXCOORD_0", 2),
    "TEXCOORD_1 of bytes": with_attribute("TEXCOORD_1", 2, "uint8"),
    "COLOR_0": with_attribute("COLOR_0", 4),
    "an unknown attribute": with_attribute("_OWN", 1),
    "a morph target": with_target,
    "what an animation puts out": with_animation,
    "an animation's only key": with_one_key,
    "joints": with_skin,
    "instances": with_instances,
}


@pytest.mark.parametrize("where", PLACES)
def test_zeros_wherever_an_accessor_may_stand(where: str) -> None:
    file = Gltf()
    PLACES[where](file)
    for pose in (Pose(), *(Pose(None, one["name"], 0.5) for one in file.tree.get("animations", ()))):
        scene = read_scene(file.glb(), AssetLimits(), pose)
        assert scene.triangles == (4 if where == "instances" else 2)
    merged = read_merged(file.glb(), AssetLimits())
    assert np.array_equal(np.unique(merged.vertices, axis=0), np.unique(QUAD, axis=0))


def test_indices_of_zeros_make_triangles_without_area() -> None:
    file = Gltf()
    made = file.primitive(indices=None)
    file.node(mesh=file.mesh(made | {"indices": zeros(file, "uint16", 1, 6)}))
    assert read_merged(file.glb(), AssetLimits()).faces.tolist() == [[0, 0, 0], [0, 0, 0]]


@pytest.mark.parametrize("count", [1, 3])
def test_sparse_values_stand_among_zeros(count: int) -> None:
    """Such a morph target moves the vertices that it names, and no others."""
    file = Gltf()
    where = np.arange(count, dtype="<u2")
    offsets = np.full((count, 3), 5, "<f4")
    sparse = {
        "count": count,
        "indices": {"bufferView": file.view(where.tobytes()), "componentType": 5123},
        "values": {"bufferView": file.view(offsets.tobytes())},
    }
    target = {"POSITION": zeros(file, "float32", 3, 4, sparse=sparse)}
    file.node(mesh=file.mesh(file.primitive(targets=[target]), weights=[1]))
    expected = QUAD.astype(float)
    expected[:count] += 5
    assert np.array_equal(read_merged(file.glb(), AssetLimits()).vertices, expected)


@pytest.mark.parametrize("more", [{}, {"sparse": {}}])
def test_their_count_is_bounded_before_any_memory_is_taken(more: dict[str, Any]) -> None:
    file = Gltf()
    attributes = {"POSITION": zeros(file, "float32", 3, 2**40, **more)}
    file.node(mesh=file.mesh({"attributes": attributes}))
    with pytest.raises(ParseError, match="/accessors/0/count: is 1099511627776; a mesh has at most 48000000"):
        read_merged(file.glb(), AssetLimits())


def test_zeros_take_no_memory_until_they_are_used() -> None:
    """Many attributes of a small file may ask for as many items as a mesh may have."""
    from service.formats.read.gltf import accessors
    from service.formats.read.gltf.document import GltfDocument

    file = Gltf()
    most = 3 * AssetLimits().max_triangles
    file.mesh({"attributes": {"JOINTS_0": zeros(file, "uint8", 4, most)}})
    document = GltfDocument(file.glb(), AssetLimits())
    primitive = next(next(document.root.objects("meshes")).objects("primitives"))
    rows = accessors.read(document, primitive.need("attributes"), "JOINTS_0", "VEC4")
    assert rows.shape == (most, 4) and rows.strides == (0, 1) and not rows.any()
