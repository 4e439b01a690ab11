"""MaterialX's OpenPBR and Standard Surface become `openpbr` where that loses less."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.assets import AssetStore
from service.scene.material import OpenpbrMaterial
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


def test_what_openpbr_has_not_yet_is_listed(store: AssetStore) -> None:
    unsupported = [
        value("subsurface_weight", 0.5), value("subsurface_color", 0, "color3").replace('"0"', '"0, 0, 0"'),
        value("base_color", [0.8, 0.4, 0.2]),
        value("geometry_tangent", "1, 0, 0", "vector3"),
        value("transmission_scatter", [0.1, 0.2, 0.3]),
    ]  # fmt: skip
    imported = taken(store, mtlx(surface("open_pbr_surface", *unsupported)))
    assert material(imported) == {"type": "openpbr", "base_color": pytest.approx([0.4, 0.2, 0.1])}
    assert losses(imported) == {
        f"SM/{name}" for name in (
            "subsurface_weight", "geometry_tangent",
            "transmission_scatter",
        )
    }  # fmt: skip


def test_standard_surface_is_the_model_that_loses_less(store: AssetStore) -> None:
    """A tinted, stretched coat is OpenPBR's; with a body below it `principled` has more."""
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
    assert material(taken(store, mtlx(surface("standard_surface", *coat, *body))))["type"] == "principled"


def test_thin_walls(store: AssetStore) -> None:
    """Panes are `openpbr`; of what scatters, the part that goes through is `principled`'s."""
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
    assert found["type"] == "principled" and found["thin_walled"] is True and "subsurface" not in found
    share = 0.5 * 0.5 * 1.2
    assert found["diffuse_transmission"] == pytest.approx(share)
    assert found["diffuse_transmission_color"] == pytest.approx([0.9, 0.8, 0.6])
    # What comes back: half of it the base's, and of the other half 1/2 (1 - 0.2).
    back = np.array([0.2, 0.2, 0.2]) * 0.5 + np.array([0.9, 0.8, 0.6]) * 0.5 * 0.4
    np.testing.assert_allclose((1 - share) * np.array(found["base_color"]), back, rtol=1e-5)
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
    for share, thickness in ((0.3, None), (0.6, 550)):
        inputs = [value("iridescence", share), value("iridescence_thickness", 550)]
        imported = taken(store, mtlx(surface("gltf_pbr", *inputs)))
        assert material(imported).get("film_thickness") == thickness and losses(imported) == {"SM/iridescence"}
    stripes = graph(node("ramplr", "ramp", "float", value("valuel", 0.0), value("valuer", 1.0)), share="ramp float")
    shader = surface("gltf_pbr", from_graph("iridescence", "share", "float"), value("iridescence_thickness", 550))
    imported = taken(store, mtlx(stripes, shader))
    thickness = material(imported)["film_thickness"]
    image = store.image(imported.document["textures"][thickness["texture"]]["asset"]).pixels
    row = image[image.shape[0] // 2, :, 0] / image.max() * thickness["factor"]
    half = len(row) // 2
    assert row[: half - 1].max() == 0 and row[half + 1 :] == pytest.approx(550, rel=1e-3)
