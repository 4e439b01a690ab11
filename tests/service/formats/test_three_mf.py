"""3MF packages: parts that name parts, properties of triangles, and what is broken in them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from service.colorimetry import decode_srgb
from service.config import Config
from service.formats.errors import ParseError
from service.formats.sandbox.readers import parse_mesh
from service.formats.sandbox.sandbox import Sandbox
from service.formats.types import AssetLimits, SceneFile
from service.server.assets.store import asset_limits
from tests import asset_files as make
from tests.service.formats.foreign_files import three_mf

VERTICES = "".join(f'<vertex x="{x}" y="{y}" z="0"/>' for x, y in ((0, 0), (1, 0), (1, 1), (0, 1)))
SQUARE = '<triangle v1="0" v2="1" v3="2"/><triangle v1="0" v2="2" v3="3"/>'
SPACES = (
    'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02" '
    'xmlns:m="http://schemas.microsoft.com/3dmanufacturing/material/2015/02" '
    'xmlns:p="http://schemas.microsoft.com/3dmanufacturing/production/2015/06"'
)


def mesh(triangles: str = SQUARE, id: int = 1, more: str = "", vertices: str = VERTICES) -> str:
    inner = f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"
    return f'<object id="{id}" type="model" {more}>{inner}</object>'


def model(resources: str, build: str = '<item objectid="1"/>', spaces: str = SPACES) -> str:
    return f'<model unit="meter" {spaces}><resources>{resources}</resources><build>{build}</build></model>'


@pytest.fixture(scope="module")
def sandbox() -> Iterator[Sandbox]:
    with Sandbox(asset_limits(Config())) as found:
        yield found


def details(scene: SceneFile) -> list[str]:
    return [each["detail"] for each in scene.warnings]


def materials(scene: SceneFile) -> dict[str, Any]:
    found: dict[str, Any] = scene.document["materials"]
    return found


def bounds(scene: SceneFile) -> np.ndarray:
    assert scene.bounds is not None
    return np.array(scene.bounds)


def test_objects_of_other_parts(sandbox: Sandbox) -> None:
    """The production extension: ids are a part's own, and parts name others by path."""
    red = '<basematerials id="1"><base name="Red" displaycolor="#FF0000"/></basematerials>'
    blue = '<basematerials id="1"><base name="Blue" displaycolor="#0000FF"/></basematerials>'
    move = 'transform="1 0 0 0 1 0 0 0 1 4 0 0"'
    parts = {
        "3D/Objects/a.model": model(red + mesh(id=2, more='pid="1" pindex="0"'), ""),
        "3D/Objects/B.model": model(blue + mesh(id=2, more='pid="1" pindex="0"'), ""),
    }
    root = model(
        f'<object id="1"><components><component objectid="2" p:path="/3D/Objects/a.model"/>'
        f'<component objectid="2" p:path="/3D/Objects/b.model" {move}/></components></object>',
        '<item objectid="1" transform="2 0 0 0 2 0 0 0 2 0 0 1"/><item objectid="2" p:path="/3D/Objects/a.model"/>',
    )
    scene = sandbox.parse_scene("3mf", three_mf(root, parts))
    assert len(scene.document["shapes"]) == 3 and not details(scene)
    assert materials(scene)["Red"]["base_color"] == [1, 0, 0] and materials(scene)["Blue"]["base_color"] == [0, 0, 1]
    assert np.allclose(bounds(scene), [[0, 0, -2], [10, 1, 0]])


def test_a_part_that_is_not_there(sandbox: Sandbox) -> None:
    scene = sandbox.parse_scene(
        "3mf", three_mf(model(mesh(), '<item objectid="1"/><item objectid="7" p:path="/x"/>'))
    )
    assert scene.triangles == 2
    assert details(scene) == [
        "the part '/x' is not there; what it holds is left out",
        "the object '7' is not there; it is left out",
    ]


