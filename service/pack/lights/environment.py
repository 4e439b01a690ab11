"""The environment: texels, and the tables by which directions are drawn from them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass

import numpy as np

from gpu.tables.alias_table import LUMINANCE, cube_solid_angles, cube_tables, environment_tables, solid_angles
from gpu.tables.sky import SunDisk, bake, sun_disk
from service.document.color import LINEAR_OF_BYTE
from service.document.environment import (
    ConstantEnvironment,
    CubeFaces,
    CubemapEnvironment,
    Environment,
    ImageEnvironment,
    SkyEnvironment,
)
from service.document.numbers import BRIGHTEST
from service.formats import Assets, ImageData, at_fault
from service.pack.cache import lasting
from service.pack.lights.environment_blur import blur_cube, blur_image
from service.problems import AssetError, FieldError, InvalidDocument
from service.system.memory import takes
from service.system.shared_memory import SharedArena

LARGEST_SIDE = 16384  # texels; no driver promises larger textures
LARGEST_FACE = LARGEST_SIDE // 3  # they share one texture, three across
# While the tables of an environment are made; 38 were measured for floats, 51 for eight bits, and a blur is as much.
BYTES_PER_TEXEL = 52
SUN_SHARE = (0.1, 0.9)  # bounds on the sun's share of the samples: mirrors show the dome, stone is lit by the sun


@dataclass(frozen=True)
class PackedEnvironment:
    """The part of an environment that does not depend on rotation, scale and background."""

    texels: np.ndarray  # (h, w, 3) float32
    probability: np.ndarray
    cells: np.ndarray
    irradiance: float  # luminance of radiance, integrated over all directions
    peak: float  # the greatest channel
    warnings: tuple[str, ...] = ()
    cube: bool = False
    sun: SunDisk | None = None
    sun_share: float = 0.0


def environment_key(environment: Environment) -> Hashable:
    """A key that is equal where `pack_environment` gives equal results; None where a cache gains nothing or a file
    may change."""
    if isinstance(environment, ImageEnvironment):
        shown = environment.asset, environment.layer, environment.blur
        return ("image", *shown) if lasting(environment.asset) else None
    if isinstance(environment, CubemapEnvironment):
        faces = tuple(environment.assets.model_dump().values())
        return ("cubemap", faces, environment.blur) if all(map(lasting, faces)) else None
    if isinstance(environment, SkyEnvironment):
        e = environment
        return "sky", e.sun_elevation, e.turbidity, e.ground_albedo, e.sun
    return None


def pack_environment(environment: Environment, assets: Assets) -> PackedEnvironment:
    """The texels and tables of an environment. Raises InvalidDocument."""
    if isinstance(environment, ConstantEnvironment):
        return _packed(np.array(environment.radiance, np.float32).reshape(1, 1, 3), ())
    if isinstance(environment, CubemapEnvironment):
        return _cube(environment.assets, assets, environment.blur)
    if isinstance(environment, SkyEnvironment):
        return _clear(environment)
    image = _image(environment.asset, assets, "/environment/asset", environment.layer)
    height, width = image.pixels.shape[:2]
    if max(height, width) > LARGEST_SIDE:
        raise _refused("/environment/asset", f"is {width} x {height}; at most {LARGEST_SIDE} a side")
    takes("environment", BYTES_PER_TEXEL * width * height)
    texels, warnings = _clamped(image, "/environment/asset")
    return _packed(blur_image(texels, environment.blur) if environment.blur else texels, warnings)


def check_images(environment: Environment, assets: Assets) -> None:
    """Raise InvalidDocument where an image of the environment cannot be read."""
    if isinstance(environment, ImageEnvironment):
        _image(environment.asset, assets, "/environment/asset", environment.layer)
    elif isinstance(environment, CubemapEnvironment):
        _faces(environment.assets, assets)


def _image(reference: str, assets: Assets, pointer: str, layer: str | None = None) -> ImageData:
    try:
        return assets.image(reference, layer or "")
    except AssetError as error:
        raise _refused(at_fault(error.place, pointer), error.detail) from None


def _refused(pointer: str, detail: str) -> InvalidDocument:
    return InvalidDocument([FieldError(pointer, detail)])


def _faces(faces: CubeFaces, assets: Assets) -> dict[str, ImageData]:
    return {name: _image(getattr(faces, name), assets, _pointer(name)) for name in CubeFaces.model_fields}


def _pointer(face: str) -> str:
    return f"/environment/assets/{face}"


def _cube(faces: CubeFaces, assets: Assets, blur: float) -> PackedEnvironment:
    images = _faces(faces, assets)
    sizes = {name: image.pixels.shape[:2] for name, image in images.items()}
    wanted = Counter(height for height, _ in sizes.values()).most_common(1)[0][0]
    errors = []
    for name, (height, width) in sizes.items():
        if height != width:
            errors.append(FieldError(_pointer(name), f"is {width} x {height}: the face of a cube is square"))
        elif height > LARGEST_FACE:
            errors.append(FieldError(_pointer(name), f"is {width} x {height}; at most {LARGEST_FACE} a side"))
        elif height != wanted:
            errors.append(FieldError(_pointer(name), f"is {width} x {height}, others are {wanted} x {wanted}"))
    if errors:
        raise InvalidDocument(errors)
    takes("environment", BYTES_PER_TEXEL * len(images) * wanted**2)
    parts, warnings = zip(*(_clamped(image, _pointer(name)) for name, image in images.items()), strict=True)
    if blur:
        return _packed(blur_cube(list(parts), blur), sum(warnings, ()))
    texels = np.vstack([np.hstack(parts[:3]), np.hstack(parts[3:])]).astype(np.float32)
    texels, probability, cells = _in_one_block(texels, *cube_tables(texels))
    solid = np.tile(cube_solid_angles(wanted), (2, 3))
    irradiance = float(((texels @ LUMINANCE) * solid).sum())
    peak = min(float(texels.max()), BRIGHTEST)
    return PackedEnvironment(texels, probability, cells, irradiance, peak, sum(warnings, ()), cube=True)


def _clear(environment: SkyEnvironment) -> PackedEnvironment:
    elevation = math.radians(environment.sun_elevation)
    texels = bake(elevation, environment.turbidity, environment.ground_albedo, environment.sun)
    dome = _packed(texels, ())
    if not environment.sun:
        return dome
    sun = sun_disk(elevation, environment.turbidity)
    strength = float(sun.irradiance @ LUMINANCE)
    if not strength > 0:  # the air absorbs all of it
        return dome
    low, high = SUN_SHARE
    total = dome.irradiance + strength
    share = min(max(strength / total, low), high)
    peak = dome.peak + max(sun.radiance)
    return PackedEnvironment(dome.texels, dome.probability, dome.cells, total, peak, sun=sun, sun_share=share)


def _linear(image: ImageData) -> np.ndarray:
    """(h, w, 3) float32, without alpha; eight bits are sRGB, anything else is linear as it is."""
    pixels: np.ndarray = image.pixels[..., :3]
    if pixels.shape[2] == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    return np.asarray(LINEAR_OF_BYTE, np.float32)[pixels] if image.is_8bit else pixels


def _clamped(image: ImageData, pointer: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """The radiance clamped to its range, and warnings about that and about the image."""
    texels, warnings = _linear(image), list[str]()
    for count, what in (
        (np.count_nonzero((texels < 0).any(axis=2)), "negative texels raised to 0"),
        (np.count_nonzero((texels > BRIGHTEST).any(axis=2)), f"texels beyond {BRIGHTEST:g} lowered to it"),
    ):
        if count:
            warnings.append(f"{pointer}: {count} {what}")
    texels = np.clip(texels, 0, np.float32(BRIGHTEST)) if warnings else texels
    return texels, (*warnings, *(f"{pointer}: {warning}" for warning in image.warnings))


def _packed(texels: np.ndarray, warnings: tuple[str, ...]) -> PackedEnvironment:
    texels = np.ascontiguousarray(texels, np.float32)
    texels, probability, cells = _in_one_block(texels, *environment_tables(texels))
    height, width = texels.shape[:2]
    rows = (texels @ LUMINANCE).sum(axis=1, dtype=np.float64)
    irradiance = float(rows @ solid_angles(height, width))
    return PackedEnvironment(texels, probability, cells, irradiance, min(float(texels.max()), BRIGHTEST), warnings)


def _in_one_block(*arrays: np.ndarray) -> tuple[np.ndarray, ...]:
    """The same arrays where the renderer can map them: each scene that is sent to it has the environment again."""
    arena = SharedArena(*(array.nbytes for array in arrays))
    return tuple(map(arena.put, arrays))
