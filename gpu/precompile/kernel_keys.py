"""Keys of the kernels that a scene needs: everything that the machine code depends on, but for the driver."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

import numpy as np

from gpu import layout
from gpu.arrays import HEAVY, SHAREABLE, SceneArrays
from gpu.bsdf import kernels as bsdf
from gpu.device import blank
from gpu.device.textures import KINDS, bound_textures, rows
from gpu.kernels import features
from gpu.kernels.binaries import ENTRIES, binary_file
from gpu.kernels.source import KernelSource
from gpu.layout import ShapeKind, bindings
from gpu.picture import accumulators, light_paths, noise_meter, readout, resolve
from gpu.picture.look import Look
from gpu.settings import TONE_MAPS, RenderSettings

# The kernels that depend on the scene; `common_keys` has the others.
ENTRY, GUIDES, COVER, LIGHT = "pathtrace.comp", "guides.comp", "cover.comp", "lighttrace.comp"


@dataclass(frozen=True)
class KernelKey:
    """Everything that the machine code of a picture's kernel depends on, except the driver.

    `textures` are (unit, channels, dtype, width, height): code for sides that are powers of two differs, their
    length does not matter, so that they are given as 1 or 3.
    """

    defines: tuple[tuple[str, object], ...]
    textures: tuple[tuple[int, int, str, int, int], ...]
    entry: str = ENTRY

    @property
    def text(self) -> str:
        return KernelSource(self.entry, dict(self.defines)).text

    @property
    def is_ours(self) -> bool:
        """True if its code goes into our own cache, where the device is a GPU."""
        return self.entry in ENTRIES

    def is_cached(self, info: Mapping[str, Any]) -> bool:
        """True if its code is in there, for the driver that `info` (`Renderer.info`) names."""
        return self.is_ours and binary_file(info, self.text).exists()

    def digest(self, driver: str) -> str:
        return sha256(repr((driver, self.text, self.textures)).encode()).hexdigest()[:32]


def kernel_key(
    arrays: SceneArrays, settings: RenderSettings, raised: frozenset[str], entry: str = ENTRY
) -> KernelKey:
    """The key of the kernel `entry` for a picture of `arrays` where these flags are raised."""
    defines = features.defines(raised, settings, features.counts(arrays))
    return KernelKey(tuple(defines.items()), _textures(arrays, raised), entry)


def light_key(arrays: SceneArrays, settings: RenderSettings, raised: frozenset[str]) -> KernelKey | None:
    """The key of the kernel that traces such a picture's caustics from the lights; None where it has none."""
    if not features.traces_caustics(raised, settings):
        return None
    defines = light_paths.reversed_rays(features.defines(raised, settings, features.counts(arrays)))
    return KernelKey(tuple(defines.items()), _textures(arrays, raised), LIGHT)


def flags(arrays: SceneArrays, editing: bool = False) -> frozenset[str]:
    """The flags that a scene raises; `editing`: also those that its materials' sliders could raise."""
    return features.flags(arrays, editing)


def camera_flags(arrays: SceneArrays) -> frozenset[str]:
    """The flags that the camera alone raises: two cameras that raise the same share a scene's kernel."""
    return features.camera_flags(arrays)


def flags_after_edit(raised: frozenset[str], arrays: SceneArrays, editing: bool) -> frozenset[str]:
    """The flags of a scene after an edit, where these were raised before: while it is edited none is lowered."""
    return features.grown(raised, arrays) if editing else features.flags(arrays)


def key_after_move(arrays: SceneArrays, settings: RenderSettings) -> KernelKey | None:
    """The key that a stream will need when it first moves a large mesh of this scene; None where the scene has none,
    or has instances already. It is a guess where there are small meshes too, some of which may stand in the loop.
    """
    if len(arrays.instances):
        return None
    owners = arrays.triangles["shape"] & np.uint32(~layout.SHAPE_BITS & layout.NONE)
    counts, lamps = np.bincount(owners), np.bincount(owners, arrays.triangles["light"] != layout.NONE)
    if not ((counts >= HEAVY) & (lamps == 0)).any():
        return None
    small = ((counts > 0) & ((counts < SHAREABLE) | (lamps > 0))).any()
    kinds = arrays.bvh_kinds | {ShapeKind.TRIANGLE, ShapeKind.INSTANCE}
    large = {**arrays.large, ShapeKind.TRIANGLE: arrays.large.get(ShapeKind.TRIANGLE, 0) if small else 0}
    one = np.zeros(1, layout.Instance.dtype)
    apart = replace(arrays, instances=one, bvh_kinds=kinds, large=large)
    return kernel_key(apart, settings, features.flags(apart, True))


def keys_after_edit(arrays: SceneArrays, settings: RenderSettings) -> list[KernelKey]:
    """The keys that a stream will need when it first moves a slider whose code is compiled ahead. They are a guess
    for meshes, of which only those with the anisotropic material get tangents."""
    return [kernel_key(arrays, settings, raised) for raised in features.touched(features.flags(arrays, True))]


def common_keys() -> list[KernelKey]:
    """The keys of the kernels of any scene: those of the noise meter, of blocks and of `adaptive`, those that show a
    picture, and the one that reads nothing."""
    shown = [
        ("resolve.comp", resolve.defines(Look(tone_map=curve), dtype, caustics))
        for dtype, caustics in (("u1", False), ("f4", False), ("u1", True))
        for curve in TONE_MAPS
    ]
    metered = [("meter.comp", noise_meter.defines(*which)) for which in ((1, 0), (0, 0), (0, 1))]
    summed = [("merge.comp", accumulators.defines()), ("areas.comp", features.defines(frozenset()))]
    summed += [("mean.comp", readout.mean_defines(caustics)) for caustics in (False, True)]
    entries = [*metered, *summed, *shown, (blank.ENTRY, blank.DEFINES)]  # a stream's first frames need those first
    return [KernelKey(tuple(defines.items()), (), entry) for entry, defines in entries]


def bsdf_key(material: SceneArrays, question: str) -> KernelKey:
    """The key of the kernel by which a `BsdfEvaluator` answers the question, one of `gpu.bsdf.kernels.ENTRIES`, for a
    scene of one material."""
    bare = bsdf.bare(material)
    return _bsdf_key(bare, features.evaluating(bare), question)


def _bsdf_key(bare: SceneArrays, raised: frozenset[str], question: str) -> KernelKey:
    entry = bsdf.ENTRIES[question]
    return KernelKey(tuple(bsdf.defines(bare, raised, entry).items()), _textures(bare, raised), entry)


def bsdf_keys() -> Iterator[KernelKey]:
    """The keys of all kernels that a `BsdfEvaluator` needs for any material, each once."""
    found = set[KernelKey]()
    for question in bsdf.ENTRIES:
        for bare, raised in bsdf.samples():
            key = _bsdf_key(bare, raised, question)
            if key not in found:
                found.add(key)
                yield key


def _textures(a: SceneArrays, raised: frozenset[str]) -> tuple[tuple[int, int, str, int, int], ...]:
    height, width = (1, 1) if a.environment is None else a.environment.texels.shape[:2]
    out = [(bindings.ENVIRONMENT_TEXTURE, 4, "f4", _side(width), _side(height))]
    for unit, values in bound_textures(a, raised).items():
        channels, dtype = KINDS[unit]
        height = _side(rows(values.nbytes, channels, dtype))
        out.append((unit, channels, dtype, _side(bindings.TEXELS_A_ROW), height))
    return tuple(out)


def _side(length: int) -> int:
    return 1 if length & (length - 1) == 0 else 3
