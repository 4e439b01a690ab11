"""MaterialX's OpenPBR and Standard Surface become `openpbr` where that loses less."""

from __future__ import annotations

from typing import Any

import pytest

from service.document.material import OpenpbrMaterial
from service.server.assets import AssetStore
from tests.mtlx_files import from_graph, graph, losses, material, mtlx, node, surface, taken, value, wire

pytest.importorskip("MaterialX")

OPEN_PBR: dict[str, Any] = {
    "base_weight": 0.9, "base_color": [0.5, 0.25, 0.75], "base_diffuse_roughness": 0.4, "base_metalness": 0.5,
    "specular_weight": 1.5, "specular_color": [0.9, 0.8, 0.7], "specular_roughness": 0.2,
    "specular_roughness_anisotropy": 0.6, "specular_ior": 0.75, "transmission_weight": 0.25,
    "transmission_color": [0.1, 0.2, 0.3], "coat_weight": 0.5, "coat_color": [0.6, 0.5, 0.4], "coat_roughness": 0.1,
    "coat_roughness_anisotropy": 0.3, "coat_ior": 1.7, "coat_darkening": 0.75, "fuzz_weight": 0.2,
    "fuzz_color": [0.3, 0.2, 0.1], "fuzz_roughness": 0.6, "emission_luminance": 500.0,
    "emission_color": [0.5, 2.0, 1.0], "geometry_opacity": 0.8,
}  # fmt: skip


def test_open_pbr_is_openpbr_without_a_loss(store: AssetStore) -> None:
    """All that the model has stays as it is, tangents turned about the normal as well; an input that is not there is
    the model's own default."""
    about = wire("in", "t", "vector3"), wire("axis", "n", "vector3"), value("amount", -30.0)
    turned = node("rotate3d", "turned", "vector3", *about)
    made = graph(node("tangent", "t", "vector3"), node("normal", "n", "vector3"), turned, out="turned vector3")
    inputs = [value(name, each) for name, each in OPEN_PBR.items()]
    shader = surface("open_pbr_surface", *inputs, from_graph("geometry_coat_tangent", "out", "vector3"))
    imported = taken(store, mtlx(made, shader))
    found = material(imported)
    assert found.pop("geometry_coat_tangent") == pytest.approx([3**0.5 / 2, 0.5, 0], abs=1e-6)
    assert found == {"type": "openpbr", **OPEN_PBR} and not imported.warnings
    plain = OpenpbrMaterial.model_validate(material(taken(store, mtlx(surface("open_pbr_surface")))))
    assert plain == OpenpbrMaterial(type="openpbr")


def test_insides_come_along(store: AssetStore) -> None:
    """What is not used stays away."""
    below = {
        "subsurface_weight": 0.5, "subsurface_color": [0.9, 0.5, 0.25], "subsurface_radius": 0.125,
        "subsurface_radius_scale": [1.0, 0.25, 0.125], "subsurface_scatter_anisotropy": -0.5,
    }  # fmt: skip
    inside = {
        "transmission_weight": 0.5, "transmission_depth": 2.0, "transmission_scatter": [0.25, 0.5, 0.75],
        "transmission_scatter_anisotropy": 0.5,
    }  # fmt: skip
    for parts in (below, inside, below | inside):
        imported = taken(store, mtlx(surface("open_pbr_surface", *(value(name, x) for name, x in parts.items()))))
        assert material(imported) == {"type": "openpbr", **parts} and not imported.warnings
        OpenpbrMaterial.model_validate(material(imported))
    unused = {name: x for name, x in (below | inside).items() if not name.endswith("_weight")}
    imported = taken(store, mtlx(surface("open_pbr_surface", *(value(name, x) for name, x in unused.items()))))
    assert material(imported) == {"type": "openpbr", "subsurface_color": [0.9, 0.5, 0.25]}


