"""The JSON Schema: whole, true to the models, and with a hint on everything that the editor makes a control of."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any, get_args

import pytest

from service.document import parse_scene, parse_settings, schema
from service.document.base import Group
from service.problems import InvalidDocument

WHOLE = schema()
UNITS = {"", "m", "degrees", "W/sr", "W/m^2", "W/(m^2 sr)", "cd/m^2", "s", "pixels", "nm", "um", "1/m", "W/(m^3 sr)"}
WIDGETS = {"slider", "color", "number", "angle"}


def models() -> dict[str, dict[str, Any]]:
    found = {"Scene": WHOLE["scene"], "Settings": WHOLE["settings"]}
    for part in WHOLE.values():
        found |= part.get("$defs", {})
    return found


def properties() -> Iterator[tuple[str, dict[str, Any]]]:
    for model, described in models().items():
        for name, prop in described["properties"].items():
            yield f"{model}.{name}", prop


def is_numeric(prop: dict[str, Any]) -> bool:
    if prop.get("type") in ("number", "integer"):
        return "const" not in prop
    if prop.get("type") == "array":
        return is_numeric(prop["items"])
    return any(is_numeric(part) for part in prop.get("anyOf", []))


DESCRIBED = [(name, prop) for name, prop in properties() if not name.endswith(".type")]
NUMERIC = [(name, prop) for name, prop in properties() if is_numeric(prop)]


def test_is_json_and_names_its_models() -> None:
    json.dumps(WHOLE, allow_nan=False)
    assert {"PerspectiveCamera", "DisneyMaterial", "DiffuseMaterial", "SphereShape", "PointLight"} <= set(models())
    for reference in re.findall(r'"#/\$defs/(\w+)"', json.dumps(WHOLE)):
        assert reference in WHOLE["scene"]["$defs"]


@pytest.mark.parametrize(("name", "model"), models().items())
def test_models_refuse_unknown_fields_and_describe_themselves(name: str, model: dict[str, Any]) -> None:
    assert model["additionalProperties"] is False and model["description"]


@pytest.mark.parametrize(("name", "prop"), DESCRIBED, ids=[name for name, _ in DESCRIBED])
def test_everything_is_described(name: str, prop: dict[str, Any]) -> None:
    assert prop["description"] and "\n" not in prop["description"] and len(prop["description"]) <= 110
    assert "title" in prop or "$ref" in prop
    assert prop.get("default", ...) is not None, "null is no value"


@pytest.mark.parametrize(("name", "prop"), NUMERIC, ids=[name for name, _ in NUMERIC])
def test_numbers_carry_what_a_control_needs(name: str, prop: dict[str, Any]) -> None:
    assert prop["x-widget"] in WIDGETS and prop["x-unit"] in UNITS
    if prop["x-widget"] not in ("slider", "angle"):
        return
    number = next(form for form in prop.get("anyOf", [prop]) if is_numeric(form))  # the others: texture, other forms
    low = prop.get("x-soft-minimum", number.get("minimum", number.get("exclusiveMinimum")))
    high = prop.get("x-soft-maximum", number.get("maximum", number.get("exclusiveMaximum")))
    assert low is not None and high is not None and low < high <= 1024, "no slider can be so long"
    if isinstance(prop.get("default"), float):
        assert low <= prop["default"] <= high


def test_every_parameter_of_a_material_belongs_to_a_group() -> None:
    materials = [model for name, model in models().items() if name.endswith("Material")]
    parameters = [p for model in materials for name, p in model["properties"].items() if name != "type"]
    assert len(materials) >= 7 and {p["x-group"] for p in parameters} <= set(get_args(Group))


def test_material_forms_begin_with_what_is_their_own() -> None:
    disney = list(models()["DisneyMaterial"]["properties"])
    assert disney[:2] == ["type", "base_color"]
    assert disney[-6:] == ["emission", "emission_sides", "alpha", "alpha_cutoff", "normal_map", "height"]
    assert {"subsurface", "metallic", "specular", "specular_tint", "roughness", "anisotropic", "sheen", "sheen_tint",
            "clearcoat", "clearcoat_gloss"} <= set(disney)  # fmt: skip


def test_colours_have_three_forms() -> None:
    forms = models()["DiffuseMaterial"]["properties"]["albedo"]["anyOf"]
    assert [form["type"] for form in forms[:3]] == ["array", "number", "string"]
    assert forms[1]["minimum"] == 0 and forms[1]["maximum"] == 1


UNTEXTURED = {
    "MicrofacetMaterial": {"gamma", "ior", "conductor_eta", "conductor_k", "diffuse_roughness"},
    "OpenpbrMaterial": {
        "emission_luminance",
        "geometry_tangent",
        "geometry_coat_tangent",
        "transmission_dispersion_scale",
        "transmission_dispersion_abbe_number",
        "transmission_depth",
        "transmission_scatter",
        "transmission_scatter_anisotropy",
        "subsurface_radius",
        "subsurface_radius_scale",
        "subsurface_scatter_anisotropy",
    },
    "PrincipledMaterial": {"abbe", "subsurface_radius", "conductor_eta", "conductor_k"},
}


def test_every_colour_and_number_of_a_material_may_be_a_texture() -> None:
    for name, model in models().items():
        if not name.endswith("Material"):
            continue
        for field, prop in model["properties"].items():
            if is_numeric(prop) and field not in UNTEXTURED.get(name, ()):
                reference = "ColorTexture" if prop["x-widget"] == "color" else "ScalarTexture"
                assert prop["anyOf"][-1] == {"$ref": f"#/$defs/{reference}"}, (name, field)


SMALLEST = {
    "DiffuseMaterial": {"type": "diffuse", "albedo": 0.5},
    "DisneyMaterial": {"type": "disney"},
    "PrincipledMaterial": {"type": "principled"},
}
BESIDE = {"conductor_eta": {"conductor_k": 1}, "conductor_k": {"conductor_eta": 1}}  # what a parameter needs


@pytest.mark.parametrize("model", SMALLEST)
def test_material_ranges_are_those_of_the_models(model: str) -> None:
    """Each end of each range is taken, and the next number beyond it refused with the field's pointer."""
    for name, prop in models()[model]["properties"].items():
        least = {**SMALLEST[model], **BESIDE.get(name, {})}
        for form in prop.get("anyOf", [prop]):
            if form.get("type") != "number":
                continue
            for end, sign in ((form.get("minimum", 0.0), -1), (form["maximum"], 1)):
                if "exclusiveMinimum" in form and sign < 0:
                    assert form["exclusiveMinimum"] == end
                else:
                    parse_scene(with_material({**least, name: end}))
                with pytest.raises(InvalidDocument) as caught:
                    parse_scene(with_material({**least, name: math.nextafter(end, sign * math.inf)}))
                assert [e.pointer for e in caught.value.errors] == [f"/materials/m/{name}"]


def test_defaults_of_settings_are_what_is_used() -> None:
    stated = {name: p["default"] for name, p in models()["Settings"]["properties"].items() if "default" in p}
    parse_settings(stated)
    assert stated["width"] == stated["height"] == 512 and stated["max_samples"] == 256 and stated["max_bounces"] == 8


def with_material(material: dict[str, Any]) -> dict[str, Any]:
    camera = {"position": [0, 0, 1], "target": [0, 0, 0]}
    return {"version": 1, "camera": camera, "materials": {"m": material}, "shapes": []}
