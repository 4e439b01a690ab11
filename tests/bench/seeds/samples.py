"""One sphere: in the light of a point, and of a cubemap with 1 to 4 096 samples of the hemisphere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.bench.scenes import BenchAssets
from service.document import parse_scene, presets
from service.formats import ImageData, MeasuredData, MeshData
from service.pack import CUBE_FACES, pack
from tests.bench.seeds.stage import Document, Stage, rmse, sheet, shown

SIZE, ERROR_SIZE = 800, 128
COUNTS = tuple(4**k for k in range(7))  # 1, 4, ... 4 096
WAYS: dict[str, dict[str, str]] = {"uniform": {"estimator": "uniform", "sampler": "independent"}, "Sunbox": {}}
FACE = 128  # texels of a side
MATERIALS: dict[str, Document] = {
    "diffuse": {"type": "diffuse", "albedo": 0.8},
    "metal": {"type": "disney", "base_color": [1, 0.8, 0.4], "metallic": 1, "roughness": 0.3},
}


class CubeAssets:
    """The clear sky of the presets as six faces, by the name of each."""

    def __init__(self) -> None:
        self._pixels = BenchAssets().image(presets.get("environments", "clear-sky")["asset"]).pixels

    def mesh(self, ref: str) -> MeshData:
        raise KeyError(ref)  # the scene has none

    def measured(self, ref: str) -> MeasuredData:
        raise KeyError(ref)

    def image(self, ref: str, layer: str = "") -> ImageData:
        ahead, right, down = CUBE_FACES[ref]
        s = (2 * np.arange(FACE) + 1) / FACE - 1
        d = np.array(ahead) + np.multiply.outer(s, down)[:, None] + np.multiply.outer(s, right)
        d /= np.linalg.norm(d, axis=2, keepdims=True)
        height, width = self._pixels.shape[:2]
        column = (0.5 + np.arctan2(d[..., 0], -d[..., 2]) / (2 * math.pi)) * width
        row = np.arccos(np.clip(d[..., 1], -1, 1)) / math.pi * height
        nearest = np.minimum(row.astype(int), height - 1), np.minimum(column.astype(int), width - 1)
        return ImageData(np.asarray(self._pixels[nearest][..., :3], np.float32))


def sphere(material: Document, **light: Any) -> Document:
    return {
        "version": 1,
        "camera": {"position": [0, 0, 3.4], "target": [0, 0, 0], "vfov": 40},
        "materials": {"ball": material},
        "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "ball"}],
        **light,
    }


CUBE = {"environment": {"type": "cubemap", "assets": {name: name for name in CUBE_FACES}, "rotation": 150}}
POINT = {"lights": [{"type": "point", "position": [2.5, 3, 3], "intensity": 60}]}


def measure(stage: Stage) -> dict[str, Any]:
    """The times and errors of one sphere.

    `point_ms` is the time of a sample of every pixel at 800 x 800 in the light of a point; `cubemap` has, for each
    way, the milliseconds of 1, 4, 16 ... samples there. `errors` has, for each material and way, the root mean square
    error over the mean, by the number of samples.
    """
    assets, side = CubeAssets(), stage.either(SIZE, 32)
    counts = stage.either(COUNTS, COUNTS[:3])
    stage.told("a point light")
    point = stage.packed(sphere(MATERIALS["metal"], **POINT))
    taken = stage.rates({"point": stage.picture(point, side, side, max_bounces=1)})
    cube = pack(parse_scene(sphere(MATERIALS["metal"], **CUBE)), assets).arrays
    cubemap = []
    for way, settings in WAYS.items():
        stage.told(f"a cubemap, {way}")
        picture = stage.picture(cube, side, side, max_bounces=1, **settings)
        seconds = stage.seconds(picture, _counts(way, counts))
        cubemap.append({"way": way, "samples": _counts(way, counts), "ms": [1e3 * s for s in seconds]})
    seen = [[shown(stage.image(point, 200, 200, 1, max_bounces=1)) for _ in range(1)]]
    errors = []
    small = stage.either(ERROR_SIZE, 24)
    rows = []
    for name, material in MATERIALS.items():
        cube = pack(parse_scene(sphere(material, **CUBE)), assets).arrays
        stage.told(f"{name}: what errors are taken from")
        truth = stage.image(cube, small, small, counts[-1], max_bounces=1, filter="box", seed=1000)
        for way, settings in WAYS.items():
            stage.told(f"{name}, {way}")
            picture = stage.picture(cube, small, small, max_bounces=1, filter="box", **settings)
            row, found = [], []
            for count in _counts(way, counts):
                picture.trace(math.inf, count)
                pixels = picture.read()[..., :3].astype(np.float64)
                found.append(rmse(pixels, truth) / float(truth.mean()))
                row.append(shown(pixels))
            picture.release()
            errors.append({"material": name, "way": way, "samples": _counts(way, counts), "error": found})
            rows.append(row)
    stage.pictures["point"] = seen[0][0]
    stage.pictures["samples"] = sheet(rows)
    return {
        "size": side,
        "point_ms": 1e3 * taken["point"],
        "cubemap": cubemap,
        "errors": errors,
    }


def _counts(way: str, counts: tuple[int, ...]) -> list[int]:
    """The numbers of samples of a way: Sunbox's needs fewer."""
    return list(counts if way == "uniform" else counts[:-1])
