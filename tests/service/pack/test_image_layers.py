"""The layer of an EXR that a texture or an environment names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from service.document import parse_scene
from service.pack import PackCache, pack
from service.pack.lights.environment import environment_key
from service.problems import InvalidDocument
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.documents import packed, sphere
from tests.exr_files import written, written_parts

RNG = np.random.default_rng(8)
TEXELS = RNG.random((4, 8, 7)).astype(np.float32) + 0.1
NAMES = [f"{layer}.{channel}" for layer in ("V.AO", "V.Combined") for channel in "RGB"] + ["V.Depth.Z"]
LAYERS = {"V.AO": [0, 1, 2], "V.Combined": [3, 4, 5], "v.ao": [0, 1, 2], "V.Depth.Z": [6, 6, 6], None: [3, 4, 5]}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


@pytest.fixture(scope="module")
def picture(store: AssetStore) -> str:
    return store.add(written(TEXELS, NAMES)).id


def named(layer: str | None) -> dict[str, str]:
    return {} if layer is None else {"layer": layer}


def textured(asset: str, **layers: str | None) -> dict[str, Any]:
    """Textures by the name of a material that shows each."""
    return {
        "textures": {name: {"asset": asset, **named(layer)} for name, layer in layers.items()},
        "materials": {name: {"type": "diffuse", "albedo": {"texture": name}} for name in layers}
        | {"grey": {"type": "diffuse", "albedo": 0.5}},
    }


@pytest.mark.parametrize("layer", LAYERS)
def test_an_environment_shows_the_layer_that_it_names(store: AssetStore, picture: str, layer: str | None) -> None:
    shown = packed(sphere(), assets=store, environment={"type": "image", "asset": picture, **named(layer)})
    assert shown.arrays.environment is not None
    assert np.array_equal(shown.arrays.environment.texels, TEXELS[..., LAYERS[layer]])
    told = "/environment/asset: layer V.Combined of V.AO, V.Combined is shown; choose another one by `layer`"
    assert shown.warnings == ([told] if layer is None else [])


def test_textures_show_the_layers_that_they_name(store: AssetStore, picture: str) -> None:
    """Two layers of one file side by side, and each again from a cache."""
    cache = PackCache()
    for first, second in (("V.AO", "V.Combined"), ("V.Combined", "V.Depth.Z"), ("V.AO", "V.Combined")):
        document = {
            "version": 1,
            "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
            "shapes": [sphere(material="a"), sphere(material="b")],
            **textured(picture, a=first, b=second),
        }
        arrays = pack(parse_scene(document), store, cache=cache).arrays
        assert arrays.textures is not None
        texels = arrays.textures.floats.reshape(-1, 4)
        for layer in (first, second):
            wanted = TEXELS[..., LAYERS[layer]].reshape(-1, 3)
            found = [k for k in range(len(texels) - 31) if np.array_equal(texels[k : k + 32, :3], wanted)]
            assert len(found) == 1, layer


def test_parts_are_layers_by_their_names(store: AssetStore) -> None:
    parts = [("AO", TEXELS[..., :3], "RGB"), ("beauty", TEXELS[..., 3:6], "RGB")]
    asset = store.add(written_parts(parts)).id
    for layer, first in (("AO", 0), ("beauty", 3), (None, 3)):
        shown = packed(sphere(), assets=store, environment={"type": "image", "asset": asset, **named(layer)})
        assert shown.arrays.environment is not None
        assert np.array_equal(shown.arrays.environment.texels, TEXELS[..., first : first + 3])


def refusal(store: AssetStore, **document: Any) -> tuple[str, str]:
    with pytest.raises(InvalidDocument) as refused:
        packed(sphere(), assets=store, **document)
    (error,) = refused.value.errors
    return error.pointer, error.detail


def test_a_name_that_is_not_there_is_refused_with_those_that_are(store: AssetStore, picture: str) -> None:
    pointer, detail = refusal(store, environment={"type": "image", "asset": picture, "layer": "V.Normal"})
    assert pointer == "/environment/layer"
    assert detail == "the EXR file: it has no layer 'V.Normal'; it has V.AO, V.Combined, V.Depth.Z"
    pointer, again = refusal(store, **textured(picture, **{"a/b": "V.Normal"}))
    assert pointer == "/textures/a~1b/layer" and again == detail
    plain = store.add(make.exr(TEXELS[..., :3])).id
    pointer, detail = refusal(store, environment={"type": "image", "asset": plain, "layer": "beauty"})
    assert pointer == "/environment/layer" and "has no layer 'beauty'" in detail


@pytest.mark.parametrize("data", [make.png(np.zeros((4, 4, 3), np.uint8)), make.hdr(TEXELS[..., :3])])
def test_other_formats_have_no_layers(store: AssetStore, data: bytes) -> None:
    asset = store.add(data).id
    pointer, detail = refusal(store, **textured(asset, t="beauty"))
    assert pointer == "/textures/t/layer" and "belongs to EXR files; other images have no layers" in detail


def test_layers_are_cached_apart(store: AssetStore, picture: str) -> None:
    keys = set()
    for layer in LAYERS:
        environment = {"type": "image", "asset": picture, **named(layer)}
        document = {"version": 1, "camera": {"position": [0, 0, 4], "target": [0, 0, 0]}, "shapes": []}
        scene = parse_scene({**document, "materials": {}, "environment": environment})
        assert scene.environment is not None
        keys.add(environment_key(scene.environment))
    assert len(keys) == len(LAYERS)