def test_a_colour_that_must_be_one_is_told(store: AssetStore) -> None:
    stripes = graph(node("ramplr", "ramp", "color3", value("valuel", [0.0] * 3), value("valuer", [1.0] * 3)))
    shader = surface(
        "open_pbr_surface", value("subsurface_weight", 1.0), from_graph("subsurface_radius_scale", "out", "color3")
    )
    imported = taken(store, mtlx(stripes, shader))
    assert losses(imported) == {"SM/subsurface_radius_scale"}
    assert "subsurface_radius_scale" not in material(imported)


def test_a_tangent_of_the_files_own_is_listed(store: AssetStore) -> None:
    imported = taken(store, mtlx(surface("open_pbr_surface", value("geometry_tangent", "1, 0, 0", "vector3"))))
    assert material(imported) == {"type": "openpbr"} and losses(imported) == {"SM/geometry_tangent"}


def test_skin_of_standard_surface(store: AssetStore) -> None:
    """Its radius is a colour times a scale; with what scatters inside glass it is `openpbr`, too."""
    skin = [
        value("subsurface", 0.75), value("subsurface_color", [0.8, 0.4, 0.2]),
        value("subsurface_radius", [2, 1, 0.5]), value("subsurface_scale", 0.25), value("subsurface_anisotropy", 0.5),
    ]  # fmt: skip
    imported = taken(store, mtlx(surface("standard_surface", *skin)))
    found = material(imported)
    assert found["type"] == "openpbr" and not imported.warnings
    assert found["subsurface_weight"] == 0.75 and found["subsurface_color"] == pytest.approx([0.8, 0.4, 0.2])
    assert found["subsurface_radius"] == 0.5 and found["subsurface_scatter_anisotropy"] == 0.5
    assert "subsurface_radius_scale" not in found, "it is what openpbr has by itself"
    jade = [
        value("transmission", 1), value("transmission_depth", 2), value("transmission_scatter", [0.5, 0.25, 0.125]),
        value("transmission_scatter_anisotropy", 0.25),
    ]  # fmt: skip
    imported = taken(store, mtlx(surface("standard_surface", *jade)))
    found = material(imported)
    assert (found["transmission_depth"], found["transmission_scatter_anisotropy"]) == (2, 0.25)
    assert found["transmission_scatter"] == [0.5, 0.25, 0.125] and not imported.warnings


def test_standard_surface_is_the_model_that_loses_less(store: AssetStore) -> None:
    """A tinted, stretched coat is OpenPBR's; glass with a tint inside is what `principled` has as well."""
    coat = [
        value("coat", 1), value("coat_color", [0.9, 0.5, 0.2]), value("coat_IOR", 1.6), value("coat_anisotropy", 0.5),
        value("coat_rotation", 0.25), value("specular_roughness", 0.3), value("emission", 2), value("metalness", 1),
    ]  # fmt: skip
    imported = taken(store, mtlx(surface("standard_surface", *coat)))
    found = material(imported)
    # b is 1/2: r^2 sqrt(2 / (1 + b^2)) of OpenPBR is r^2 / sqrt(b) here.
    assert found.pop("coat_roughness") == pytest.approx(0.1 * (1.25 / (2 * 0.5)) ** 0.25, rel=1e-6)
    assert found == {
        "type": "openpbr", "base_metalness": 1.0, "base_color": pytest.approx(0.8),
        "coat_weight": 1.0, "coat_color": pytest.approx([0.9, 0.5, 0.2]), "coat_roughness_anisotropy": 0.5,
        "geometry_coat_tangent": [0.0, 1.0, 0.0], "coat_darkening": 0.0, "emission_luminance": 1366.0,
    }  # fmt: skip
    assert not imported.warnings
    body = [value("transmission", 1), value("transmission_depth", 2)]
    assert material(taken(store, mtlx(surface("standard_surface", *coat, *body))))["transmission_depth"] == 2
    assert material(taken(store, mtlx(surface("standard_surface", *body))))["type"] == "principled"


