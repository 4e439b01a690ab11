"""The built-in presets: valid, complete, and every one of them renders."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from gpu import Renderer, RenderSettings
from service.document import check_saved_material, parse_scene, presets
from service.document.material.disney import DisneyMaterial
from service.document.material.surface import Surface
from service.document.presets import environments, physically_based
from service.document.presets.generated import ASSETS, asset, asset_id
from service.pack import pack
from service.problems import NotFound
from service.server.assets import AssetStore
from tests.counting import python_lines
from tests.marks import seldom

EVERY = [(kind, entry["name"]) for kind in presets.KINDS for entry in presets.names(kind)]
SCENES = [name for kind, name in EVERY if kind == "scenes"]
MESHES = [name for name in ASSETS if asset(name).startswith(b"ply")]
TILES = {"linen-weave"}
IMAGES = [name for name in ASSETS if name not in {*MESHES, *TILES}]
CAMERA = {"position": [0, 1, 8], "target": [0, 0.5, 0]}


def among(kind: str, document: dict[str, Any]) -> dict[str, Any]:
    """A scene document with the preset in its place."""
    if kind == "scenes":
        return document
    scene = presets.get("scenes", "sphere-on-floor")  # the first scene has a wall before a low sun
    if kind != "environments":
        scene["environment"] = {"type": "constant", "radiance": 1}  # which has no tables to build
    if kind == "materials":
        scene["materials"]["Red paint"], scene["textures"] = dressed(document)
    elif kind == "stages":
        scene["materials"] |= document["materials"]
        scene["shapes"] += document["shapes"]
    else:
        scene["environment"] = document
    return scene


def dressed(document: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """A preset's material, and its textures, with which it is what users save."""
    check_saved_material(document)
    if "materials" not in document:
        return document, {}
    (material,) = document["materials"].values()
    return material, document["textures"]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> AssetStore:
    return AssetStore(tmp_path_factory.mktemp("data"), None, presets.builtin_assets)


@pytest.mark.parametrize(("kind", "name"), EVERY)
def test_every_preset_is_valid_and_its_assets_are_there(store: AssetStore, kind: str, name: str) -> None:
    """It can be packed, and all numbers that a kernel would read are finite."""
    document = presets.get(kind, name)
    assert "title" not in document
    for records in vars(pack(parse_scene(among(kind, document)), store).arrays).values():
        numbers = records if isinstance(records, np.ndarray) else np.zeros(0)
        columns = [numbers[column] for column in numbers.dtype.names or ()] or [numbers]
        assert all(np.isfinite(column).all() for column in columns if column.dtype.kind == "f")
    text = json.dumps(document)
    assert "builtin:" not in text
    for part in text.split('"'):
        assert not part.startswith("sha256:") or part in presets.builtin_assets()


@pytest.mark.parametrize("kind", presets.KINDS)
def test_lists_have_titles(kind: str) -> None:
    entries = presets.names(kind)
    members = {"name", "title"} | ({"kind"} if kind == "materials" else set())
    assert all(set(entry) - {"source", "group"} == members and all(entry.values()) for entry in entries)
    assert len({(entry["title"], entry.get("kind")) for entry in entries}) == len(entries)


def test_scenes_begin_with_what_sells_them_and_end_with_tests() -> None:
    listed = presets.names("scenes")
    assert tuple(entry["name"] for entry in listed[: len(presets.FIRST_SCENES)]) == presets.FIRST_SCENES
    tests = {entry["name"] for entry in listed if entry.get("group") == "Tests"}
    assert tests == {entry["name"] for entry in listed[-len(tests) :]} > {"disney-grid", "cornell-empty"}
    assert {entry["name"] for entry in listed if "group" in entry} == tests


def test_there_is_enough_to_choose_from() -> None:
    wanted = {"shader-ball", "sphere-on-floor", "cornell-empty", "cornell-boxes", "cornell-spheres", "roughness-row",
              "sphere-field", "prism",
              "generated-mesh", "point-lights", "cornell-glossy", "cornell-open", "disney-parameters",
              "disney-grid", "whisky", "candle", "water-glass", "perfume", "watch", "orange", "car-panel",
              "armchair"}  # fmt: skip
    assert wanted <= set(SCENES)
    assert len(presets.names("materials")) >= 24 and len(presets.names("environments")) >= 6


