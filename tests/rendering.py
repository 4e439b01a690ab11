"""Documents to pictures, in one call, for tests about light."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from gpu import Picture, Renderer, RenderSettings
from gpu.settings import ESTIMATORS
from service.document import parse_scene
from service.formats import ImageData
from service.pack import pack
from tests.families import EXACT


class Images:
    """Assets made of arrays, by name."""

    def __init__(self, **images: np.ndarray) -> None:
        self._images = images

    def image(self, ref: str, layer: str = "") -> ImageData:
        return ImageData(self._images[ref])

    def mesh(self, ref: str) -> Any:
        raise KeyError(ref)

    def measured(self, ref: str) -> Any:
        raise KeyError(ref)


def document(shapes: list[dict[str, Any]], materials: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    """A scene seen from +Z towards the origin, unless told otherwise."""
    return {
        "version": 1,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
        "materials": materials or {"m": {"type": "diffuse", "albedo": 0.5}},
        "shapes": shapes,
        **more,
    }


def picture(
    gpu: Renderer, scene: dict[str, Any], samples: int = 64, assets: Images | None = None, editing: bool = False,
    **settings: Any,
) -> Picture:  # fmt: skip
    """A picture of `scene` with that many samples; 32 x 32, box filter, one bounce unless told otherwise."""
    loaded = gpu.load(pack(parse_scene(scene), assets or Images()).arrays, editing)
    defaults = {"width": 32, "height": 32, "max_bounces": 1, "filter": "box"}
    out = gpu.picture(loaded, RenderSettings(**{**defaults, **settings}))
    out.trace(600.0, samples)
    _made.append(out)
    return out


_made: list[Picture] = []


def release_pictures() -> None:
    """What tests have left of `picture(...)`: each holds a kernel, 7 MB."""
    while _made:
        left = _made.pop()
        if not left.released and not isinstance(left.context.mglo, moderngl.InvalidObject):
            left.release()


def render(gpu: Renderer, scene: dict[str, Any], samples: int = 64, aov: str = "color", **more: Any) -> np.ndarray:
    """(h, w, c) float64 of `picture(...)`."""
    made = picture(gpu, scene, samples, **more)
    values = made.read(aov).astype(float)
    made.release()
    made.scene.release()
    return values


def assert_estimators_agree(gpu: Renderer, scene: dict[str, Any], max_bounces: int = 3, within: float = 0.01) -> None:
    """That estimators converge to the same picture of `scene`: in blocks of 4 x 4 pixels by their z-scores, and in
    the mean. `mis` draws as `bsdf` and `light` do, which `make long-test` tries alone."""
    images, errors = [], []
    for estimator in ESTIMATORS if EXACT else ("mis", "uniform"):
        made = picture(gpu, scene, 1024, estimator=estimator, max_bounces=max_bounces, sampler="independent")
        images.append(made.read()[..., :3].reshape(8, 4, 8, 4, 3).mean((1, 3)))
        errors.append(made.read("variance").reshape(8, 4, 8, 4, 3).mean((1, 3)) / 16)
        made.release()
        made.scene.release()
    for image, error in zip(images[1:], errors[1:], strict=True):
        z = (image - images[0]) / np.sqrt(error + errors[0] + 1e-12)
        assert np.sqrt((z**2).mean()) < 1.35
        assert np.abs((image - images[0]).mean()) < within * images[0].mean()
