"""An OBJ whose faces index positions, coordinates and normals each in its own way, from the upload to the picture."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from tests import asset_files as make
from tests.serving import Server

# Tiles of 1 x 1 side by side; `vt` and `vn` stand in other orders than `v`, and come between the faces.
OBJ = b"""# tiles
mtllib none.mtl
o first
g left
usemtl red
vt 1 1
vt 0 1
vt 0 0
vt 1 0
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vn 0 0 1
vn .6 0 .8
vn 0 .6 .8
f 1/3/1 2/4/1 3/1/1 4/2/1
s off
v 2 0 0
v 2 1 0
# a quad counting back, its coordinates a quarter of a turn further
f -5/-3/-2 -2/-2/-2 -1/-1/-2 -4/-4/-2
g middle
s 1
v 3 0 0
v 3 1 0
v 2.5 .5 0
vt .5 .5
# a concave pentagon, and the triangle that it leaves
f 5/3/3 7/4/3 9/5/3 8/1/3 6/2/3
f 7/4/3 8/1/3 9/5/3
g right
v 4 0 0
v 4 1 0
# without coordinates, then without normals too
f 7//2 10//2 11//2 8//2
v 5 0 0
v 5 1 0
f 10/3 12/4 13/1 11/2
"""


def test_an_obj_of_all_kinds_of_faces(server: Server) -> None:
    http = server.http
    y, x = np.mgrid[0:64, 0:64]
    ramp = np.stack([(x + 0.5) / 64, 1 - (y + 0.5) / 64, 0 * x], -1).astype(np.float32)
    texture = http.post("/v1/assets", content=make.exr(ramp)).json()["id"]
    answer = http.post("/v1/assets?filename=tiles.obj", content=OBJ)
    assert answer.status_code == 201, answer.text
    mesh = answer.json()
    assert mesh["triangles"] == 12
    assert "4 corners have no texture coordinate" in mesh["warnings"][0]["detail"]
    scene = {
        "version": 1,
        "camera": {"position": [2.5, 0.5, 5 / np.sqrt(3)], "target": [2.5, 0.5, 0], "vfov": 60},
        "textures": {"ramp": {"asset": texture}},
        "materials": {"m": {"type": "diffuse", "albedo": 0, "emission": {"texture": "ramp"}}},
        "shapes": [{"type": "mesh", "asset": mesh["id"], "material": "m"}],
    }
    settings = {"width": 100, "height": 60, "max_samples": 4, "filter": "box"}

    def shot(aov: str) -> Any:
        answer = http.post(f"/v1/render?format=npy&aov={aov}", json={"scene": scene, "settings": settings})
        assert answer.status_code == 200, answer.text
        return np.load(io.BytesIO(answer.content))

    color, normal = shot("color"), shot("normal")
    scale = 60 / (10 / 3)  # pixels a metre: at that distance the picture is 10/3 m high

    def at(picture: Any, x: float, y: float) -> Any:
        return picture[round(30 - (y - 0.5) * scale - 0.5), round(50 + (x - 2.5) * scale - 0.5)]

    for tile, uv, n in (
        (0, lambda a, b: (a, b), (0, 0, 1)),
        (1, lambda a, b: (b, 1 - a), (0.6, 0, 0.8)),
        (2, lambda a, b: (a, b), (0, 0.6, 0.8)),
        (3, lambda a, b: (0, 0), (0.6, 0, 0.8)),
        (4, lambda a, b: (a, b), (0, 0, 1)),
    ):
        for a, b in ((0.25, 0.7), (0.6, 0.3), (0.8, 0.55)):
            u, v = uv(a, b)
            if tile != 3:  # repeats: the corner is a mean of all four
                np.testing.assert_allclose(at(color, tile + a, b)[:2], [u, v], atol=0.04, err_msg=f"{tile} {a} {b}")
            np.testing.assert_allclose(at(normal, tile + a, b), n, atol=2e-3)