def test_the_database_says_where_it_comes_from() -> None:
    data = physically_based.database()
    assert data["license"].startswith("CC0") and "physicallybased.info" in data["source"] and data["version"]
    mine = [entry for entry in presets.names("materials") if entry["kind"] == physically_based.KIND]
    assert len(mine) == len(data["materials"]) == 110
    assert all("(CC0)" in entry["source"] and ": " in entry["source"] for entry in mine)
    assert all(reference["url"] for entry in data["materials"] for reference in entry["references"])


def test_the_database_s_numbers_are_the_presets_numbers() -> None:
    """A metal has its reflectance, in 0..1; light in wine falls off at its rates, of 1/cm."""
    gold = presets.get("materials", "physically-based-gold")
    assert gold["metallic"] == 1 and gold["base_color"] == [1, 0.773, 0.307]
    wine = presets.get("materials", "physically-based-wine-red")
    rates = -np.log(wine["attenuation_color"]) / wine["attenuation_distance"]
    assert rates / 100 == pytest.approx([1.1632, 2.5191, 2.9434], rel=1e-3)
    assert presets.get("materials", "physically-based-brick")["base_color"] == [0.262, 0.095, 0.061]
    assert presets.get("materials", "physically-based-diamond")["abbe"] == 55.3
    bubble = presets.get("materials", "physically-based-soap-bubble")
    assert (bubble["film_thickness"], bubble["film_ior"], bubble["ior"]) == (500, 1.4, 1)
    titanium = presets.get("materials", "physically-based-titanium-anodized")
    assert (titanium["film_thickness"], titanium["film_ior"]) == (160, 2.488), "the middle of 20 to 300 nm"
    everything = [physically_based.document(entry) for entry in physically_based.database()["materials"]]
    assert (sum("abbe" in m for m in everything), sum("film_ior" in m for m in everything)) == (22, 3)


