"""Functions that the experiments share: scenes to pictures, time in interleaved rounds, pictures to sheets."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from gpu import Picture, Renderer, RenderSettings, SceneArrays
from service.bench import timing
from service.bench.scenes import BenchAssets
from service.colorimetry import encode_srgb
from service.document import parse_scene
from service.formats import Assets
from service.pack import pack

Document = dict[str, Any]
Key = TypeVar("Key", bound=Hashable)
GAP = 4  # pixels between the pictures of a sheet


@dataclass
class Stage:
    """A renderer, a function that reports progress, and the pictures of the page: (h, w, 3) bytes by name."""

    renderer: Renderer
    quick: bool
    told: Callable[[str], None]
    assets: Assets = field(default_factory=BenchAssets)
    pictures: dict[str, np.ndarray] = field(default_factory=dict)

    def either(self, full: Any, quick: Any) -> Any:
        return quick if self.quick else full

    def clock(self) -> float:
        return timing.clock(bool(self.renderer.info["software"]))

    def packed(self, scene: Document) -> SceneArrays:
        return pack(parse_scene(scene), self.assets).arrays

    def picture(self, arrays: SceneArrays, width: int, height: int, **settings: Any) -> Picture:
        return self.renderer.picture(self.renderer.load(arrays), RenderSettings(width, height, **settings))

    def image(
        self, scene: Document | SceneArrays, width: int, height: int, samples: int, **settings: Any
    ) -> np.ndarray:
        """(height, width, 3) radiance, float64."""
        arrays = scene if isinstance(scene, SceneArrays) else self.packed(scene)
        picture = self.picture(arrays, width, height, **settings)
        picture.trace(math.inf, samples)
        pixels = picture.read()[..., :3].astype(np.float64)
        picture.release()
        return pixels

    def rates(self, pictures: Mapping[Key, Picture], rounds: int = 5, turn_s: float = 0.25) -> dict[Key, float]:
        """Seconds for a sample of every pixel: the medians of rounds in each of which every picture has a turn."""
        counts, seconds = dict[Key, int](), {key: list[float]() for key in pictures}
        for key, picture in pictures.items():
            once = self._seconds(picture, 1)  # the tiles find their size
            counts[key] = max(1, min(64, round(turn_s / max(once, 1e-6))))
        for _ in range(self.either(rounds, 1)):
            for key, picture in pictures.items():
                seconds[key].append(self._seconds(picture, self.either(counts[key], 1)))
        for picture in pictures.values():
            picture.release()
        return {key: statistics.median(values) for key, values in seconds.items()}

    def seconds(self, picture: Picture, counts: Sequence[int]) -> list[float]:
        """Seconds for each of these ascending numbers of samples of every pixel, in one run. Releases the picture."""
        self._seconds(picture, 1)  # the tiles find their size
        picture.reset()
        began, taken = self.clock(), []
        for count in counts:
            picture.trace(math.inf, count)
            taken.append(self.clock() - began)
        picture.release()
        return taken

    def _seconds(self, picture: Picture, samples: int) -> float:
        picture.reset()
        began = self.clock()
        picture.trace(math.inf, samples)
        return (self.clock() - began) / samples


def shown(pixels: np.ndarray, exposure: float = 0.0) -> np.ndarray:
    """Radiance -> sRGB bytes, clipped [IEC 61966-2-1]."""
    encoded = encode_srgb(np.clip(pixels * 2.0**exposure, 0.0, 1.0))
    return np.asarray(np.rint(255 * encoded).astype(np.uint8))


def sheet(rows: Sequence[Sequence[np.ndarray]]) -> np.ndarray:
    """A sheet of pictures of one size (h, w, 3) in rows, on white."""
    height, width = rows[0][0].shape[:2]
    columns = max(map(len, rows))
    size = len(rows) * (height + GAP) - GAP, columns * (width + GAP) - GAP, 3
    out = np.full(size, 255, np.uint8)
    for i, row in enumerate(rows):
        for j, picture in enumerate(row):
            y, x = i * (height + GAP), j * (width + GAP)
            out[y : y + height, x : x + width] = picture
    return out


def rmse(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.sqrt(np.mean((a - b) ** 2)))
