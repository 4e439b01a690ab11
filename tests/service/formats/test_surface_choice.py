"""Surfaces become the material that loses less of them, and what that loses is told."""

from __future__ import annotations

from typing import Any

import pytest

from service.document.material import OpenpbrMaterial, PrincipledMaterial
from service.formats.surface import MODELS, choice, gltf
from service.formats.surface.inputs import Inputs
from tests.surface_inputs import COLOR, GREY, Said

HALF, RED = [0.5, 0.5, 0.5], [1.0, 0.25, 0.125]
PARTLY = {"transmission": 0.3, "base_color": HALF}
STRONG = {"sheen": 1.0, "specular_rotation": GREY, "specular_anisotropy": 0.5}  # of `principled` alone
PREVIEW = {"diffuseColor": RED, "opacity": 0.25}
ROWS: list[tuple[str, dict[str, Any], str, set[str]]] = [
    ("standard_surface", {}, "principled", set()),
    ("standard_surface", PARTLY, "openpbr", set()),
    ("standard_surface", {**PARTLY, "transmission": 1.0}, "principled", set()),
    ("standard_surface", {**PARTLY, "transmission_color": HALF}, "principled", set()),
    ("standard_surface", {**PARTLY, "transmission_color": HALF, "transmission_depth": 2.0}, "openpbr", set()),
    ("standard_surface", {**PARTLY, "thin_walled": 1.0}, "openpbr", set()),
    ("standard_surface", {**PARTLY, "metalness": 1.0}, "principled", set()),
    ("standard_surface", {**PARTLY, "transmission": GREY}, "openpbr", set()),
    ("standard_surface", {"transmission": GREY, "base_color": COLOR, "transmission_color": COLOR, "base": 1.0},
     "principled", set()),
    ("standard_surface", {**PARTLY, **STRONG}, "principled", {"transmission_color"}),
    ("standard_surface", {**PARTLY, "specular": 0.5}, "openpbr", set()),
    ("standard_surface", {"transmission": 1.0, "specular": 0.5}, "openpbr", set()),
    ("standard_surface", {"diffuse_roughness": 0.5}, "openpbr", set()),
    ("standard_surface", {"sheen": 1.0}, "principled", set()),
    ("standard_surface", {"diffuse_roughness": 0.5, "sheen": 1.0}, "principled", {"diffuse_roughness"}),
    ("standard_surface", {"subsurface": 0.5}, "openpbr", set()),
    ("standard_surface", {"subsurface": 0.5, "sheen": 1.0}, "openpbr", {"sheen"}),
    ("standard_surface", {"subsurface": 0.5, "thin_walled": 1.0}, "principled", set()),
    ("standard_surface", {"coat": 1.0, "coat_color": RED}, "openpbr", set()),
    ("standard_surface", {"coat": 1.0, "coat_roughness": 0.4}, "principled", set()),
    ("standard_surface", {"coat": 1.0, "coat_IOR": 1.7}, "openpbr", set()),
    ("standard_surface", {"metalness": 1.0, "specular_color": RED}, "openpbr", {"specular_color"}),
    ("gltf_pbr", {}, "principled", set()),
    ("gltf_pbr", {"transmission": 0.3, "base_color": RED}, "principled", set()),
    ("gltf_pbr", {"iridescence": 0.25}, "openpbr", set()),
    ("gltf_pbr", {"iridescence": GREY}, "openpbr", set()),
    ("gltf_pbr", {"iridescence": 0.25, "sheen_color": RED}, "principled", {"iridescence"}),
    ("gltf_pbr", {"iridescence": 0.25, "alpha_mode": gltf.MASK}, "principled", {"iridescence"}),
    ("gltf_pbr", {"iridescence": 0.25, "alpha_mode": gltf.BLEND, "alpha": 0.5}, "openpbr", set()),
    ("gltf_pbr", {"transmission": 1.0, "specular": 0.5, "metallic": 0.0}, "openpbr", {"specular"}),
    ("gltf_pbr", {"clearcoat": 1.0, "emissive": RED}, "principled", set()),
    ("gltf_pbr", {"diffuse_transmission": 0.5, "iridescence": 0.25}, "principled", {"iridescence"}),
    ("UsdPreviewSurface", {}, "principled", set()),
    ("UsdPreviewSurface", PREVIEW, "openpbr", set()),
    ("UsdPreviewSurface", {**PREVIEW, "opacity": 0.0}, "principled", set()),
    ("UsdPreviewSurface", {**PREVIEW, "diffuseColor": [1.0, 1.0, 1.0]}, "principled", set()),
    ("UsdPreviewSurface", {**PREVIEW, "metallic": 1.0}, "principled", set()),
    ("UsdPreviewSurface", {**PREVIEW, "opacityThreshold": 0.1}, "principled", set()),
    ("UsdPreviewSurface", {**PREVIEW, "diffuseColor": COLOR}, "openpbr", set()),
    ("UsdPreviewSurface", {**PREVIEW, "clearcoat": 1.0, "clearcoatRoughness": 0.5}, "principled", {"diffuseColor"}),
    ("disney_principled", {"baseColor": RED, "specTrans": 0.5}, "principled", set()),
]  # fmt: skip


