"""Small scene documents, and assets from memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from service.document import parse_scene
from service.formats import ImageData, MeshData
from service.pack import Packed, pack
from service.problems import AssetError, InvalidDocument

CAMERA = {"position": [0, 1, 5], "target": [0, 0, 0]}
GREY = {"type": "diffuse", "albedo": 0.5}
LAMP = {"type": "diffuse", "albedo": 0, "emission": [4, 2, 1]}
MIRRORED = {"scale": [-1, 2, 1], "rotate": [20, 30, 40], "translate": [1, 2, 3]}
CUBE = {
    "vertices": [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)],
    "faces": [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ],
}  # fmt: skip


class Shelf:
    """Assets from memory, counting how often each is fetched."""

    def __init__(self, **known: MeshData | ImageData) -> None:
        self.known = {f"sha256:{name}": value for name, value in known.items()}
        self.fetched: list[str] = []

    def _fetch(self, ref: str, layer: str = "") -> MeshData | ImageData:
        self.fetched.append(ref)
        if ref not in self.known:
            raise AssetError("is not uploaded")
        return self.known[ref]

    mesh = image = _fetch


@dataclass
class Few:
    max_triangles: int = 1 << 24
    max_texels: int = 1 << 26


def cube_data():
    return MeshData(np.array(CUBE["vertices"], float), np.array(CUBE["faces"], np.int32), None)


def picture(pixels, is_8bit=False):
    """From numbers 0..1, or from radiance."""
    if is_8bit:
        return ImageData(np.rint(np.multiply(pixels, 255)).astype(np.uint8))
    return ImageData(np.asarray(pixels, np.float32))


def sphere(**fields):
    return {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "grey", **fields}


def quad(**fields):
    return {"type": "quad", "origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "material": "grey", **fields}


def box(**fields):
    return {"type": "box", "min": [-1, -2, -3], "max": [1, 2, 3], "material": "grey", **fields}


def mesh(**fields):
    return {
        "type": "mesh",
        "material": "grey",
        **({} if "asset" in fields or "vertices" in fields else CUBE),
        **fields,
    }


def document(*shapes, **fields):
    return {
        "version": 1, "camera": CAMERA, "materials": {"grey": GREY, "lamp": LAMP}, "shapes": list(shapes), **fields,
    }  # fmt: skip


def packed(*shapes, assets=None, cache=None, limits=None, environments=None, **fields) -> Packed:
    return pack(parse_scene(document(*shapes, **fields)), assets or Shelf(), cache, limits, environments)


def matrix_of(transform):
    return parse_scene(document(sphere(transform=transform))).shapes[0].transform.matrix4()


def refused(*shapes, **fields):
    with pytest.raises(InvalidDocument) as caught:
        packed(*shapes, **fields)
    return [error.pointer for error in caught.value.errors]
