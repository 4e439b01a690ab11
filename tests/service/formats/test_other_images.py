"""Images in formats of other programs: whatever names them shows them."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from service.problems import AssetError
from service.server.assets import AssetStore
from tests.mtlx_files import graph, mtlx, node, surface, value
from tests.obj_files import TEXTURED, zipped
from tests.usd_files import QUAD, material, mesh, texture, usda
from tests.usd_looks import UV

PIXELS = np.array([[(200, 40, 40), (90, 90, 90)]], np.uint8)
NAME = "oak_color.tga"
MATERIALX = mtlx(
    graph(node("image", "i", "color3", value("file", NAME, "filename", colorspace="srgb_texture")), out="i color3"),
    surface("gltf_pbr", '<input name="base_color" type="color3" nodegraph="NG" output="out"/>'),
)
BOUND = material("M", "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>", texture("M", NAME))
USD = usda(BOUND + mesh("S", UV + "rel material:binding = </M>", body=QUAD))
DOORS: dict[str, dict[str, bytes | str]] = {
    "obj": {"a.obj": TEXTURED, "m.mtl": f"newmtl m\nmap_Kd {NAME}\n"},
    "materialx": {"a.mtlx": MATERIALX},
    "usd": {"a.usda": USD},
    "set": {"oak_roughness.png": b""},
}


def image(format: str, pixels: np.ndarray = PIXELS) -> bytes:
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, format)
    return out.getvalue()


@pytest.mark.parametrize("format", ["TGA", "BMP", "TIFF"])
@pytest.mark.parametrize("door", [pytest.param("usd", marks=[pytest.mark.usd]), "obj", "materialx", "set"])
def test_a_texture_is_shown(store: AssetStore, door: str, format: str) -> None:
    """Grey ones stay grey: what they mean may depend on it."""
    if door == "materialx":
        pytest.importorskip("MaterialX")
    for pixels in (PIXELS, PIXELS[..., 1]):
        files = DOORS[door] | {NAME: image(format, pixels)}
        if door == "set":
            files["oak_roughness.png"] = image("PNG")
        id = store.add(zipped(files)).id
        textures = (store.materials(id) if door in ("set", "materialx") else store.scene(id)).document["textures"]
        data = next(store.read(each["asset"]) for name, each in textures.items() if "roughness" not in name)
        assert np.array_equal(np.asarray(Image.open(io.BytesIO(data))), pixels)


def test_what_is_no_image_is_named(store: AssetStore) -> None:
    info = store.add(zipped({"oak_color.png": image("PNG"), "oak_normal.tif": b"II*\0 broken"}))
    assert [warning["pointer"] for warning in info.warnings or ()] == ["oak_normal.tif"]
    with pytest.raises(AssetError, match=r"IMG_1\.heic is an image in a format that is not read"):
        store.add(zipped({"IMG_1.heic": b"ftypheic"}))
    with pytest.raises(AssetError, match=r"IMG_1\.tga; no model .*, and no images whose names say what they are"):
        store.add(zipped({"IMG_1.tga": image("TGA")}))
