"""`POST /v1/materials/convert`: a material turned into another model, and another distribution of its facets."""

from __future__ import annotations

import itertools
import json
import math
from typing import Any

import pytest

from service.document import parse_scene
from service.document.material import MODELS
from service.document.material.microfacet import ALPHA_RANGES, GAMMA_RANGES
from service.problems import InvalidDocument
from service.server.requests.parsers import parse_conversion
from tests import microfacets
from tests.serving import SCENE, Server

EVERY: list[dict[str, Any]] = [
    {"type": "diffuse", "albedo": [0.5, 0.3, 0.1], "alpha": 0.5, "alpha_cutoff": 0.2},
    {"type": "disney", "base_color": 0.5, "specular": 0.3, "roughness": 0, "alpha": 0.5},
    {
        "type": "principled",
        "base_color": 0.5,
        "metallic": 1,
        "roughness": 0.3,
        "ior": 1.8,
        "specular": 1,
        "alpha": 0.1,
    },
    {"type": "openpbr", "base_weight": 0.5, "base_metalness": 0.5, "coat_weight": 1, "emission_luminance": 100},
    {"type": "metal_rough", "base_color": {"texture": "wood"}, "metallic": 0, "roughness": {"texture": "wood"}},
    {"type": "blinn_phong", "diffuse": 0.2, "specular": [0.5, 0.4, 0.3], "shininess": 300},
    {"type": "phong", "diffuse": 0.2, "specular": [0.5, 0.4, 0.3], "shininess": 300},
    {"type": "microfacet", "distribution": "phong", "alpha": 1e5, "f0": [1, 0.8, 0.3]},
    {"type": "microfacet", "distribution": "abc", "alpha": 10, "gamma": 900, "diffuse": 0.5, "ior": 2},
    {"type": "measured", "asset": "sha256:" + "0" * 64, "alpha": 0.5},
]
FILES = {"measured": {"asset": "sha256:" + "0" * 64}}  # what models of a file ask for
METAL = {"type": "principled", "base_color": [1, 0.8, 0.4], "metallic": 1, "roughness": 0.5}
FACETS = {"type": "microfacet", "f0": [1, 0.8, 0.4], "alpha": 0.25, "emission": 2}


def asked(material: dict[str, Any], to: str, **choose: str) -> tuple[dict[str, Any], list[str]]:
    found = parse_conversion(json.dumps({"material": material, "to": to, "choose": choose}).encode())
    return found.material, found.lost


def converted(material: dict[str, Any], to: str, **choose: str) -> dict[str, Any]:
    return asked(material, to, **choose)[0]


@pytest.mark.parametrize(
    ("old", "to"), itertools.product(EVERY, MODELS), ids=lambda x: x if type(x) is str else x["type"]
)
def test_every_model_becomes_every_other_one(old: dict[str, Any], to: str) -> None:
    """The scene takes each of them: `specular` and `alpha` mean something else elsewhere."""
    made = converted(old, to, **FILES.get(to, {}))
    assert made["type"] == to and parse_scene(
        SCENE
        | {
            "textures": {"wood": {"type": "checker", "a": 0.1, "b": 0.9}},
            "materials": SCENE["materials"] | {"m": made},
        }
    )
    if to == old["type"]:
        assert made == old


def test_colour_and_highlight_stay() -> None:
    assert converted(METAL, "microfacet") == {
        "type": "microfacet", "alpha": 0.25, "f0": [1, 0.8, 0.4], "diffuse": [0, 0, 0],
    }  # fmt: skip
    assert converted(FACETS, "disney") == {"type": "disney", "base_color": [1, 0.8, 0.4], "emission": 2}
    assert converted({**FACETS, "diffuse": 0.3}, "diffuse")["albedo"] == 0.3
    blinn, phong = (converted({**METAL, "metallic": 0}, kind) for kind in ("blinn_phong", "phong"))
    assert blinn["shininess"] == 30 and phong["shininess"] == 7.5
    assert blinn["diffuse"] == [1, 0.8, 0.4] and blinn["specular"] == pytest.approx([0.04 * 38 / 8] * 3, rel=1e-3)


