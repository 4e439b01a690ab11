"""KHR_materials_iridescence as a thin film, and back."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from service.config import Config
from service.document import parse_scene
from service.exports import FORMATS
from service.formats.scene_import import Imported
from service.server.assets import AssetStore
from tests.asset_files import png
from tests.gltf_files import Gltf
from tests.service.formats.scenes import imported, noted

NAME = "KHR_materials_iridescence"
AT = f"/materials/0/extensions/{NAME}"
RNG = np.random.default_rng(3)
RAMP = np.arange(256, dtype=np.uint8).reshape(16, 16)
SHARES = RAMP.astype(np.float64) / 255
DATA = np.dstack([RNG.permutation(RAMP.ravel()).reshape(16, 16), RAMP, RAMP])


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


# `openpbr` has no cut-off, so that a material with one is `principled`, whose films cover all or nothing.
CUT = {"alphaMode": "MASK"}


def film(
    store: AssetStore, extension: dict[str, Any], file: Gltf | None = None, **more: Any
) -> tuple[dict[str, Any], Imported]:
    found = imported(store, (file or Gltf()).of({"extensions": {NAME: extension}, **more}))
    (made,) = found.document["materials"].values()
    return made, found


def texels(store: AssetStore, found: Imported, thickness: dict[str, Any]) -> np.ndarray:
    """Thicknesses in nm."""
    image = store.image(found.document["textures"][thickness["texture"]]["asset"]).pixels
    values: np.ndarray = image[..., "rgba".index(thickness.get("channel", "r"))] / 255 * thickness["factor"]
    return values


def test_a_whole_film_has_the_maximum_s_thickness(store: AssetStore) -> None:
    made, found = film(store, {"iridescenceFactor": 1})
    assert (made["film_thickness"], made["film_ior"]) == (400, 1.3), "the extension's own defaults"
    assert "other hues" in noted(found)[AT]
    made, _ = film(store, {"iridescenceFactor": 1, "iridescenceIor": 1.8, "iridescenceThicknessMaximum": 550})
    assert (made["film_thickness"], made["film_ior"]) == (550, 1.8)


@pytest.mark.parametrize(
    "extension", [{}, {"iridescenceFactor": 0}, {"iridescenceFactor": 1, "iridescenceThicknessMaximum": 0}]
)
def test_no_film(store: AssetStore, extension: dict[str, Any]) -> None:
    made, found = film(store, {"iridescenceIor": 1.8, **extension})
    assert not {"film_thickness", "film_ior"} & made.keys() and not noted(found)


def test_a_part_of_a_film_is_openpbr_s(store: AssetStore) -> None:
    made, found = film(store, {"iridescenceFactor": 0.25, "iridescenceIor": 1.8})
    names = ("thin_film_weight", "thin_film_thickness", "thin_film_ior")
    assert [made["type"], *map(made.get, names)] == ["openpbr", 0.25, pytest.approx(0.4), 1.8]
    assert list(noted(found)) == [AT] and "other hues" in noted(found)[AT]


def test_a_part_of_a_film_is_told_on_principled(store: AssetStore) -> None:
    made, found = film(store, {"iridescenceFactor": 0.7}, **CUT)
    assert made["film_thickness"] == 400 and "of 0.7 it covers all" in noted(found)[f"{AT}/iridescenceFactor"]
    made, found = film(store, {"iridescenceFactor": 0.3}, **CUT)
    assert "film_thickness" not in made and "of 0.3 it is left out" in noted(found)[f"{AT}/iridescenceFactor"]


def test_beyond_our_ranges(store: AssetStore) -> None:
    given = {"iridescenceFactor": 1, "iridescenceIor": 5, "iridescenceThicknessMaximum": 20000}
    made, found = film(store, given, **CUT)
    assert (made["film_thickness"], made["film_ior"]) == (10000, 4)
    assert {f"{AT}/iridescenceIor", f"{AT}/iridescenceThicknessMaximum"} <= noted(found).keys()
    made, found = film(store, given)
    assert (made["thin_film_thickness"], made["thin_film_ior"]) == (10, 5), "an index that openpbr has"
    assert f"{AT}/iridescenceIor" not in noted(found) and f"{AT}/iridescenceThicknessMaximum" in noted(found)


def test_a_thickness_texture_from_zero_is_the_file_s_own(store: AssetStore) -> None:
    file = Gltf()
    texture = {"index": file.texture(DATA)}
    extension = {"iridescenceFactor": 1, "iridescenceThicknessMinimum": 0, "iridescenceThicknessMaximum": 600,
                 "iridescenceThicknessTexture": texture}  # fmt: skip
    made, found = film(store, extension, file)
    assert (made["film_thickness"]["channel"], made["film_thickness"]["factor"]) == ("g", 600)
    assert np.allclose(texels(store, found, made["film_thickness"]), SHARES * 600)


@pytest.mark.parametrize(("least", "most"), [(100, 400), (700, 200)])
def test_a_thickness_texture_from_a_minimum_is_computed(store: AssetStore, least: float, most: float) -> None:
    file = Gltf()
    extension = {"iridescenceFactor": 1, "iridescenceThicknessMinimum": least, "iridescenceThicknessMaximum": most,
                 "iridescenceThicknessTexture": {"index": file.texture(DATA)}}  # fmt: skip
    made, found = film(store, extension, file)
    got = texels(store, found, made["film_thickness"])
    assert np.abs(got - (least + (most - least) * SHARES)).max() <= 0.5 * max(least, most) / 255 + 1e-6
    assert found.document["textures"][made["film_thickness"]["texture"]]["color_space"] == "linear"


def masked() -> tuple[Gltf, dict[str, Any]]:
    file = Gltf()
    extension = {"iridescenceFactor": 0.8, "iridescenceThicknessMinimum": 0, "iridescenceThicknessMaximum": 500,
                 "iridescenceTexture": {"index": file.texture(DATA)},
                 "iridescenceThicknessTexture": {"index": file.texture(DATA[::-1].copy())}}  # fmt: skip
    return file, extension


def test_a_mask_is_the_weight_of_a_film_on_openpbr(store: AssetStore) -> None:
    file, extension = masked()
    made, found = film(store, extension, file)
    weight, thickness = made["thin_film_weight"], made["thin_film_thickness"]
    assert (weight["channel"], weight["factor"]) == ("r", 0.8)
    assert np.allclose(1000 * texels(store, found, thickness), SHARES[::-1] * 500) and list(noted(found)) == [AT]


def test_a_mask_covers_whole_texels_on_principled(store: AssetStore) -> None:
    file, extension = masked()
    made, found = film(store, extension, file, **CUT)
    expected = np.where(0.8 * DATA[..., 0] / 255 >= 0.5, SHARES[::-1] * 500, 0)
    assert 0 < (expected == 0).mean() < 1
    assert np.abs(texels(store, found, made["film_thickness"]) - expected).max() <= 0.5 * 500 / 255 + 1e-6
    assert "all of a texel or nothing" in noted(found)[f"{AT}/iridescenceFactor"]
    # A mask alone: the maximum where it covers.
    file = Gltf()
    extension = {"iridescenceFactor": 1, "iridescenceTexture": {"index": file.texture(DATA)}}
    made, found = film(store, extension, file, **CUT)
    assert np.allclose(texels(store, found, made["film_thickness"]), np.where(DATA[..., 0] >= 128, 400, 0))
    extension = {"iridescenceFactor": 0.4, "iridescenceTexture": {"index": (file := Gltf()).texture(DATA)}}
    made, found = film(store, extension, file, **CUT)
    assert "film_thickness" not in made and "of 0.4 it is left out" in noted(found)[f"{AT}/iridescenceFactor"]


def scene(material: dict[str, Any], textures: dict[str, Any]) -> dict[str, Any]:
    quad = {
        "type": "mesh",
        "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0]],
        "faces": [[0, 1, 2]],
        "uvs": [[0, 0], [1, 0], [1, 1]],
        "material": "m",
    }
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 33}
    return {"version": 1, "camera": camera, "materials": {"m": material}, "textures": textures, "shapes": [quad]}


@pytest.mark.parametrize(
    "own",
    [
        {"film_thickness": 312.5, "film_ior": 1.75},
        {"film_thickness": 550, "film_ior": 1.33, "metallic": 1},
        {"film_thickness": 80, "transmission": 1, "ior": 1, "roughness": 0},
        {"film_thickness": {"texture": "t", "channel": "g", "factor": 640}, "film_ior": 1.5},
        {"film_thickness": {"texture": "t", "channel": "b", "factor": 640}, "film_ior": 1.5},
    ],
)
def test_a_film_comes_back(store: AssetStore, own: dict[str, Any]) -> None:
    before = {"type": "principled", "base_color": [0.25, 0.5, 0.75], **own}
    textures = {"t": {"asset": store.add(png(DATA)).id}} if isinstance(own["film_thickness"], dict) else {}
    made = FORMATS["glb"].scene_writer(parse_scene(scene(before, textures)), store, Config())
    assert dict(made.losses) == {}
    found = store.scene(store.add(made.data).id)
    after = found.document["materials"]["m"]
    assert after["film_ior"] == own.get("film_ior", 1.4)
    if textures:
        assert np.allclose(texels(store, found, after["film_thickness"]), SHARES * 640)
    else:
        assert after["film_thickness"] == own["film_thickness"]


def test_openpbr_s_film_keeps_its_weight(store: AssetStore) -> None:
    film = {"thin_film_weight": 0.75, "thin_film_thickness": 0.45, "thin_film_ior": 1.6}
    losses, extension = written(store, {"type": "openpbr", **film})
    assert losses.keys() == {"/materials/m/type"}
    assert extension == {"iridescenceFactor": 0.75, "iridescenceIor": 1.6, "iridescenceThicknessMaximum": 450}
    _, extension = written(store, {"type": "openpbr", **film, "thin_film_weight": 0})
    assert extension is None


def test_what_has_no_place_is_told(store: AssetStore) -> None:
    noise = {"n": {"type": "noise"}}
    losses, extension = written(
        store, {"type": "principled", "film_thickness": {"texture": "n", "factor": 300}, "film_ior": 1.5}, noise
    )
    assert losses.keys() == {"/materials/m/film_thickness"}
    assert extension is not None and extension["iridescenceThicknessMaximum"] == 300
    losses, extension = written(
        store, {"type": "principled", "film_thickness": 300, "film_ior": {"texture": "n", "factor": 2}}, noise
    )
    assert losses.keys() == {"/materials/m/film_ior"}
    assert extension is not None and extension["iridescenceIor"] == 2


def written(
    store: AssetStore, material: dict[str, Any], textures: dict[str, Any] | None = None
) -> tuple[dict[str, str], dict[str, Any] | None]:
    """What is lost, and the extension in the file."""
    made = FORMATS["glb"].scene_writer(parse_scene(scene(material, textures or {})), store, Config())
    (size,) = struct.unpack_from("<I", made.data, 12)
    (found,) = json.loads(made.data[20 : 20 + size])["materials"]
    return dict(made.losses), found.get("extensions", {}).get(NAME)
