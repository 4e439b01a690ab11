"""Images in MaterialX graphs, at any coordinates."""

from __future__ import annotations

import numpy as np
import pytest

from service.formats import ImageData
from service.formats.read.materialx.evaluation import sampled
from service.formats.surface.trees import Tree
from service.server.assets import AssetStore
from tests.asset_files import png
from tests.exr_files import written
from tests.mtlx_files import from_graph, graph, material, mtlx, node, surface, taken, value, wire

PIXELS = np.random.default_rng(5).integers(0, 256, (2, 2, 3), np.uint8)


def test_colours_are_decoded_before_they_are_mixed() -> None:
    """In the middle of four texels, that is their mean; one beside the border is half that of the other side."""
    own = PIXELS / 255
    linear = np.where(own <= 0.04045, own / 12.92, ((own + 0.055) / 1.055) ** 2.4)
    places = np.array([[0.5, 0.5], [0.25, 0.75], [0.0, 0.75]], np.float32)
    for space, texels in (("srgb", linear), ("linear", own)):
        found = sampled(ImageData(PIXELS), places, Tree("image", 3, texts={"space": space}))
        expected = [texels.mean((0, 1)), texels[0, 0], texels[0].mean(0)]
        assert np.allclose(found[:, :3], expected, atol=1e-5), space


LAYERS = written(
    np.tile(np.array([0.25, 0.5, 0.75], np.float32).repeat(3)[:6], (4, 4, 1)),
    [f"{layer}.{channel}" for layer in ("AO", "beauty") for channel in "RGB"],
)


def shown(layer: str, *more: str, file: str = "a.exr", out: str = "img") -> bytes:
    image = node("image", "img", "color3", value("file", file, "filename"), value("layer", layer, "string"))
    return mtlx(graph(image, *more, out=f"{out} color3"), surface("gltf_pbr", from_graph("base_color", "out")))


def test_a_layer_of_an_exr_is_the_texture_s(store: AssetStore) -> None:
    found = taken(store, {"a.mtlx": shown("AO"), "a.exr": LAYERS})
    (texture,) = found.document["textures"].values()
    assert texture["layer"] == "AO" and not found.warnings


def test_a_computed_image_reads_the_layer(store: AssetStore) -> None:
    doubled = node("power", "p", "color3", wire("in1", "img"), value("in2", 0.5, "float"))
    means = []
    for layer in ("AO", "beauty"):
        found = taken(store, {"a.mtlx": shown(layer, doubled, out="p"), "a.exr": LAYERS})
        (texture,) = found.document["textures"].values()
        means.append(store.image(texture["asset"]).pixels[0, 0, 0])
        assert "layer" not in texture and material(found)["base_color"]
    assert means[0] < means[1]


@pytest.mark.parametrize(
    ("file", "data", "why"),
    [("a.exr", LAYERS, "it has no layer 'Z'; it has AO, beauty"), ("a.png", png(PIXELS), "belongs to EXR files")],
)
def test_a_layer_that_is_not_there_is_told(store: AssetStore, file: str, data: bytes, why: str) -> None:
    found = taken(store, {"a.mtlx": shown("Z", file=file), file: data})
    (texture,) = found.document["textures"].values()
    (warning,) = found.warnings
    assert "layer" not in texture and warning["pointer"] == "NG/img/layer" and why in warning["detail"]
