"""USD files as the scenes that they become: geometry, places, cameras and lights."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.document import parse_scene
from service.formats.scene_import import Imported
from service.server.assets import AssetStore
from tests.usd_files import PNG, QUAD, material, mesh, texture, usda, usdc, usdz

pytestmark = [pytest.mark.usd, pytest.mark.slow]


def imported(store: AssetStore, data: bytes) -> Imported:
    info = store.add(data)
    assert info.kind == "scene" and info.format == "usd"
    found = store.scene(info.id)
    parse_scene(found.scene({"type": "constant", "radiance": 1}))
    return found


def shapes(found: Imported) -> dict[str, Any]:
    return {shape["name"]: shape for shape in found.document["shapes"]}


def moved(shape: dict[str, Any], point: tuple[float, float, float]) -> list[float]:
    """A point of a shape in the world."""
    matrix = np.array(shape.get("transform", {"matrix": np.eye(4)})["matrix"]).reshape(4, 4)
    return (matrix @ [*point, 1])[:3].round(6).tolist()


def test_the_binary_form_and_a_package_of_layers_are_the_same_scene(store: AssetStore, tmp_path: Path) -> None:
    text = usda(f'def Xform "Car"\n{{\n{mesh("Door")}\n}}', 'metersPerUnit = 1\n    defaultPrim = "Car"')
    root = usda('def "Car" (\n    references = @./parts/car.usdc@\n)\n{\n}')
    package = usdz({"root.usda": root, "parts/car.usdc": usdc(text, tmp_path)})
    documents = [imported(store, data).document for data in (text, usdc(text, tmp_path), package)]
    assert documents[0] == documents[1] == documents[2] and documents[0]["shapes"][0]["name"] == "Car/Door"
    assert not store.info(store.add(package).id).warnings


POLYGONS = """
    int[] faceVertexCounts = [5, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 4, 2, 5, 3]
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0), (2, 3, 0)]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1)] (
        interpolation = "faceVarying"
    )
    int[] primvars:st:indices = [0, 1, 2, 1, 0, 1, 2, 0]
    uniform token subdivisionScheme = "none"