def test_a_model_of_a_file_asks_for_it() -> None:
    with pytest.raises(InvalidDocument) as refused:
        converted(METAL, "measured")
    (error,) = refused.value.errors
    assert error.pointer == "/choose/asset" and "'measured'" in error.detail
    made, lost = asked({**METAL, "emission": 2}, "measured", asset="sha256:" + "1" * 64)
    assert made == {"type": "measured", "asset": "sha256:" + "1" * 64, "emission": 2}
    assert lost == ["base_color", "metallic", "roughness"]
    assert asked(made, "principled")[1] == ["asset"]


def test_what_is_lost_is_named() -> None:
    assert asked({**METAL, "clearcoat": 1, "sheen": 0.5, "emission": "#ffffff"}, "blinn_phong")[1] == [
        "clearcoat",
        "sheen",
    ]
    assert asked({"type": "disney", "base_color": 0.5, "roughness": 0.1}, "principled")[1] == []
    assert asked(FACETS, "disney")[1] == ["alpha"], "its alpha is no opacity"
    textured = {"type": "disney", "base_color": {"texture": "wood"}, "roughness": 0.2}
    assert asked(textured, "phong") == (
        {"type": "phong", "diffuse": {"texture": "wood"}, "specular": 0.5, "shininess": 500.0},
        ["roughness"],
    )


@pytest.mark.parametrize("distribution", list(ALPHA_RANGES))
def test_another_distribution_has_a_peak_as_wide(distribution: str) -> None:
    """Until D has fallen by a hundredth; by its definition in double precision."""
    old = {"type": "microfacet", "alpha": 0.1}
    new = converted(old, "microfacet", distribution=distribution)
    gamma = new.get("gamma", 2.0)
    assert new["distribution"] == distribution and GAMMA_RANGES.get(distribution, (0, 1000))[0] <= gamma
    at = math.radians(0.4)

    def fall(kind: str, alpha: float) -> float:
        return 1 - float(microfacets.d(kind, alpha, gamma, math.tan(at)) / microfacets.d(kind, alpha, gamma, 0.0))

    assert fall(distribution, new["alpha"]) == pytest.approx(fall("ggx", 0.1), rel=0.03)
    back = converted(new, "microfacet", distribution="ggx")
    assert back["alpha"] == pytest.approx(0.1, rel=0.01)
    far = {**old, "distribution": "abc", "alpha": 1e6, "gamma": 1000}
    extreme = converted(far, "microfacet", distribution=distribution)
    low, high = ALPHA_RANGES[distribution]
    assert low <= extreme["alpha"] <= high
    if distribution in GAMMA_RANGES:
        assert GAMMA_RANGES[distribution][0] <= extreme["gamma"] <= GAMMA_RANGES[distribution][1]
    textured = {**old, "alpha": {"texture": "wood"}}
    assert converted(textured, "microfacet", distribution=distribution)["alpha"] == {"texture": "wood"}


@pytest.mark.parametrize(
    ("body", "pointer"),
    [
        ({"material": METAL}, "/to"),
        ({"material": METAL, "to": "velvet"}, "/to"),
        ({"material": {"type": "diffuse"}, "to": "disney"}, "/material/albedo"),
        ({"material": METAL, "to": "microfacet", "choose": {"alpha": "ggx"}}, "/choose/alpha"),
        ({"material": METAL, "to": "microfacet", "choose": {"distribution": "velvet"}}, "/choose/distribution"),
        ({"material": METAL, "to": "disney", "choose": {"a/b": "x"}}, "/choose/a~1b"),
        ({"material": METAL, "to": "disney", "with": 1}, "/with"),
    ],
)
def test_mistakes_have_their_place(body: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidDocument) as caught:
        parse_conversion(json.dumps(body).encode())
    assert [error.pointer for error in caught.value.errors] == [pointer]


