"""The environment: texels, and the tables by which directions are drawn from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gpu.distribution import LUMINANCE, environment_tables, solid_angles
from service.assets import Assets, ImageData
from service.problems import AssetError, FieldError, InvalidDocument
from service.scene.environment import ConstantEnvironment, Environment
from service.scene.numbers import BRIGHTEST

LARGEST_SIDE = 16384  # texels; no driver promises larger textures


@dataclass(frozen=True)
class Sky:
    """All that does not depend on rotation, scale and background."""

    texels: np.ndarray  # (h, w, 3) float32
    probability: np.ndarray
    alias: np.ndarray
    irradiance: float  # luminance of radiance, integrated over all directions
    peak: float  # the greatest channel
    warnings: tuple[str, ...] = ()


def make_sky(environment: Environment, assets: Assets) -> Sky:
    """Raises InvalidDocument."""
    if isinstance(environment, ConstantEnvironment):
        return _sky(np.array(environment.radiance, np.float32).reshape(1, 1, 3), ())
    try:
        image = assets.image(environment.asset)
    except AssetError as error:
        raise _refused(error.detail) from None
    height, width = image.pixels.shape[:2]
    if max(height, width) > LARGEST_SIDE:
        raise _refused(f"is {width} x {height}; at most {LARGEST_SIDE} a side")
    return _sky(*_clamped(_linear(image)))


def _refused(detail: str) -> InvalidDocument:
    return InvalidDocument([FieldError("/environment/asset", detail)])


def _linear(image: ImageData) -> np.ndarray:
    """(h, w, 3) float32, without alpha; eight bits are sRGB, anything else is linear as it is."""
    pixels: np.ndarray = image.pixels[..., :3]
    if pixels.shape[2] == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    if not image.is_8bit:
        return pixels
    steep = ((pixels + np.float32(0.055)) / np.float32(1.055)) ** np.float32(2.4)
    return np.where(pixels <= 0.04045, pixels / np.float32(12.92), steep)


def _clamped(texels: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
    warnings = []
    for count, what in (
        (np.count_nonzero((texels < 0).any(axis=2)), "negative texels raised to 0"),
        (np.count_nonzero((texels > BRIGHTEST).any(axis=2)), f"texels beyond {BRIGHTEST:g} lowered to it"),
    ):
        if count:
            warnings.append(f"/environment/asset: {count} {what}")
    return np.clip(texels, 0, np.float32(BRIGHTEST)) if warnings else texels, tuple(warnings)


def _sky(texels: np.ndarray, warnings: tuple[str, ...]) -> Sky:
    texels = np.ascontiguousarray(texels, np.float32)
    probability, alias = environment_tables(texels)
    height, width = texels.shape[:2]
    rows = (texels @ LUMINANCE).sum(axis=1, dtype=np.float64)
    irradiance = float(rows @ solid_angles(height, width))
    return Sky(texels, probability, alias, irradiance, min(float(texels.max()), BRIGHTEST), warnings)
