"""A USD file as a scene: what `make test` tries; `test_usd_scene`, `_materials` and `_materialx` try more."""

from __future__ import annotations

import numpy as np
import pytest

from service.document import parse_scene
from service.server.assets import AssetStore
from tests.usd_files import mesh, usda


@pytest.mark.usd
def test_units_and_axes_become_metres_with_y_up(store: AssetStore) -> None:
    place = 'double3 xformOp:translate = (100, 200, 300)\nuniform token[] xformOpOrder = ["xformOp:translate"]'
    info = store.add(usda(mesh("Sign", place), 'upAxis = "Z"'))  # without metersPerUnit: centimetres
    assert info.kind == "scene" and info.format == "usd"
    found = store.scene(info.id)
    parse_scene(found.scene({"type": "constant", "radiance": 1}))
    (sign,) = found.document["shapes"]
    matrix = np.array(sign["transform"]["matrix"]).reshape(4, 4)
    for point, placed in (((0, 0, 0), [1, 3, -2]), ((0, 0, 100), [1, 4, -2])):
        assert (matrix @ [*point, 1])[:3].round(6).tolist() == placed
    assert sign["name"] == "Sign" and sign["smooth"] is False  # polygons without normals are flat