def test_the_server_converts(server: Server) -> None:
    answer = server.http.post("/v1/materials/convert", json={"material": METAL | {"sheen": 1}, "to": "microfacet"})
    assert answer.status_code == 200 and answer.json() == {
        "material": {"type": "microfacet", "alpha": 0.25, "f0": [1, 0.8, 0.4], "diffuse": [0, 0, 0]},
        "lost": ["sheen"],
    }
    refused = server.http.post("/v1/materials/convert", json={"material": METAL, "to": "velvet"})
    assert refused.status_code == 422 and "known are diffuse, disney" in refused.json()["errors"][0]["detail"]


def test_principled_and_openpbr_say_the_same_in_other_words() -> None:
    """What both can do comes back; a default that differs is written down."""
    made, lost = asked({"type": "principled"}, "openpbr")
    assert made == {"type": "openpbr", "base_color": [0.5, 0.5, 0.5], "specular_roughness": 0.5} and lost == []
    old = {"type": "principled", "base_color": [0.9, 0.5, 0.1], "roughness": 0.2, "anisotropic": 0.5, "alpha": 0.5}
    old |= {
        "clearcoat": 0.5,
        "clearcoat_roughness": 0.1,
        "emission": [1, 2, 4],
        "attenuation_distance": 2,
        "ior": 1.6,
    }
    made, lost = asked(old, "openpbr")
    assert lost == ["attenuation_distance"]
    assert made["specular_roughness_anisotropy"] == 0.45 and made["emission_luminance"] == 2732
    assert made["emission_color"] == [0.25, 0.5, 1] and made["geometry_opacity"] == 0.5
    assert (made["coat_ior"], made["coat_darkening"], made["coat_roughness"]) == (1.5, 0, 0.1)
    back, lost = asked(made, "principled")
    assert lost == [] and {name: back[name] for name in old if name in back} == {
        name: value for name, value in old.items() if name != "attenuation_distance"
    }
    assert asked({"type": "openpbr", "coat_weight": 1, "coat_color": 0.2}, "principled")[1] == ["coat_color"]


def test_thin_walls_stay_thin() -> None:
    made = converted({"type": "principled", "thin_walled": True, "transmission": 1}, "openpbr")
    assert made["geometry_thin_walled"] is True
    assert converted(made, "principled")["thin_walled"] is True


def test_a_film_keeps_its_thickness_in_other_units() -> None:
    soap = {"type": "principled", "film_thickness": 350, "film_ior": 1.33}
    made, lost = asked(soap, "openpbr")
    assert lost == [] and (made["thin_film_weight"], made["thin_film_thickness"], made["thin_film_ior"]) == (
        1,
        0.35,
        1.33,
    )
    back, lost = asked(made, "principled")
    assert lost == [] and soap.items() <= back.items()
    textured = {"texture": "wood", "factor": 800}
    assert asked({**soap, "film_thickness": textured}, "openpbr")[0]["thin_film_thickness"]["factor"] == 0.8
    made, lost = asked({"type": "openpbr", "thin_film_weight": 0.5}, "principled")
    assert made["film_thickness"] == 500 and lost == ["thin_film_weight"]
    assert "film_thickness" not in converted({"type": "openpbr", "thin_film_thickness": 0.2}, "principled")


def test_a_complex_index_goes_with_a_metal() -> None:
    gold = {"type": "principled", "metallic": 1, "conductor_eta": [0.2, 0.4, 1.4], "conductor_k": [3.4, 2.4, 1.8]}
    made, _ = asked(gold, "microfacet")
    assert made["fresnel"] == "conductor" and made["conductor_k"] == gold["conductor_k"]
    assert gold.items() <= converted(made, "principled").items()
    assert "conductor_k" not in converted({**made, "fresnel": "schlick"}, "principled")