"""


def test_polygons_are_triangulated_and_split_where_their_corners_differ(store: AssetStore) -> None:
    read = "color3f inputs:diffuseColor.connect = </Looks/T.outputs:rgb>"
    image = PNG(np.full((1, 1, 3), 200, np.uint8))
    look = material("Looks", read, texture("Looks", "a.png"))
    bound = "rel material:binding = </Looks>"
    root = usda(look + mesh("Pentagon", bound, body=POLYGONS))
    found = imported(store, usdz({"root.usda": root, "a.png": image}))
    (shape,) = found.document["shapes"]
    read_back = store.mesh(shape["asset"])
    corners = read_back.vertices[read_back.faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert len(read_back.faces) == 4 and (area > 0).all()  # the pentagon is concave: a fan would turn one over
    assert area.sum() == pytest.approx(4 - 1.5 + 0.5)
    assert read_back.uvs is not None
    pairs = {(*v, *uv) for v, uv in zip(read_back.vertices[:, :2].tolist(), read_back.uvs.tolist(), strict=True)}
    assert (2, 2, 1, 1) in pairs and (2, 2, 1, 0) in pairs  # one point with two texture coordinates
    assert (1, 0.5, 1, 0) in pairs and (1, 0.5, 0, 0) in pairs


def test_subsets_have_their_own_materials_and_left_handed_faces_are_turned(store: AssetStore) -> None:
    looks = material("Red", "color3f inputs:diffuseColor = (1, 0, 0)") + material(
        "Blue", "color3f inputs:diffuseColor = (0, 0, 1)"
    )
    body = QUAD.replace("[4]", "[3, 3]").replace("[0, 1, 2, 3]", "[0, 1, 2, 0, 2, 3]")
    body += 'uniform token orientation = "leftHanded"'
    subset = """
    rel material:binding = </Red>
    def GeomSubset "Half" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </Blue>
    }"""
    found = imported(store, usda(looks + mesh("Sign", subset, body=body)))
    assert {name: shape["material"] for name, shape in shapes(found).items()} == {
        "Sign/Blue": "Blue", "Sign/Red": "Red",
    }  # fmt: skip
    half = store.mesh(shapes(found)["Sign/Blue"]["asset"])
    a, b, c = half.vertices[half.faces[0]]
    assert len(half.faces) == 1 and np.cross(b - a, c - a)[2] < 0
    assert found.document["materials"]["Blue"]["base_color"] == [0, 0, 1]


TENT = "[(-1, -1, 0), (1, -1, 0), (1, 1, 1), (-1, 1, 0)]"


def test_cages_are_smooth_and_said_to_be_cages(store: AssetStore) -> None:
    bent = QUAD.replace("[(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]", TENT)
    found = imported(store, usda(mesh("Cage", body=bent.replace('"none"', '"catmullClark"'))))
    assert "smooth" not in found.document["shapes"][0] and "cage" in found.warnings[0]["detail"]
    assert store.mesh(found.document["shapes"][0]["asset"]).normals is not None
    assert not imported(store, usda(mesh("Floor", body=QUAD.replace('"none"', '"catmullClark"')))).warnings


def test_subdivision_changes_what_is_bent_and_no_flat_floor() -> None:
    from service.formats.read.usd.subdivision import bends

    def grid(z: list[float], turned: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Two by two squares, the point on the right of the middle row moved to a side."""
        points = np.array([[x, y, z[3 * y + x]] for y in range(3) for x in range(3)], float) * 50 + 1e4
        points[5, 0] += turned
        faces = [[k, k + 1, k + 4, k + 3] for k in (0, 1, 3, 4)]
        return points, np.array(faces).reshape(-1), np.full(4, 4)

    flat = [0.0] * 9
    assert not bends(*grid(flat)) and not bends(*grid([0, 1, 2, 1, 2, 3, 2, 3, 4]))
    assert bends(*grid([0, 1, 0] * 3)), "a roof is rounded"
    assert bends(*grid([0, 0, 0, 0, 0, 1, 0, 0, 0])), "a face that is not flat"
    assert bends(*grid(flat, 10.0)), "an outline that turns at a point of two faces is rounded"
    points, corners, counts = grid(flat)
    cube = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    assert bends(cube, sides.reshape(-1), np.full(6, 4))
    assert not bends(cube[sides.reshape(-1)], np.arange(24), np.full(6, 4)), "sides of their own corners stay sharp"
    disk = np.stack([np.cos(np.arange(8.0)), np.sin(np.arange(8.0)), np.zeros(8)], axis=1)
    assert not bends(disk, np.arange(8), np.array([8])) and not bends(points, corners[:0], counts[:0])


SKINNED = """
def SkelRoot "Arm"
{
    def Skeleton "Bones" (
        prepend apiSchemas = ["SkelBindingAPI"]
    )
    {
        uniform token[] joints = ["Root", "Root/Tip"]
        uniform matrix4d[] bindTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
        ]
        uniform matrix4d[] restTransforms = [
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
            ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
        ]
        rel skel:animationSource = </Arm/Walk>
    }
    def SkelAnimation "Walk"
    {
        uniform token[] joints = ["Root", "Root/Tip"]
        float3[] translations.timeSamples = { 5: [(0, 0, 0), (0, 0, 3)], 9: [(0, 0, 0), (0, 0, 8)] }
        quatf[] rotations = [(1, 0, 0, 0), (1, 0, 0, 0)]
        half3[] scales = [(1, 1, 1), (1, 1, 1)]
    }
    def Mesh "Skin" (
        prepend apiSchemas = ["SkelBindingAPI", "MaterialBindingAPI"]
    )
    {
        QUAD
        rel skel:skeleton = </Arm/Bones>
        int[] primvars:skel:jointIndices = [0, 0, 1, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
        float[] primvars:skel:jointWeights = [1, 1, 1, 1] (
            elementSize = 1
            interpolation = "vertex"
        )
    }
}
""".replace("QUAD", QUAD)