def test_triangles_of_several_materials(sandbox: Sandbox) -> None:
    bases = '<basematerials id="5"><base name="A" displaycolor="#FF0000"/><base name="B" displaycolor="#00FF0080"/>'
    two = '<triangle v1="0" v2="1" v3="2" pid="5" p1="1"/><triangle v1="0" v2="2" v3="3"/>'
    scene = sandbox.parse_scene(
        "3mf", three_mf(model(bases + "</basematerials>" + mesh(two, more='pid="5" pindex="0"')))
    )
    assert materials(scene)["A"]["base_color"] == [1, 0, 0] and "alpha" not in materials(scene)["A"]
    assert materials(scene)["B"]["base_color"] == [0, 1, 0]
    assert materials(scene)["B"]["alpha"] == pytest.approx(128 / 255) and not details(scene)


def test_metals(sandbox: Sandbox) -> None:
    bases = '<basematerials id="5" displaypropertiesid="9"><base name="A" displaycolor="#808080"/></basematerials>'
    metal = '<m:pbmetallicdisplayproperties id="9"><m:pbmetallic metallicness="1" roughness="0.25"/>'
    text = model(metal + "</m:pbmetallicdisplayproperties>" + bases + mesh(more='pid="5" pindex="0"'))
    found = materials(sandbox.parse_scene("3mf", three_mf(text)))["A"]
    assert found["metallic"] == 1 and found["roughness"] == 0.25
    assert found["base_color"] == pytest.approx(float(decode_srgb(np.array(128 / 255))), rel=1e-6)


def colors(text: str) -> np.ndarray:
    found = parse_mesh("3mf", memoryview(three_mf(text)), AssetLimits())
    assert found.colors is not None
    return found.colors[found.faces][:, :, :3]


COLORS = "".join(f'<m:color color="#{each}"/>' for each in ("FF0000", "00FF00", "808080"))
GROUP = f'<m:colorgroup id="5">{COLORS}</m:colorgroup>'


def test_colours_are_of_corners_and_srgb() -> None:
    """A vertex has another colour in each triangle."""
    grey = float(decode_srgb(np.array(128 / 255)))
    two = (
        '<triangle v1="0" v2="1" v3="2" pid="5" p1="0" p2="0" p3="1"/><triangle v1="0" v2="2" v3="3" pid="5" p1="2"/>'
    )
    red, green = (1, 0, 0), (0, 1, 0)
    assert np.allclose(colors(model(GROUP + mesh(two))), [[red, red, green], [(grey,) * 3] * 3], atol=1e-6)
    assert np.allclose(colors(model(GROUP + mesh(more='pid="5" pindex="1"'))), [[green] * 3] * 2)


def test_textures_stand_as_in_the_file(sandbox: Sandbox) -> None:
    group = (
        '<m:texture2d id="4" path="/3D/Textures/a.png" contenttype="image/png" tilestyleu="clamp"/>'
        '<m:texture2dgroup id="5" texid="4"><m:tex2coord u="0" v="0"/><m:tex2coord u="1" v="0.25"/>'
        "</m:texture2dgroup>"
    )
    text = model(group + mesh('<triangle v1="0" v2="1" v3="2" pid="5" p1="0" p2="1" p3="1"/>'))
    image = make.png(np.full((2, 2, 3), 128, np.uint8))
    scene = sandbox.parse_scene("3mf", three_mf(text, {"3D/Textures/A.PNG": image}))
    (found,) = materials(scene).values()
    (texture,) = scene.document["textures"].values()
    assert found["base_color"]["texture"] in scene.document["textures"] and not details(scene)
    assert "clamp" in str(texture)
    plain = parse_mesh("3mf", memoryview(three_mf(text, {"3D/Textures/A.PNG": image})), AssetLimits())
    assert plain.uvs is not None
    assert np.allclose(plain.uvs[plain.faces], [[(0, 0), (1, 0.25), (1, 0.25)]])
    missing = sandbox.parse_scene("3mf", three_mf(text))
    assert "the texture '/3D/Textures/a.png' is not there; its surface is shown without it" in details(missing)


