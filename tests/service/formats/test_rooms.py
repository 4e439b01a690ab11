"""Closed rooms: the default camera stands inside, and a lamp is there where nothing else shines."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.formats.read.gltf.importer import read_scene
from service.formats.read.scenes.framing import framed
from service.formats.read.scenes.plain_mesh import plain_scene
from service.formats.read.scenes.rays import Placed
from service.formats.read.scenes.room import stand_inside
from service.formats.read.zips.importer import read_zip
from service.formats.sandbox.readers import parse_mesh
from service.formats.types import AssetLimits
from tests import asset_files as make
from tests.obj_files import zipped

LOW, HIGH = np.array([10.0, 0.0, -2.0]), np.array([16.0, 2.5, 2.0])
SIDES = {  # corners of a box by the sides that they make, counter-clockwise from outside
    "left": [0, 1, 3, 2], "right": [4, 6, 7, 5], "floor": [0, 4, 5, 1],
    "ceiling": [2, 3, 7, 6], "back": [0, 2, 6, 4], "front": [1, 5, 7, 3],
}  # fmt: skip


def box(low: Any, high: Any, inwards: bool = False, without: str = "", two_sided: bool = False) -> Placed:
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(-1, 3)
    quads = [quad for name, quad in SIDES.items() if name != without]
    faces = np.array([[q[0], q[k], q[k + 1]] for q in quads for k in (1, 2)], np.int32)
    return Placed(corners.astype(float), faces[:, ::-1] if inwards else faces, np.eye(4), two_sided, "m")


def room(**options: Any) -> Placed:
    return box(LOW, HIGH, inwards=True, **options)


TABLE = box([12.4, 0.0, -0.6], [13.6, 0.8, 0.6])
SHELF = box([10.01, 0.0, -1.8], [11.0, 2.2, 1.8])


def shown(*placed: Placed, has_camera: bool = False, **changes: Any) -> tuple[dict[str, Any], str | None]:
    corners = np.concatenate([one.vertices @ one.world[:3, :3].T + one.world[:3, 3] for one in placed])
    bounds = corners.min(axis=0), corners.max(axis=0)
    document = {"camera": framed(bounds), "materials": {"m": {"type": "diffuse", "albedo": 0.5}}, **changes}
    return document, stand_inside(document, list(placed), bounds, has_camera)


def is_within(position: list[float], low: Any = LOW, high: Any = HIGH) -> bool:
    return bool((np.array(position) > low).all() and (np.array(position) < high).all())


def is_inside(camera: dict[str, Any]) -> bool:
    return is_within(camera["position"])


def mirrored(one: Placed) -> Placed:
    """Its image in the plane x = 0, moved back to where it stood: under a matrix that mirrors."""
    world = np.diag([-1.0, 1.0, 1.0, 1.0])
    world[0, 3] = LOW[0] + HIGH[0]
    return Placed(one.vertices, one.faces, world, one.is_two_sided, one.material)


CLOSED = {
    "empty": [room()],
    "furnished": [room(), TABLE, SHELF],
    "two-sided, with a table": [room(two_sided=True), TABLE],
    "mirrored": [mirrored(room()), TABLE],
}


@pytest.mark.parametrize("name", CLOSED)
def test_a_camera_stands_inside_of_a_closed_room(name: str) -> None:
    document, told = shown(*CLOSED[name])
    assert is_inside(document["camera"]) and told is not None and "the camera stands inside" in told
    (lamp,) = document["lights"]
    assert is_within(lamp["position"]) and lamp["intensity"] > 0


OTHERS = {
    "solid": [box(LOW, HIGH)],
    "mirrored solid": [mirrored(box(LOW, HIGH))],
    "solid turned inside out": [room(two_sided=True)],
    "without ceiling": [room(without="ceiling"), TABLE],
    "without a wall": [room(without="front"), TABLE],
    "floor with a table": [box(LOW, [*HIGH[:1], 0.0, HIGH[2]], inwards=True), TABLE],
    "walls with an outside": [room(), box(LOW - 0.2, HIGH + 0.2)],
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_is_no_closed_room_is_seen_from_outside(name: str) -> None:
    document, told = shown(*OTHERS[name])
    assert told is None and not is_inside(document["camera"]) and "lights" not in document


def test_the_camera_stands_in_no_furniture() -> None:
    """A shelf fills one end of the room: there it would see the backs of the shelf's walls, or nothing."""
    document, _ = shown(room(), SHELF)
    assert not is_within(document["camera"]["position"], SHELF.vertices.min(axis=0), SHELF.vertices.max(axis=0))


def test_a_room_with_light_of_its_own_gets_no_lamp() -> None:
    glow = {"type": "diffuse", "albedo": 0, "emission": 5}
    document, told = shown(room(), TABLE, materials={"m": glow})
    assert is_inside(document["camera"]) and "lights" not in document and told is not None and "lamp" not in told
    sun = [{"type": "point", "position": [12, 2, 0], "intensity": 5}]
    assert shown(room(), TABLE, lights=sun)[0]["lights"] == sun


def test_the_camera_of_a_file_stays_and_gets_a_lamp() -> None:
    own = {"position": [11, 1, 0], "target": [15, 1, 0], "vfov": 50}
    document, told = shown(room(), TABLE, has_camera=True, camera=own)
    assert document["camera"] == own and len(document["lights"]) == 1
    assert told == "the model is a closed room that no light enters: a lamp is added"


def glb(*parts: Placed) -> bytes:
    """Each part as a primitive of one mesh, single-sided, without normals."""
    tree = make.gltf(accessors=[], bufferViews=[], meshes=[{"primitives": []}])
    buffer = b""
    for one in parts:
        corners = one.vertices[one.faces.reshape(-1)].astype("<f4")
        tree["meshes"][0]["primitives"].append({"attributes": {"POSITION": len(tree["accessors"])}})
        view = {"buffer": 0, "byteOffset": len(buffer), "byteLength": corners.nbytes}
        tree["accessors"].append(
            {"bufferView": len(tree["bufferViews"]), "componentType": 5126, "count": len(corners), "type": "VEC3"}
        )
        tree["bufferViews"].append(view)
        buffer += corners.tobytes()
    return make.glb(tree | {"buffers": [{"byteLength": len(buffer)}]}, buffer)


def obj(*parts: Placed) -> str:
    corners = np.concatenate([one.vertices[one.faces.reshape(-1)] for one in parts])
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    return "\n".join(lines + [f"f {k} {k + 1} {k + 2}" for k in range(1, len(corners), 3)]) + "\n"


def test_every_importer_looks_for_rooms() -> None:
    limits = AssetLimits()
    from_gltf = read_scene(glb(room(), TABLE), limits)
    from_obj = read_zip(zipped({"m.obj": obj(room(), TABLE)}), limits)
    for file in (from_gltf, from_obj):
        assert is_inside(file.document["camera"]) and len(file.document["lights"]) == 1 and not file.lit
        assert any("the camera stands inside" in warning["detail"] for warning in file.warnings)
    alone = parse_mesh("obj", memoryview(obj(room(), TABLE).encode()), limits)
    document, told = plain_scene("x", alone)
    assert is_inside(document["camera"]) and len(document["lights"]) == 1 and told is not None
    outside = read_scene(glb(box(LOW, HIGH), TABLE), limits)
    assert not is_inside(outside.document["camera"]) and not outside.warnings