def test_the_database_s_metals_have_their_index_and_their_colour() -> None:
    """Head-on they reflect their colour; the slope towards grazing angles is that of n."""
    found = {entry["name"]: physically_based.document(entry) for entry in physically_based.database()["materials"]}
    metals = {name: m for name, m in found.items() if "conductor_eta" in m}
    assert len(metals) == 31 and "Aluminum (Anodized Red)" not in metals
    for name, m in metals.items():
        n, k = np.array(m["conductor_eta"]), np.array(m["conductor_k"])
        head_on = ((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2)
        assert head_on == pytest.approx(m["base_color"], abs=1e-3), name
        assert m["metallic"] == 1


METALS = {"gold", "silver", "copper", "aluminium", "brushed-aluminium", "iron", "titanium", "chrome", "nickel",
          "platinum", "brass"}  # fmt: skip


@pytest.mark.parametrize("name", sorted(METALS))
def test_metals_say_who_measured_them(name: str) -> None:
    path = Path(presets.__file__).parent / "materials" / f"{name}.json"
    assert "measured n and k" in json.loads(path.read_text())["source"]
    document = presets.get("materials", name)
    assert "source" not in document and document["metallic"] == 1 and min(document["base_color"]) > 0.25


@pytest.mark.parametrize("name", SCENES)
def test_scenes_use_each_of_their_materials(name: str) -> None:
    scene = parse_scene(presets.get("scenes", name))
    assert set(scene.materials) == {shape.material for shape in scene.shapes}


@pytest.mark.parametrize("name", presets.FIRST_SCENES[1:-1])
def test_what_artists_open_speaks_their_words(name: str) -> None:
    """Names as of things in a room, for each material, each shape and each light."""
    document = presets.get("scenes", name)
    things = [*document["shapes"], *document.get("lights", [])]
    words = [*document["materials"], *document.get("textures", {}), *(thing["name"] for thing in things)]
    assert all(word[0].isupper() and "-" not in word for word in words)
    assert len({thing["name"] for thing in things}) == len(things)


@pytest.mark.parametrize("name", SCENES)
def test_no_scene_has_a_programmer_s_names(name: str) -> None:
    document = presets.get("scenes", name)
    assert all(re.match("[A-Z][a-z]", each) for each in document["materials"])
    assert presets.subject(document) in document["materials"]


def test_documents_are_the_caller_s_own() -> None:
    presets.get("scenes", "sphere-on-floor")["materials"].clear()
    assert presets.get("scenes", "sphere-on-floor")["materials"]


@pytest.mark.parametrize(("kind", "name"), [("scenes", "nosuch"), ("lights", "gold"), ("scenes", "../x")])
def test_unknown_presets_are_not_found(kind: str, name: str) -> None:
    with pytest.raises(NotFound):
        presets.get(kind, name)
    with pytest.raises(NotFound):
        presets.names("lights")


def test_the_row_goes_from_mirror_to_matte() -> None:
    scene = parse_scene(presets.get("scenes", "roughness-row"))
    spheres = sorted((s for s in scene.shapes if s.type == "sphere"), key=lambda sphere: sphere.center[0])
    roughness = [scene.materials[sphere.material].roughness for sphere in spheres]  # type: ignore[union-attr]
    assert roughness == np.linspace(0, 1, 9).tolist()


def test_each_parameter_of_disney_has_a_row_from_0_to_1() -> None:
    """And nothing else changes along it."""
    document = presets.get("scenes", "disney-parameters")
    rows: dict[float, list[Any]] = {}
    spheres = (shape for shape in document["shapes"] if shape["type"] == "sphere")
    for sphere in sorted(spheres, key=lambda sphere: sphere["center"][0]):
        material = document["materials"][sphere["material"]]
        rows.setdefault(sphere["center"][1], []).append(material)
    shown = set()
    for row in rows.values():
        (varied,) = {key for material in row for key in material if material[key] != row[0].get(key)}
        assert [material[varied] for material in row] == pytest.approx(np.linspace(0, 1, 11))
        shown.add(varied)
    assert shown == set(DisneyMaterial.model_fields) - set(Surface.model_fields) - {"type"}


def test_the_grid_has_every_combination_once() -> None:
    materials = [m for m in presets.get("scenes", "disney-grid")["materials"].values() if m["type"] == "disney"]
    seen = {(m["metallic"], m["roughness"], m["specular"]) for m in materials}
    axes = [sorted(set(values)) for values in zip(*seen, strict=True)]
    assert len(seen) == len(materials) == np.prod([len(axis) for axis in axes])
    assert all((axis[0], axis[-1]) == (0, 1) for axis in axes)


def test_the_field_has_a_thousand_spheres_that_do_not_touch() -> None:
    spheres = [shape for shape in presets.get("scenes", "sphere-field")["shapes"] if shape["type"] == "sphere"]
    assert len(spheres) == 1000
    centers, radii = np.array([s["center"] for s in spheres]), np.array([s["radius"] for s in spheres])
    assert np.array_equal(centers[:, 1], radii), "they lie on the floor"
    gaps = np.linalg.norm(centers[:, None] - centers, axis=2) - radii[:, None] - radii
    np.fill_diagonal(gaps, np.inf)
    assert gaps.min() > 0


def test_each_of_a_thousand_spheres_costs_the_same_and_little() -> None:
    """65 lines of Python."""
    document = presets.get("scenes", "sphere-field")

    def lines(count: int) -> int:
        return python_lines(lambda: parse_scene({**document, "shapes": document["shapes"][:count]}))

    parse_scene(document)  # what is done only once
    few, more, most = map(lines, (250, 500, 1000))
    assert most - more == pytest.approx(2 * (more - few), rel=0.01)
    assert (most - more) / 500 < 90


def test_assets_are_named_by_their_bytes_and_always_the_same() -> None:
    for name, make in ASSETS.items():
        assert make() == asset(name)
        assert asset_id(name) == "sha256:" + hashlib.sha256(asset(name)).hexdigest()
    assert set(presets.builtin_assets()) == set(map(asset_id, ASSETS))


def read_image(name: str, folder: Path) -> np.ndarray:
    """By OpenImageIO, which is not what wrote it."""
    path = folder / f"{name}.exr"
    path.write_bytes(asset(name))
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT))


@pytest.mark.parametrize("name", IMAGES)
def test_images_are_whole_and_positive(name: str, tmp_path: Path) -> None:
    pixels = read_image(name, tmp_path)
    assert pixels.shape == (environments.HEIGHT, environments.WIDTH, 3)
    assert np.isfinite(pixels).all() and pixels.min() > 0
    seam = np.abs(pixels[:, 0] - pixels[:, -1]) / pixels.mean(axis=1)
    assert seam.max() < 0.1, "the left edge goes on where the right one ends"


