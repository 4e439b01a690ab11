"""What MaterialX files hold that has no meaning, and what the library's own parser takes beside XML."""

from __future__ import annotations

import numpy as np
import pytest

from service.problems import AssetError
from service.server.assets import AssetStore
from tests.asset_files import png
from tests.mtlx_files import from_graph, graph, losses, material, mtlx, node, surface, taken, value, wire

GREY = np.full((2, 2, 3), 128, np.uint8)
MODELS = {
    "standard_surface": ("specular", "specular_IOR", "specular_color", "transmission", "transmission_color"),
    "gltf_pbr": ("specular", "ior", "specular_color", "transmission", "anisotropy_strength", "roughness"),
    "UsdPreviewSurface": ("specularColor", "ior", "opacity", "diffuseColor"),
    "open_pbr_surface": ("specular_weight", "specular_ior", "emission_luminance", "base_color"),
}
COLORS = ("specular_color", "transmission_color", "specularColor", "diffuseColor", "base_color")


CASES = [(model, name, ()) for model, names in MODELS.items() for name in names]
CASES += [(model, name, (value("transmission", 0.5),)) for model, name, _ in CASES if "transmission" in MODELS[model]]
CASES += [("UsdPreviewSurface", "specularColor", (value("useSpecularWorkflow", 1, "integer"),))]


@pytest.mark.parametrize(("model", "name", "more"), CASES)
def test_one_input_without_a_meaning_refuses_nothing(
    store: AssetStore, model: str, name: str, more: tuple[str, ...]
) -> None:
    """Beside what else decides how it is read."""
    made = [each for each in more if f'"{name}"' not in each]
    type = "color3" if name in COLORS else "float"
    wrong = node("viewdirection", "v", "vector3")
    split = node("extract", "e", "float", wire("in", "v", "vector3"), value("index", 0, "integer"))
    both = node("combine3", "c", "color3", *(wire(f"in{k}", "e", "float") for k in (1, 2, 3)))
    source = "c" if type == "color3" else "e"
    text = mtlx(
        graph(wrong, split, both, out=f"{source} {type}"), surface(model, from_graph(name, "out", type), *made)
    )
    assert material(taken(store, text))["type"] in ("principled", "openpbr")


def test_a_node_of_several_outputs_that_is_not_known(store: AssetStore) -> None:
    ior = node("artistic_ior", "a", "multioutput", value("reflectivity", [1, 0, 0]))
    one = node("extract", "e", "float", wire("in", "a", "color3", "ior"), value("index", 0, "integer"))
    found = taken(
        store,
        mtlx(graph(ior, one, out="e float"), surface("standard_surface", from_graph("specular", "out", "float"))),
    )
    assert losses(found) == {"SM/specular"}


def test_tokens_in_attributes_and_blanks_before_the_first_line(store: AssetStore) -> None:
    """The library's parser takes both, and its own test suite has them."""
    image = node("image", "i", "color3", value("file", "TOKEN.png", "filename"), value("default", [0.5, 0.25, 0.125]))
    text = mtlx('<!-- a=" -->', graph(image, out="i color3"), surface("gltf_pbr", from_graph("base_color", "out")))
    found = taken(store, b" \n" + text.replace(b"TOKEN", b"oak.<UDIM>").replace(b'<!-- a=" -->', b""))
    assert material(found)["base_color"] == [0.5, 0.25, 0.125] and losses(found) == {"NG/i"}
    assert losses(taken(store, text.replace(b"TOKEN", b"oak"))) == {"NG/i"}, "a comment hides nothing"
    with pytest.raises(AssetError, match="not well-formed"):
        store.add(text.replace(b"</nodegraph>", b"<UDIM>"))
    with pytest.raises(AssetError, match="DOCTYPE"):
        store.add(b'<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a "b">]><materialx version="1.39" a="<"/>')


def test_inputs_that_the_library_s_version_of_a_model_lacks(store: AssetStore) -> None:
    """Or has with another type: a number for a colour is all of its channels."""
    given = [value("roughness", 0.25), value("shininess", 3.0), value("metallic", 0.5)]
    found = taken(store, mtlx(surface("gltf_pbr", *given)))
    assert (material(found)["roughness"], material(found)["metallic"]) == (0.25, 0.5)
    assert [(one["pointer"], one["detail"]) for one in found.warnings] == [
        ("SM/shininess", "<gltf_pbr> has no such input; it is left out")
    ]
    given = [value("opacity", 0.5), value("base_color", 0.25), value("specular_roughness", 0.75)]
    found = taken(store, mtlx(surface("standard_surface", *given)))
    assert material(found)["alpha"] == 0.5 and material(found)["roughness"] == 0.75 and not found.warnings
    assert material(found)["base_color"] == 0.25


def test_nodes_with_an_input_too_many(store: AssetStore) -> None:
    image = node("image", "i", "color3", value("file", "a.png", "filename"), value("wiggle", 1.0))
    half = node("multiply", "m", "color3", wire("in1", "i"), value("in2", 0.5), value("swirl", 1.0))
    look = surface("gltf_pbr", from_graph("base_color", "out"))
    found = taken(store, {"a.mtlx": mtlx(graph(image, half, out="m color3"), look), "a.png": png(GREY)})
    assert material(found)["base_color"]["factor"] == 0.5
    assert losses(found) == {"NG/i/wiggle", "NG/m/swirl"}