@pytest.mark.parametrize(("model", "inputs", "type", "told"), ROWS, ids=str)
def test_the_material_that_loses_less(model: str, inputs: dict[str, Any], type: str, told: set[str]) -> None:
    read = Said(model, inputs)
    assert (read.material["type"], set(read.notes)) == (type, told)
    (OpenpbrMaterial if type == "openpbr" else PrincipledMaterial).model_validate(read.material)


def test_a_coloured_coat_tints_the_emission_under_it() -> None:
    """As in the standard library's graph; a coat that covers half does so by half."""
    coat = {"coat": 0.5, "coat_color": RED, "coat_roughness": 0.5, "sheen": 1.0, "emission": 4.0}
    read = Said("standard_surface", {**coat, "emission_color": HALF, "base_color": [1.0] * 3})
    assert read.material["type"] == "principled" and "coat_color" in read.notes
    tint = [1.0, 0.625, 0.5625]
    assert read.material["base_color"] == pytest.approx(tint)
    assert read.material["emission"] == pytest.approx([2 * each for each in tint])


def test_colours_that_are_told_apart_keep_their_numbers() -> None:
    found = Said("standard_surface", PARTLY).material
    assert (found["base_color"], found["transmission_weight"]) == (0.5, 0.3) and "transmission_color" not in found
    found = Said("standard_surface", {**PARTLY, **STRONG}).material
    assert found["base_color"] == pytest.approx(0.65), "the mix, which is told"
    found = Said("UsdPreviewSurface", {**PREVIEW, "clearcoat": 0.5, "emissiveColor": [0.0, 2.0, 0.0]}).material
    assert (found["base_color"], found["transmission_weight"]) == (RED, 0.75)
    assert [found[f"coat_{name}"] for name in ("weight", "ior", "darkening", "roughness")] == [0.5, 1.5, 0, 0.01]
    assert (found["emission_luminance"], found["emission_color"]) == (683, [0, 2, 0])


def test_a_stretched_highlight_is_as_wide_both_ways() -> None:
    """Of glTF's alphas, mix(r^2, 1, s^2) along the tangent and r^2 across it."""
    said = {"roughness": 0.5, "anisotropy_strength": 0.6, "anisotropy_rotation": 0.5, "iridescence": 0.25}
    found = Said("gltf_pbr", said).material
    along, across = 0.25 + 0.75 * 0.36, 0.25
    b = 1 - found["specular_roughness_anisotropy"]
    wide = found["specular_roughness"] ** 2 * (2 / (1 + b * b)) ** 0.5
    assert (wide, wide * b) == (pytest.approx(along), pytest.approx(across))
    assert found["geometry_tangent"] == pytest.approx([0.877583, 0.479426, 0], abs=1e-6)


def test_a_trial_warns_of_nothing_and_changes_nothing() -> None:
    class Probe(Said):
        def warn(self, name: str, detail: str) -> None:
            assert not self.is_trial
            super().warn(name, detail)

    lost: dict[str, float] = {}

    def first(s: Inputs) -> None:
        s.material["type"] = "first"
        s.note("base", "one")
        s.note("base", "another", 0.25)
        lost["first"] = choice.lost(s)

    def second(s: Inputs) -> None:
        s.material["type"] = "second"
        s.note("base", "other", 1.25)
        lost["second"] = choice.lost(s)

    read = Probe("standard_surface", {})
    choice.read_best(read, first, second)
    assert lost == {"first": 1.25, "second": 1.25}
    assert read.material["type"] == "first" and read.notes == {"base": "another"}, "the first of equal ones"
    assert len(MODELS) == 5