def test_rows_columns_and_channels_are_where_they_belong(tmp_path: Path) -> None:
    pixels = read_image("sunset", tmp_path)
    row, column = np.unravel_index(pixels.sum(axis=2).argmax(), pixels.shape[:2])
    assert environments.directions()[row, column] @ environments.toward(52, 7) > np.cos(np.radians(1.5))
    assert row < environments.HEIGHT / 2 < column, "above the horizon, on the right of -Z"
    red, green, blue = pixels[row, column]
    assert red > green > blue


def test_the_sun_gives_four_times_the_light_of_the_sky(tmp_path: Path) -> None:
    pixels = read_image("clear-sky", tmp_path) @ [0.2126, 0.7152, 0.0722]
    polar = (np.arange(environments.HEIGHT)[:, None] + 0.5) / environments.HEIGHT * np.pi
    cosine = np.clip(environments.directions()[:, :, 1], 0, 1)
    light = pixels * cosine * np.sin(polar)
    disk = pixels > 20
    assert 3.5 < light[disk].sum() / light[~disk].sum() < 4.5
    assert pixels.max() > 2**6 * np.median(pixels[~disk]), "several stops"


def rendered(gpu: Renderer, store: AssetStore, document: dict[str, Any]) -> np.ndarray:
    scene = gpu.load(pack(parse_scene(document), store).arrays)
    picture = gpu.picture(scene, RenderSettings(32, 32, max_bounces=4))
    try:
        picture.trace(60.0, 4)
        return np.asarray(picture.read("color"))
    finally:
        picture.release()
        scene.release()


# One for each of the families of kernels that other tests compile as well: the others need a kernel each.
OFTEN = {"cornell-boxes", "cornell-spheres", "sphere-on-floor", "diffuse", "blinn_phong"}


@pytest.mark.parametrize("name", seldom(SCENES, set(SCENES) - OFTEN))
def test_every_scene_renders(gpu: Renderer, store: AssetStore, name: str) -> None:
    """And is neither black nor white at exposure 0, where nobody has touched it; some are dark rooms."""
    color = rendered(gpu, store, presets.get("scenes", name))[..., :3]
    assert np.isfinite(color).all()
    assert np.quantile(color, 0.98) > 0.1 and np.median(color) < 1.0 and color.std() > 0.02


# What makes kernels long where it comes together.
RARE = ("abbe", "film_thickness", "subsurface_radius", "thin_film_weight", "thin_walled", "transmission")


def alike() -> dict[str, list[str]]:
    """The library's materials by their model and what is rare in them."""
    found: dict[str, list[str]] = {}
    for entry in presets.names("materials"):
        document, _ = dressed(presets.get("materials", entry["name"]))
        key = ", ".join([document["type"], *(name for name in RARE if document.get(name))])
        found.setdefault(key, []).append(entry["name"])
    return found


ALIKE = alike()


@pytest.mark.parametrize("key", seldom(ALIKE, ALIKE.keys() - OFTEN))
def test_every_material_renders(gpu: Renderer, store: AssetStore, key: str) -> None:
    """Those that are alike in one picture: a kernel with all that the library knows would take minutes to compile."""
    names = ALIKE[key]
    row = [
        {"type": "sphere", "center": [i % 4 - 1.5, i // 4 - 1.0, 0], "radius": 0.5, "material": name}
        for i, name in enumerate(names)
    ]
    pairs = {name: dressed(presets.get("materials", name)) for name in names}
    materials, textures = ({name: pair[k] for name, pair in pairs.items()} for k in (0, 1))
    environment = {"type": "constant", "radiance": 1}
    document = {"version": 1, "camera": CAMERA, "materials": materials, "shapes": row, "environment": environment}
    document["textures"] = {name: each for shown in textures.values() for name, each in shown.items()}
    color = rendered(gpu, store, document)[..., :3]
    assert np.isfinite(color).all() and color.min() >= 0 and np.median(color) > 0.05


ENVIRONMENTS = [name for kind, name in EVERY if kind == "environments"]


@pytest.mark.parametrize("name", seldom(ENVIRONMENTS, ["white-furnace"]))  # the one with a kernel of its own
def test_every_environment_renders(gpu: Renderer, store: AssetStore, name: str) -> None:
    color = rendered(gpu, store, among("environments", presets.get("environments", name)))[..., :3]
    assert np.isfinite(color).all() and 0.05 < np.median(color) < 1.5
