"""What a USD file leaves out or says in an unusual way: it is shown where it has a meaning, else told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from service.formats.scene_import import Imported
from service.problems import AssetError
from service.server.assets import AssetStore
from tests.usd_files import PNG, QUAD, material, mesh, texture, usda, usdc, usdz
from tests.usd_looks import CHANNELS

pytestmark = [pytest.mark.usd, pytest.mark.slow]

LOOKS = "".join(
    material(name, f"color3f inputs:diffuseColor = {color}")
    for name, color in (("Red", "(1, 0, 0)"), ("Green", "(0, 1, 0)"), ("Blue", "(0, 0, 1)"))
)
BALL = 'def Sphere "S"\n{\n}\n'


def scene(store: AssetStore, body: str, head: str = "metersPerUnit = 1") -> Imported:
    return store.scene(store.add(usda(body, head)).id)


def told(found: Imported) -> list[tuple[str, str]]:
    return [(warning["pointer"], warning["detail"]) for warning in found.warnings]


@pytest.mark.parametrize(
    ("binding", "shown"),
    [
        ("binding", "Red"), ("binding:full", "Red"), ("binding:preview", "Red"),
        ("binding:preview = </Blue>\nrel material:binding", "Red"),
        ("binding = </Blue>\nrel material:binding:full", "Red"),
        ("binding = </Red> (\n    bindMaterialAs = \"weakerThanDescendants\"\n)\nrel x", "Red"),
    ],
)  # fmt: skip
def test_bindings_of_every_purpose(store: AssetStore, binding: str, shown: str) -> None:
    """Final pictures take what is bound for them, else for all, else for previews; a mesh inherits it."""
    api = 'def Xform "X" (\n    prepend apiSchemas = ["MaterialBindingAPI"]\n)\n{\n'
    for body in (
        mesh("M", f"rel material:{binding} = </Red>"),
        f"{api}rel material:{binding} = </Red>\n{mesh('M')}}}",
    ):
        found = scene(store, LOOKS + body)
        assert found.document["shapes"][0]["material"] == shown and not found.warnings


def test_a_material_that_is_not_there_is_told(store: AssetStore) -> None:
    ((pointer, detail),) = told(scene(store, mesh("M", "rel material:binding = </Gone>")))
    assert pointer == "/M" and "the material /Gone that it names is not in this file" in detail


def subset(element: str, indices: str) -> str:
    return f"""def GeomSubset "S" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{{
    uniform token elementType = "{element}"
    uniform token familyName = "materialBind"
    int[] indices = {indices}
    rel material:binding = </Red>
}}"""


@pytest.mark.parametrize(
    ("element", "indices", "shown", "said"),
    [
        ("face", "[0]", "Red", ""), ("face", "[0, 9, -1]", "Red", "names face 9; there are 1"),
        ("point", "[0]", "default", "a subset that is not of faces"),
    ],
)  # fmt: skip
def test_one_bad_subset_refuses_nothing(store: AssetStore, element: str, indices: str, shown: str, said: str) -> None:
    found = scene(store, LOOKS + mesh("M", subset(element, indices)))
    assert [shape["material"] for shape in found.document["shapes"]] == [shown]
    assert [pointer for pointer, _ in told(found)] == (["/M/S"] if said else [])
    assert not said or said in told(found)[0][1]


def instancer(indices: str, more: str = "") -> str:
    return f"""def PointInstancer "I"
{{
    int[] protoIndices = {indices}
    point3f[] positions = [(0, 0, 0), (3, 0, 0), (6, 0, 0)]
    rel prototypes = [</I/P>, </I/Gone>]
    {more}
    def Xform "P"
    {{
        double3 xformOp:translate = (0, 0, 5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        {BALL}
    }}
}}"""


def test_one_bad_instance_refuses_nothing(store: AssetStore) -> None:
    colors = 'color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1)] (\n    interpolation = "vertex"\n)'
    found = scene(store, instancer("[0, 7, 1]", colors))
    (shape,) = found.document["shapes"]
    assert np.array(shape["transform"]["matrix"]).reshape(4, 4)[:3, 3].tolist() == [0, 0, 5]
    details = " ".join(detail for _, detail in told(found))
    assert "1 instances name prototypes that do not exist, the first: 7; there are 2" in details
    assert "its prototype /I/Gone is not in this file" in details and "displayColor of each instance" in details


def test_a_mesh_whose_counts_are_wrong_is_left_out_alone(store: AssetStore) -> None:
    found = scene(store, mesh("M", body=QUAD.replace("[4]", "[5]")) + BALL)
    assert [shape["type"] for shape in found.document["shapes"]] == ["sphere"]
    assert ("/M", "5 corners make its faces, and it has 4; the mesh is left out") in told(found)


def test_a_mesh_without_the_coordinates_that_its_material_reads_is_told(store: AssetStore) -> None:
    look = material("Look", "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>", texture("Look", "a.png"))
    root = usda(look + mesh("M", "rel material:binding = </Look>"))
    found = store.scene(store.add(usdz({"a.usda": root, "a.png": PNG(CHANNELS)})).id)
    assert told(found) == [("/M", "it has no coordinates 'st', which its material reads; 0 0 is used everywhere")]


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ('def Xform "X"\n{\ntoken visibility = "invisible"\n' + BALL + "}", "it is invisible"),
        ('def Sphere "S"\n{\nuniform token purpose = "proxy"\n}', "its purpose is proxy"),
        (mesh("M", "float3 xformOp:scale = (1, 0, 1)\nuniform token[] xformOpOrder = [\"xformOp:scale\"]"), "flat"),
        ('def BasisCurves "B"\n{\n}', "BasisCurves is not supported"),
    ],
)  # fmt: skip
def test_a_refusal_says_why_nothing_is_shown(store: AssetStore, body: str, why: str) -> None:
    with pytest.raises(AssetError, match=f"the scene has no triangles: .*{why}"):
        scene(store, body)


def test_units_of_another_type_are_read_as_numbers(store: AssetStore, tmp_path: Path) -> None:
    """Blender 2.8 writes metersPerUnit in single precision, which the library's own function refuses."""
    layer, double, single = usdc(usda(BALL, "metersPerUnit = 1.5"), tmp_path), b"\xc0?\0\0\x09@", b"\xc0?\0\0\x08@"
    assert layer.count(double) == 1
    (shape,) = store.scene(store.add(layer.replace(double, single)).id).document["shapes"]
    assert shape["transform"]["matrix"][0] == 1.5
    found = scene(store, BALL, 'upAxis = "X"')
    assert [pointer for pointer, _ in told(found)] == ["upAxis"]


@pytest.mark.parametrize(
    ("camera", "stops"),
    [("float exposure = 2", "2"), ("float exposure:time = 0.25", "-2"), ("float exposure = 0", "")],
)  # fmt: skip
def test_a_camera_s_exposure_is_told(store: AssetStore, camera: str, stops: str) -> None:
    found = scene(store, f'{BALL}def Camera "C"\n{{\n{camera}\n}}')
    assert told(found) == ([("/C", f"the camera's exposure of {stops} stops is not applied")] if stops else [])


def test_lights_have_colour_spaces_and_sizes(store: AssetStore) -> None:
    color = 'color3f inputs:color = (0.5, 0.5, 0.5) (\n    colorSpace = "srgb_texture"\n)'
    found = scene(store, f'{BALL}def SphereLight "L"\n{{\n{color}\n}}')
    assert found.document["materials"]["L"]["emission"] == pytest.approx([0.2140411] * 3)
    none = scene(store, f'{BALL}def SphereLight "L"\n{{\nfloat inputs:radius = 0\n}}')
    assert not none.document.get("lights") and told(none)[-1] == ("/L", "a light without an area is left out")


def test_bodies_with_two_radii_and_an_opacity(store: AssetStore) -> None:
    given = (
        "double radiusBottom = 1\ndouble radiusTop = {}\ndouble height = 2\nfloat[] primvars:displayOpacity = [0.5]"
    )
    for kind, top, extent in (("Cylinder_1", 1, 1), ("Cylinder_1", 0.5, 1), ("Capsule_1", 0.5, 1.5)):
        found = scene(store, f'def {kind} "B"\n{{\n{given.format(top)}\n}}')
        assert found.document["materials"]["default"]["alpha"] == 0.5
        assert found.bounds is not None and found.bounds[1][2] == pytest.approx(extent, abs=1e-6)
        (shape,) = found.document["shapes"]
        assert shape["type"] == ("cylinder" if top == 1 else "mesh")


@pytest.mark.parametrize(
    ("line", "name", "value"),
    [('string inputs:roughness = "0.9"', "roughness", 0.5), ('token inputs:opacityMode = "x"', "opacityMode", None)],
)
def test_words_in_place_of_a_number_are_told(store: AssetStore, line: str, name: str, value: float | None) -> None:
    found = scene(store, material("Look", line) + mesh("S", "rel material:binding = </Look>"))
    assert found.document["materials"]["Look"].get(name) == value
    assert (f"/Look/S.inputs:{name}", "the parameter has its default") == (
        told(found)[0][0], told(found)[0][1].partition("; ")[2],
    )  # fmt: skip