@pytest.mark.parametrize("head", ["startTimeCode = 4\n    endTimeCode = 9", ""])
def test_skinned_meshes_stand_as_their_skeletons_do_at_first(store: AssetStore, head: str) -> None:
    found = imported(store, usda(SKINNED, f"metersPerUnit = 1\n    {head}"))
    (shape,) = found.document["shapes"]
    assert store.mesh(shape["asset"]).vertices[:, 2].tolist() == [0, 0, 3, 3]
    still = SKINNED.replace("translations.timeSamples = { 5: [(0, 0, 0), (0, 0, 3)], 9: [(0, 0, 0), (0, 0, 8)] }",
                            "translations = [(0, 0, 0), (0, 0, 7)]")  # fmt: skip
    (shape,) = imported(store, usda(still)).document["shapes"]
    assert store.mesh(shape["asset"]).vertices[:, 2].tolist() == [0, 0, 7, 7]


def test_hidden_things_are_left_out(store: AssetStore) -> None:
    hidden = mesh("Guide", 'uniform token purpose = "guide"') + mesh("Proxy", 'uniform token purpose = "proxy"')
    off = f'def Xform "Off"\n{{\n token visibility = "invisible"\n{mesh("Inside")}\n}}\n'
    shown = mesh("Render", 'uniform token purpose = "render"')
    found = imported(store, usda(hidden + off + shown + mesh("Class").replace("def Mesh", "class Mesh")))
    assert list(shapes(found)) == ["Render"]


def test_instances_share_their_meshes(store: AssetStore) -> None:
    """Native instances, and a point instancer with a hidden one; prototypes are not shown by themselves."""
    chair = f'class Xform "Chair"\n{{\n{mesh("Seat")}\n}}\n'
    at = 'double3 xformOp:translate = ({}, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    native = "".join(
        f'def Xform "C{k}" (\n instanceable = true\n references = </Chair>\n)\n{{\n{at.format(k)}\n}}\n'
        for k in (1, 2)
    )
    moved_seat = mesh("Leaf", at.format(5))
    instancer = f"""
    def PointInstancer "Tree"
    {{
        {at.format(100)}
        rel prototypes = </Tree/Leaf>
        int[] protoIndices = [0, 0, 0]
        point3f[] positions = [(0, 0, 1), (0, 0, 2), (0, 0, 3)]
        quath[] orientations = [(1, 0, 0, 0), (0.70710678, 0, 0, 0.70710678), (1, 0, 0, 0)]
        float3[] scales = [(1, 1, 1), (2, 2, 2), (1, 1, 1)]
        int64[] ids = [7, 8, 9]
        int64[] invisibleIds = [9]
        {moved_seat}
    }}"""
    found = imported(store, usda(chair + native + instancer))
    placed = found.document["shapes"]
    assert len({shape["asset"] for shape in placed}) == 1 and len(placed) == 4
    assert [moved(shape, (0, 0, 0)) for shape in placed[:2]] == [[1, 0, 0], [2, 0, 0]]
    # The prototype's own transform counts, and is scaled and turned with the instance.
    assert moved(placed[2], (0, 0, 0)) == [105, 0, 1] and moved(placed[3], (1, 0, 0)) == pytest.approx(
        [100, 12, 2], abs=0.01
    )  # half floats