def test_thin_walls(store: AssetStore) -> None:
    """All of OpenPBR stays; leaves of Standard Surface are `principled`, which has what goes through."""
    wall, glass = value("geometry_thin_walled", "true", "boolean"), value("transmission_weight", 1)
    depth = value("transmission_depth", 2)  # of an inside, which it has not
    imported = taken(store, mtlx(surface("open_pbr_surface", wall, glass, depth)))
    found = material(imported)
    assert (found["type"], found["geometry_thin_walled"], found["transmission_weight"]) == ("openpbr", True, 1)
    paper = [
        value("base_color", [0.2, 0.2, 0.2]), value("subsurface_weight", 0.5),
        value("subsurface_color", [0.9, 0.8, 0.6]), value("subsurface_scatter_anisotropy", 0.2),
    ]  # fmt: skip
    found = material(taken(store, mtlx(surface("open_pbr_surface", wall, *paper))))
    assert found["type"] == "openpbr" and found["geometry_thin_walled"] is True
    assert (found["subsurface_weight"], found["subsurface_scatter_anisotropy"]) == (0.5, pytest.approx(0.2))
    assert found["subsurface_color"] == [0.9, 0.8, 0.6] and found["base_color"] == 0.2
    leaf = [
        value("subsurface", 0.4),
        value("subsurface_color", [0.5, 0.8, 0.1]),
        value("thin_walled", "true", "boolean"),
    ]
    found = material(taken(store, mtlx(surface("standard_surface", *leaf))))
    assert (found["type"], found["diffuse_transmission"]) == ("principled", pytest.approx(0.4))


def test_a_thin_film_comes_along(store: AssetStore) -> None:
    film = {"thin_film_weight": 0.5, "thin_film_thickness": 0.35, "thin_film_ior": 2.2}
    imported = taken(store, mtlx(surface("open_pbr_surface", *(value(name, x) for name, x in film.items()))))
    assert material(imported) == {"type": "openpbr", **{name: pytest.approx(x) for name, x in film.items()}}
    assert not imported.warnings


def test_films_of_standard_surface(store: AssetStore) -> None:
    """As `openpbr`, where a coloured coat makes it one."""
    film = [value("thin_film_thickness", 420), value("thin_film_IOR", 1.7)]
    coat = [value("coat", 1), value("coat_color", [0.9, 0.5, 0.2]), value("coat_roughness", 0)]
    imported = taken(store, mtlx(surface("standard_surface", *film, *coat)))
    found = material(imported)
    assert (found["type"], found["thin_film_weight"]) == ("openpbr", 1)
    assert (found["thin_film_thickness"], found["thin_film_ior"]) == (pytest.approx(0.42), pytest.approx(1.7))
    assert not imported.warnings


def test_a_part_of_a_film_is_all_or_nothing_on_principled(store: AssetStore) -> None:
    """And a part of a film on openpbr, unless that loses more: it has no cut-off."""
    cut = value("alpha_mode", 1, "integer")
    for weight, thickness in ((0.3, None), (0.6, 550)):
        inputs = [value("iridescence", weight), value("iridescence_thickness", 550)]
        imported = taken(store, mtlx(surface("gltf_pbr", *inputs)))
        assert material(imported)["thin_film_weight"] == weight and not imported.warnings
        inputs.append(cut)
        imported = taken(store, mtlx(surface("gltf_pbr", *inputs)))
        assert material(imported).get("film_thickness") == thickness and losses(imported) == {"SM/iridescence"}
    stripes = graph(node("ramplr", "ramp", "float", value("valuel", 0.0), value("valuer", 1.0)), share="ramp float")
    shader = surface(
        "gltf_pbr", from_graph("iridescence", "share", "float"), value("iridescence_thickness", 550), cut
    )
    imported = taken(store, mtlx(stripes, shader))
    thickness = material(imported)["film_thickness"]
    image = store.image(imported.document["textures"][thickness["texture"]]["asset"]).pixels
    row = image[image.shape[0] // 2, :, 0] / image.max() * thickness["factor"]
    half = len(row) // 2
    assert row[: half - 1].max() == 0 and row[half + 1 :] == pytest.approx(550, rel=1e-3)
