"""A material is saved with all that it shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from service.server.assets import AssetStore
from service.server.storage.documents import Documents, checked
from tests.asset_files import png
from tests.calls import is_problem
from tests.serving import Server

IMAGE = png(np.full((2, 2, 3), 200, np.uint8))


def test_a_material_is_saved_with_its_textures(server: Server) -> None:
    http, address = server.http, "/v1/documents/materials/tiles"
    image = http.post("/v1/assets", content=IMAGE).json()["id"]
    tiles = {"type": "principled", "base_color": {"texture": "tiles", "factor": 0.5}, "normal_map": {"texture": "n"}}
    whole = {
        "materials": {"tiles": tiles},
        "textures": {"tiles": {"asset": image, "scale": [2, 2]}, "n": {"type": "checker", "a": 0.2, "b": 0.8}},
    }
    assert http.put(address, json=whole).status_code == 201
    assert http.get(address).json() == whole

    def refused(pointer: str, **changes: Any) -> bool:
        return is_problem(http.put(address, json={**whole, **changes}), 422, pointer)

    missing = "sha256:" + "0" * 64
    assert refused("/textures/n/asset", textures={**whole["textures"], "n": {"asset": missing}})
    assert refused("/textures/n/wrap", textures={**whole["textures"], "n": {"asset": image, "wrap": "fold"}})
    assert refused("/materials/tiles/normal_map/texture", textures={"tiles": whole["textures"]["tiles"]})
    assert refused("/materials/tiles/ior", materials={"tiles": {**tiles, "ior": 9}})
    for materials in ({}, {"a": tiles, "b": tiles}, [tiles], None):
        assert refused("/materials", materials=materials)
    assert refused("/textures", textures=7) and refused("/shapes", shapes=[])
    assert http.get(address).json() == whole, "what was refused changes nothing"
    # One of before, whose images stayed in the scene that it was made in.
    bare = {"type": "diffuse", "albedo": {"texture": "somewhere"}}
    assert http.put(address, json=bare).status_code == 200 and http.get(address).json() == bare
    http.delete(address)


def test_a_saved_material_s_images_stay(tmp_path: Path) -> None:
    store = AssetStore(tmp_path)
    saved = Documents(tmp_path, store)
    image = store.add(IMAGE).id
    whole = {
        "materials": {"tiles": {"type": "diffuse", "albedo": {"texture": "tiles"}}},
        "textures": {"tiles": {"asset": image}},
    }
    saved.put("materials", "tiles", checked("materials", whole))
    with saved.assets_in_use() as used:
        assert used == {image}
    saved.put("materials", "tiles", checked("materials", {"type": "diffuse", "albedo": 0.5}))
    with saved.assets_in_use() as used:
        assert used == set()
    store.close()