def test_mixtures_and_several_properties(sandbox: Sandbox) -> None:
    bases = (
        '<basematerials id="5"><base name="A" displaycolor="#FF0000"/><base name="B" displaycolor="#0000FF"/>'
        '</basematerials><m:compositematerials id="6" matid="5" matindices="1 0"><m:composite values="1 3"/>'
        '</m:compositematerials><m:multiproperties id="7" pids="6 8"><m:multi pindices="0 1"/></m:multiproperties>'
    )
    scene = sandbox.parse_scene("3mf", three_mf(model(bases + mesh(more='pid="6" pindex="0"'))))
    expected = decode_srgb(np.array([0.75, 0, 0.25]))
    assert materials(scene)["composite"]["base_color"] == pytest.approx(expected.tolist()) and not details(scene)
    several = model(GROUP.replace('"5"', '"8"') + bases + mesh(more='pid="7" pindex="0"'))
    assert np.allclose(colors(several), [[(0, 1, 0)] * 3] * 2)
    assert details(sandbox.parse_scene("3mf", three_mf(several))) == [
        "of several properties of a triangle one is shown"
    ]


OUT = "1 triangle is left out: triangle 2 (counted from 0) names vertex "
PAINT = "colours that a slicer painted are not supported and left out"
NOTHING = "none of the objects to be shown has triangles; "


@pytest.mark.parametrize(
    ("triangles", "told"),
    [
        ('<triangle v1="0" v2="1" v3="9"/>', OUT + "9; there are 4"),
        ('<triangle v1="0" v2="1"/>', OUT + "-1; there are 4"),
        (
            '<triangle v1="0" v2="1" v3="3" pid="5" p1="0"/>',
            "some triangles name a property that does not exist; they are shown grey",
        ),
        ('<triangle v1="0" v2="1" v3="3" paint_color="4"/>', PAINT),
    ],
)  # fmt: skip
def test_one_bad_triangle_costs_no_other(sandbox: Sandbox, triangles: str, told: str) -> None:
    scene = sandbox.parse_scene("3mf", three_mf(model(mesh(SQUARE + triangles))))
    assert scene.triangles == (2 if "left out:" in told else 3) and details(scene) == [told]


def test_prefixes_that_are_not_declared(sandbox: Sandbox) -> None:
    text = model(GROUP + mesh(more='pid="5" pindex="0"'), spaces='xmlns="x"')
    assert sandbox.parse_scene("3mf", three_mf(text)).triangles == 2


LATTICE = (
    f'<object id="1"><mesh><vertices>{VERTICES}</vertices><b:beamlattice><b:beams><b:beam v1="0" v2="1"/></b:beams>'
    "</b:beamlattice></mesh></object>"
)
LOOP = '<object id="1"><components><component objectid="1"/></components></object>'
TENFOLD = mesh() + "".join(
    f'<object id="{k}"><components>{f"<component objectid={chr(34)}{k - 1}{chr(34)}/>" * 10}</components></object>'
    for k in range(2, 12)
)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (model(mesh(), ""), "its build has no items"),
        (model(mesh(), '<item objectid="4"/>'), NOTHING + "the object '4' is not there"),
        (model(LATTICE), NOTHING + "beam lattices are not supported"),
        (model(LOOP), "the object '1' is a component of itself"),
        (model(TENFOLD, '<item objectid="11"/>'), "its components make more than 100000 objects"),
        (model(mesh())[:-4], "3dmodel.model: it is no well-formed XML"),
    ],
)  # fmt: skip
def test_what_is_refused_with_its_reason(sandbox: Sandbox, text: str, reason: str) -> None:
    with pytest.raises(ParseError, match=reason):
        sandbox.parse_scene("3mf", three_mf(text))
