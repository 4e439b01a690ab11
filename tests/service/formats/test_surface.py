"""What the inputs of surface models mean: model by parameter by direction, without a file."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

from service.document import numbers
from service.document.material import OpenpbrMaterial, PrincipledMaterial
from service.document.material.principled import index_of_specular, roughness_of_gloss
from service.document.texture import ColorTexture, NormalTexture, ScalarTexture
from service.formats import types
from service.formats.read.materialx.importer import read_materialx
from service.formats.read.references import Finder
from service.formats.surface import MODELS, gltf, open_pbr, outputs
from service.formats.surface.outputs import Outputs, plain
from service.formats.types import AssetLimits
from tests import mtlx_files
from tests.surface_inputs import COLOR, GREY, Said

MAP = {"texture": "t", "scale": 0.5}
OF_GLTF_ALONE = ("diffuse_transmission", "diffuse_transmission_color")


def test_defaults_are_those_of_the_library() -> None:
    """A direction has none."""
    mx = pytest.importorskip("MaterialX")
    library = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    for name, model in MODELS.items():
        versions = library.getMatchingNodeDefs(name)
        (node,) = [each for each in versions if len(versions) == 1 or each.getDefaultVersion()]
        found: dict[str, Any] = {}
        for given in node.getActiveInputs():
            text = given.getValueString() or "0"
            words = {"true": 1.0, "false": 0.0}
            numbers = tuple(words[each] if each in words else float(each) for each in text.split(", "))
            found[given.getName()] = None if given.getType() == "vector3" else numbers
        for each, default in model.defaults.items():
            if each not in OF_GLTF_ALONE:
                assert found.pop(each) == (default if default is None or isinstance(default, tuple) else (default,))
        assert found.keys() <= {"subsurfaceDistance"}, "no colour of ours walks by it"


# A value of each parameter, and what else it needs to be seen.
Table = dict[str, tuple[Any, dict[str, Any]]]
PRINCIPLED: Table = {
    "base_color": ([0.2, 0.4, 0.6], {}),
    "metallic": (0.25, {}),
    "roughness": (0.3, {}),
    "specular": (0.25, {}),
    "specular_tint": (0.5, {"base_color": [0.2, 0.4, 0.6]}),
    "specular_color": ([1.0, 0.5, 0.25], {}),
    "ior": (1.75, {}),
    "anisotropic": (0.5, {"roughness": 0.4}),
    "anisotropic_rotation": (30.0, {"anisotropic": 0.5}),
    "sheen": (0.5, {"sheen_color": [1.0, 1.0, 1.0]}),
    "sheen_tint": (0.25, {"sheen": 1.0, "base_color": [0.2, 0.4, 0.6]}),
    "sheen_color": ([0.5, 0.25, 0.75], {"sheen": 1.0}),
    "sheen_roughness": (0.25, {"sheen": 1.0, "sheen_color": [0.5, 0.25, 0.75]}),
    "clearcoat": (0.5, {"clearcoat_roughness": 0.25}),
    "clearcoat_gloss": (0.5, {"clearcoat": 1.0}),
    "clearcoat_roughness": (0.25, {"clearcoat": 1.0}),
    "clearcoat_normal_map": (MAP, {"clearcoat": 1.0, "clearcoat_roughness": 0.25}),
    "transmission": (1.0, {"base_color": [0.2, 0.4, 0.6]}),
    "abbe": (30.0, {"transmission": 1.0}),
    "attenuation_color": ([0.5, 0.25, 0.75], {"transmission": 1.0, "attenuation_distance": 2.0, "base_color": 1.0}),
    "attenuation_distance": (0.5, {"transmission": 1.0, "base_color": 1.0}),
    "thin_walled": (True, {"transmission": 1.0}),
    "diffuse_transmission": (0.25, {}),
    "diffuse_transmission_color": ([0.5, 0.25, 0.75], {"diffuse_transmission": 0.5}),
    "film_thickness": (400.0, {}),
    "film_ior": (1.75, {"film_thickness": 400.0}),
    "subsurface": (0.5, {}),
    "subsurface_radius": ([0.5, 0.25, 0.125], {"subsurface": 0.5}),
    "conductor_eta": ([0.2, 0.4, 1.4], {"conductor_k": [3.4, 2.4, 1.8], "metallic": 1.0}),
    "conductor_k": ([3.4, 2.4, 1.8], {"conductor_eta": [0.2, 0.4, 1.4], "metallic": 1.0}),
    "emission": ([2.0, 4.0, 0.5], {}),
    "alpha": (0.5, {}),
    "alpha_cutoff": (0.25, {"alpha": 0.5}),
    "normal_map": (MAP, {}),
}  # fmt: skip
ELSEWHERE = {"type", "emission_sides", "height"}  # which are not of the model: the writers tell of them
TEXTURES = {
    name: (COLOR if isinstance(value, list) else GREY, beside)
    for name, (value, beside) in PRINCIPLED.items()
    if not isinstance(value, dict | bool)
    and name not in ("abbe", "subsurface_radius", "conductor_eta", "conductor_k")
}
WRITERS: dict[str, Callable[[PrincipledMaterial, Callable[[str, str], None]], Outputs]] = {
    "standard_surface": outputs.standard_surface,
    "gltf_pbr": outputs.gltf_pbr,
}


def test_ranges_are_those_of_documents() -> None:
    """Which readers say by themselves, as a process that parses needs no document."""
    assert (types.LARGEST, types.BRIGHTEST) == (numbers.LARGEST, numbers.BRIGHTEST)
    script = (
        "import sys, service.formats.surface, service.formats.read.obj.importer; assert 'pydantic' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


def test_the_table_is_whole() -> None:
    assert PRINCIPLED.keys() | ELSEWHERE == PrincipledMaterial.model_fields.keys()


@pytest.mark.parametrize("model", WRITERS)
@pytest.mark.parametrize("table", [PRINCIPLED, TEXTURES], ids=["numbers", "textures"])
def test_what_is_written_is_read_or_its_loss_is_told(model: str, table: Table) -> None:
    for name, (value, beside) in table.items():
        material = PrincipledMaterial.model_validate({"type": "principled", **beside, name: value})
        lost = dict[str, str]()
        said = documents(WRITERS[model](material, lost.__setitem__))
        if name == "subsurface_radius" and model == "standard_surface":
            found = Said(model, said)
            assert found.material["type"] == "openpbr" and found.material["subsurface_radius"] == 0.5
            continue
        read = Said(model, said)
        again = PrincipledMaterial.model_validate(read.material)
        if model == "gltf_pbr":
            lost |= {each: "" for each in material.model_fields_set - outputs.GLTF_PBR}
        before, after = meaning(material), meaning(again)
        differing = {each for each in before if before[each] != after[each]}
        assert not differing or name in lost or name in read.notes, (model, name, differing, before, after, said)


def documents(written: Outputs) -> dict[str, Any]:
    """The values of a writer as files would bring them back."""
    found: dict[str, Any] = {}
    for name, (value, _) in written.items():
        if isinstance(value, ScalarTexture | ColorTexture | NormalTexture):
            found[name] = value.model_dump(exclude_none=True)
            if isinstance(value, ColorTexture):
                found[name]["factor"] = list(value.factor)
        else:
            found[name] = list(value) if isinstance(value, tuple) else float(value)
    return found


def meaning(m: PrincipledMaterial) -> dict[str, Any]:
    """The parameters of a material, with what they stand for in the place of those that stand for others."""
    found = {name: getattr(m, name) for name in PRINCIPLED}
    if m.ior is None:
        f0 = 0.08 * plain(found.pop("specular"))
        found["ior"] = index_of_specular(f0 / 0.08) if m.transmission else None
    else:
        f0 = ((plain(m.ior) - 1) / (plain(m.ior) + 1)) ** 2
        found["ior"] = m.ior if m.transmission else None
    tints = found.pop("specular_tint"), found.pop("sheen_tint")
    by, sheen = (_tinted(m.base_color, each) for each in tints)
    color = found.pop("specular_color")
    found["f0"] = tuple(f0 * a * b for a, b in zip(plain(color), by, strict=True))
    own = sheen if m.sheen_color is None else plain(m.sheen_color)
    amount = plain(found.pop("sheen"))
    found["sheen_color"] = tuple(amount * each for each in own)
    if m.clearcoat_roughness is None:
        found["clearcoat_roughness"] = roughness_of_gloss(plain(m.clearcoat_gloss))
    del found["clearcoat_gloss"]
    if m.diffuse_transmission_color is None:
        found["diffuse_transmission_color"] = m.base_color
    found["thin_walled"] = m.is_thin
    found["textures"] = {name for name in PRINCIPLED if hasattr(getattr(m, name), "texture")}
    return {name: _rounded(value) for name, value in found.items() if name != "specular"}


def _tinted(base: Any, share: Any) -> tuple[float, ...]:
    if isinstance(base, ColorTexture) or isinstance(share, ScalarTexture):
        return 1.0, 1.0, 1.0
    return tuple(1 + share * (each / max(base) - 1) for each in base)


def _rounded(value: Any) -> Any:
    if isinstance(value, ScalarTexture | ColorTexture | NormalTexture):
        return _rounded(tuple(sorted(value.model_dump(exclude_none=True).items())))
    if isinstance(value, tuple):
        return tuple(_rounded(each) for each in value)
    return float(f"{value:.6g}") if isinstance(value, float) else value


OPENPBR: dict[str, Any] = {
    name: (
        True if name == "geometry_thin_walled"
        else MAP if name.endswith("_normal")
        else [0.6, -0.8, 0.0] if default is None
        else [0.5, 0.25, 0.75] if isinstance(default, tuple)
        else 0.75
    )
    for name, default in open_pbr.DEFAULTS.items()
}  # fmt: skip


def test_openpbr_is_written_and_read_without_a_loss() -> None:
    assert OPENPBR.keys() | {"type", "emission_sides", "height"} == OpenpbrMaterial.model_fields.keys()
    names = (*open_pbr.SAME, "emission_color")
    textured = {name: COLOR if isinstance(open_pbr.DEFAULTS[name], tuple) else GREY for name in names}
    for values in (OPENPBR, OPENPBR | textured):
        material = OpenpbrMaterial.model_validate({"type": "openpbr", **values})
        read = Said("open_pbr_surface", documents(outputs.open_pbr_surface(material)))
        assert OpenpbrMaterial.model_validate(read.material) == material and not read.notes
    for name, value in {**OPENPBR, **textured}.items():
        beside = {"subsurface_weight": 1.0, "transmission_weight": 1.0, "transmission_dispersion_scale": 1.0}
        material = OpenpbrMaterial.model_validate({"type": "openpbr", **beside, name: value})
        read = Said("open_pbr_surface", documents(outputs.open_pbr_surface(material)))
        assert OpenpbrMaterial.model_validate(read.material) == material, name


@pytest.mark.parametrize("model", MODELS)
def test_a_mtlx_means_what_any_other_file_means(model: str) -> None:
    """Input by input, alone and beside what shows it."""
    pytest.importorskip("MaterialX")
    beside = {"transmission": 1.0, "coat": 1.0, "sheen": 1.0, "clearcoat": 1.0, "iridescence": 1.0, "thickness": 1.0}
    shown = {name: value for name, value in beside.items() if name in MODELS[model].defaults}
    numbers = {
        name: [0.5, 0.25, 0.75] if isinstance(default, tuple) else 1.0 if name in SWITCHES else 0.75
        for name, default in MODELS[model].defaults.items()
        if default is not None and name not in OF_GLTF_ALONE
    }  # fmt: skip
    cases = [more | {name: each} for more in ({}, shown) for name, each in numbers.items()]
    elements = [
        mtlx_files.surface(model, *map(said_in_file, case, case.values()), name=f"M{k}")
        for k, case in enumerate(cases)
    ]
    text = mtlx_files.mtlx(*elements)
    file = read_materialx(["a.mtlx"], Finder(["a.mtlx"]), lambda name: text, AssetLimits())
    for case, found in zip(cases, file.document["materials"].values(), strict=True):
        same(found, Said(model, case).material)


SWITCHES = {"thin_walled": "boolean", "geometry_thin_walled": "boolean", "useSpecularWorkflow": "integer",
            "opacityMode": "integer", "alpha_mode": "integer"}  # fmt: skip


def said_in_file(name: str, of: Any) -> str:
    kind = SWITCHES.get(name, "")
    return mtlx_files.value(name, {"boolean": "true", "integer": 1}.get(kind, of), kind)


def same(found: dict[str, Any], wanted: dict[str, Any]) -> None:
    assert found.keys() == wanted.keys()
    for name, each in wanted.items():
        assert found[name] == (each if isinstance(each, str) else pytest.approx(each, rel=1e-5)), name


def test_what_a_reader_cannot_compute_is_told_and_the_input_serves() -> None:
    """Textures are multiplied by numbers; a mix of two, or a power of one, is computed for .mtlx files alone."""
    said = {"base_color": COLOR, "base": GREY, "transmission": GREY, "specular_anisotropy": GREY}
    mine = {"sheen": 1.0, "coat": 1.0, "coat_roughness": 1.0}  # which `principled` has
    read = Said("standard_surface", {**said, **mine})
    assert read.material["base_color"] == COLOR and "itself is used" in read.notes["base_color"]
    assert read.material["anisotropic"]["factor"] == pytest.approx(0.5 / 0.9), "below 0.98 it is a product"
    whole = {**GREY, "factor": 1.0}
    read = Said("standard_surface", {"specular_anisotropy": whole})
    assert read.material["anisotropic"] == {"texture": "t", "channel": "g"} and "specular_anisotropy" in read.notes
    read = Said("standard_surface", {"base_color": COLOR, "base": 0.5, "opacity": COLOR, "specular_color": COLOR})
    assert read.material["base_color"]["factor"] == [0.25, 0.125, 0.0625]
    assert read.material["alpha"]["factor"] == pytest.approx(0.875 / 3), "a mask's channels are equal"
    assert read.material["specular_color"]["factor"] == [1.0, 0.5, 0.25] and not read.notes


def test_a_weight_by_a_texture_is_specular() -> None:
    read = Said("standard_surface", {"specular": GREY, "specular_IOR": 1.5})
    assert read.material["specular"] == {**GREY, "factor": pytest.approx(0.5 * 0.04 / 0.08)}
    assert "ior" not in read.material and not read.notes


def test_gltf_s_own_rules() -> None:
    """A cutoff above 1 hides all; dispersion is a body's; a reflection's colour within 0..1 is a tint, beyond it an
    index."""
    assert Said("gltf_pbr", {"alpha_mode": gltf.MASK, "alpha_cutoff": 1.5}).material["alpha"] == 0
    glass = {"transmission": 1.0, "dispersion": 0.5}
    assert "abbe" not in Said("gltf_pbr", glass).material
    assert Said("gltf_pbr", {**glass, "thickness": 1.0}).material["abbe"] == 40
    read = Said("gltf_pbr", {"metallic": 0.0, "specular_color": [0.5, 0.25, 0.25]})
    assert read.material["specular_color"] == [0.5, 0.25, 0.25] and "ior" not in read.material
    bright = Said("gltf_pbr", {"metallic": 0.0, "specular_color": [4.0, 2.0, 1.0]}).material
    assert bright["specular_color"] == [1, 0.5, 0.25] and bright["ior"] == pytest.approx(1.4 / 0.6)


def test_a_preview_that_reflects_much_is_a_metal() -> None:
    read = Said("UsdPreviewSurface", {"useSpecularWorkflow": 1.0, "specularColor": [0.9, 0.8, 0.7]})
    assert read.material["metallic"] == 1 and read.material["base_color"] == [0.9, 0.8, 0.7]
    assert "without diffuseColor" in read.notes["specularColor"]
    read = Said("UsdPreviewSurface", {"useSpecularWorkflow": 1.0, "specularColor": [0.9, 0.8, 0.7], "opacity": 0.5})
    assert read.material["base_color"] == [0.9, 0.8, 0.7]
    read = Said("UsdPreviewSurface", {"useSpecularWorkflow": 1.0, "specularColor": [0.09, 0.045, 0.0]})
    assert read.material["ior"] == pytest.approx(1.3 / 0.7) and read.material["specular_color"] == [1, 0.5, 0]
    assert "metallic" not in read.material and not read.notes
    read = Said("UsdPreviewSurface", {"useSpecularWorkflow": 1.0, "specularColor": COLOR})
    assert "ior" not in read.material and "0.04" in read.notes["specularColor"]


def test_the_index_of_a_coat_is_its_strength_on_principled() -> None:
    """Which has one of 1.5; the sheen makes it that."""
    read = Said("standard_surface", {"coat": 0.25, "coat_IOR": 2.0, "sheen": 1.0})
    assert read.material["clearcoat"] == pytest.approx(0.25 * (1 / 9) / 0.04) and "coat_IOR" in read.notes