def test_bodies_are_analytic_shapes_or_triangles_of_the_right_size(store: AssetStore) -> None:
    text = """
    def Sphere "S" { double radius = 3 }
    def Cube "C" { double size = 4 }
    def Cylinder "T" { double radius = 2
        double height = 10
        uniform token axis = "X" }
    def Cone "K" { double radius = 2
        double height = 6
        color3f[] primvars:displayColor = [(0.25, 0.5, 0.75)] }
    def Capsule "P" { double radius = 1
        double height = 2 }
    def Plane "F" { double width = 6
        double length = 2
        uniform token axis = "Y" }
    def BasisCurves "Hair" { }
    """
    found = imported(store, usda(text.replace("{ ", "{\n").replace(" }", "\n}")))
    named = shapes(found)
    assert named["S"] | {"material": ""} == {
        "name": "S", "type": "sphere", "center": [0, 0, 0], "radius": 3, "material": "",
    }  # fmt: skip
    assert named["C"]["min"] == [-2] * 3 and named["C"]["max"] == [2] * 3
    assert np.cross(named["F"]["u"], named["F"]["v"]).tolist() == [0, 12, 0] and "Hair" not in named
    assert found.document["materials"][named["K"]["material"]]["base_color"] == [0.25, 0.5, 0.75]
    tube = {"type": "cylinder", "base": [-5, 0, 0], "axis": [10, 0, 0], "radius": 2}
    assert {name: named["T"][name] for name in tube} == tube
    # By the divergence theorem: a closed mesh that faces outwards has this volume.
    closed = {"K": math.pi * 4 * 6 / 3, "P": math.pi * (2 + 4 / 3)}
    for name, volume in closed.items():
        solid = store.mesh(named[name]["asset"])
        a, b, c = (solid.vertices[solid.faces[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=3e-3), name


def test_the_camera(store: AssetStore) -> None:
    """Focal length and apertures are in tenths of a unit: with centimetres, in millimetres."""
    camera = """
    def Camera "Cam"
    {
        float focalLength = 50
        float horizontalAperture = 36
        float verticalAperture = 24
        float fStop = 2
        float focusDistance = 400
        double3 xformOp:translate = (0, 0, 500)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }"""
    info = store.add(usda(mesh("Sign") + camera + camera.replace('"Cam"', '"Other"'), "metersPerUnit = 0.01"))
    found = store.scene(info.id)
    seen = found.document["camera"]
    assert seen["vfov"] == pytest.approx(2 * math.degrees(math.atan(12 / 50))) and info.aspect_ratio == 1.5
    assert seen["position"] == [0, 0, 5] and seen["target"] == pytest.approx([0, 0, 0], abs=1e-6)
    assert seen["aperture_radius"] == pytest.approx(0.025 / 2) and seen["focus_distance"] == pytest.approx(4)
    assert [w["pointer"] for w in found.warnings if "not used" in w["detail"]] == ["/Other"]


def light(kind: str, name: str, values: str, api: str = "") -> str:
    head = f'(\n    prepend apiSchemas = ["{api}"]\n)' if api else ""
    return f'def {kind} "{name}" {head}\n{{\n{values}\n}}\n'


def test_lights_have_the_brightness_that_usdlux_says(store: AssetStore) -> None:
    text = mesh("Floor")
    normalized = "\nbool inputs:normalize = 1"
    text += light("DistantLight", "Sun", f"float inputs:intensity = 3\nfloat inputs:angle = 2{normalized}")
    text += light("DistantLight", "Moon", "float inputs:intensity = 1000\nfloat inputs:angle = 2")
    bulb = "float inputs:intensity = 5\nfloat inputs:exposure = 1\nbool treatAsPoint = 1"
    text += light("SphereLight", "Bulb", bulb)
    cone = "float inputs:shaping:cone:angle = 30\nfloat inputs:shaping:cone:softness = 0.5"
    text += light("SphereLight", "Spot", f"{cone}\nfloat inputs:intensity = 5", "ShapingAPI")
    rect = f"float inputs:width = 20\nfloat inputs:height = 50\nfloat inputs:intensity = 8000{normalized}"
    text += light("RectLight", "Panel", rect + "\ncolor3f inputs:color = (1, 0.5, 0)")
    text += light("DiskLight", "Disk", "float inputs:radius = 30\nfloat inputs:intensity = 4")
    text += light("SphereLight", "Ball", "float inputs:radius = 30\nfloat inputs:intensity = 4")
    text += light("CylinderLight", "Tube", f"float inputs:length = 80\nfloat inputs:radius = 5{normalized}")
    text += light("PortalLight", "Portal", "")
    found = imported(store, usda(text, "metersPerUnit = 0.01"))
    named = {each["name"]: each for each in found.document["lights"]}
    assert named["Sun"]["irradiance"] == [3, 3, 3] and named["Sun"]["direction"] == pytest.approx([0, 0, -1])
    solid = math.pi * math.sin(math.radians(1)) ** 2  # the disk's, weighted by the cosine
    assert named["Moon"]["irradiance"] == pytest.approx([1000 * solid] * 3) and named["Moon"]["angular_diameter"] == 2
    radius = 0.005  # half a centimetre
    assert named["Bulb"]["intensity"] == pytest.approx([10 * math.pi * radius**2] * 3)
    assert named["Spot"]["inner_angle"] == 15 and named["Spot"]["outer_angle"] == 30
    placed = shapes(found)
    materials = found.document["materials"]
    radiance = {name: materials[shape["material"]]["emission"] for name, shape in placed.items() if name != "Floor"}
    side = 2 * math.pi * 5 * 80
    assert radiance.pop("Tube") == pytest.approx([1 / side] * 3)
    assert radiance == {"Panel": [8, 4, 0], "Disk": [4, 4, 4], "Ball": [4, 4, 4]}  # normalised by 20 x 50 units
    tube = placed["Tube"]
    assert tube["axis"] == pytest.approx([0.8, 0, 0]) and tube["base"] == pytest.approx([-0.4, 0, 0])
    assert tube["radius"] == pytest.approx(0.05) and tube["caps"] is False
    panel = placed["Panel"]
    assert np.cross(panel["u"], panel["v"]) == pytest.approx([0, 0, -0.1]) and not panel["visible_to_camera"]
    assert np.add(panel["origin"], np.add(panel["u"], panel["v"]) / 2) == pytest.approx([0, 0, 0])
    assert placed["Disk"]["radius"] == pytest.approx(0.3) and placed["Disk"]["normal"] == [0, 0, -1]
    assert [w["pointer"] for w in found.warnings if "PortalLight" in w["detail"]] == ["/Portal"]
    assert found.lit


@pytest.mark.parametrize(("axis", "turn"), [("Y", 0), ("Y", 30), ("Z", 0), ("Z", 30)])
def test_a_dome_stands_as_openexr_has_it(store: AssetStore, axis: str, turn: int) -> None:
    """The texel a quarter to the left of the middle shows +X, turned about the vertical with the light. Where z
    points up a dome is stood up by its own transform."""
    order = 'uniform token[] xformOpOrder = ["xformOp:rotateX", "xformOp:rotateY"]'
    raised = f"float xformOp:rotateX = {90 if axis == 'Z' else 0}\nfloat xformOp:rotateY = {turn}\n{order}"
    dome = light("DomeLight", "Sky", f"asset inputs:texture:file = @sky.png@\nfloat inputs:intensity = 2\n{raised}")
    image = PNG(np.zeros((2, 4, 3), np.uint8))
    head = f'metersPerUnit = 1\n    upAxis = "{axis}"'
    found = imported(store, usdz({"a.usda": usda(mesh("Floor") + dome, head), "sky.png": image}))
    sky = found.document["environment"]
    assert sky["type"] == "image" and sky["scale"] == 2 and store.image(sky["asset"]).pixels.shape == (2, 4, 3)
    # u = 1/4 is seen where 1/2 + atan2(x, -z) / (2 pi) is that, in the direction -X before the document's rotation.
    angle = math.radians(sky["rotation"])
    seen = [-math.cos(angle), math.sin(angle)]  # x and z of R_y(rotation) (-1, 0, 0)
    assert seen == pytest.approx([math.cos(math.radians(turn)), -math.sin(math.radians(turn))], abs=1e-6)
    assert not found.warnings


def test_all_of_it_as_one_mesh(store: AssetStore) -> None:
    place = 'double3 xformOp:translate = (0, 0, 4)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    info = store.add(usda(mesh("A", place) + mesh("B") + 'def Cube "C"\n{\n}'))
    whole = store.mesh(info.id)
    assert len(whole.faces) == 2 + 2 + 12 and info.triangles == len(whole.faces)
    assert np.array(whole.bounds).tolist() == info.bounds == [[-1, -1, -1], [1, 1, 4]]


@pytest.mark.usd
def test_a_cage_with_a_bad_face_is_told_as_any_other(store: AssetStore) -> None:
    """Whether subdivision would bend it is asked of the faces that are left."""
    layer = b"""#usda 1.0
def Mesh "M" {
    int[] faceVertexCounts = [4, 3, 3]
    int[] faceVertexIndices = [0, 1, 2, 3, 0, 1, 9, 0, 1, 4]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0), (nan, 0, 0)]
}
"""
    info = store.add(layer, filename="a.usda")
    details = [warning["detail"] for warning in info.warnings or []]
    assert info.triangles == 2 and any("2 face" in detail for detail in details)
    assert any("subdivision" in detail for detail in details)
