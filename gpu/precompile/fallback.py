"""Kernels that serve while an edited scene's own is compiled: its superset kernel, and the least one that shows it.

The superset kernel has the numbers of the scene's shapes and materials compiled in, as the scene's own has, and the
flags on that a slider of the scene could raise, but for those of rare features. Its samples take 1.1 to 1.6 times as
long as those of the own one, and it compiles in 2 to 4 s (llvmpipe, the built-in scenes).
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from gpu.arrays import SceneArrays
from gpu.device.scene import Scene
from gpu.device.uploads import SharedUploads
from gpu.kernels import features
from gpu.kernels.flag import beside
from gpu.kernels.flag_table import FLAGS
from gpu.kernels.shape_kinds import quads_when_shining
from gpu.precompile import kernel_keys
from gpu.settings import RenderSettings


def superset(arrays: SceneArrays) -> frozenset[str]:
    """The flags of the scene's superset kernel: its own, and those that its sliders could raise."""
    raised = features.flags(arrays, True)
    return raised | {f.name for f in FLAGS.values() if beside(f.compiled_with, raised) or f.previewed(arrays)}


def least(arrays: SceneArrays) -> frozenset[str]:
    """The flags without which the scene cannot be shown: neither those of its sliders, nor those that spare work. On
    the shader ball LLVM takes 0.6 to 0.9 of the time of an edited scene's own kernel."""
    return features.needed(features.flags(arrays))


def defines(raised: frozenset[str], arrays: SceneArrays) -> dict[str, object]:
    """The defines of the superset kernel with these flags for a scene, which depend on no light. It does not pass all
    layers of a veil in one walk, which takes LLVM half again as long."""
    clamped = RenderSettings(1, 1, clamp=1.0)
    counts = features.counts(arrays) | {"LIGHT_COUNT": 0, "QUAD_LAMP": -1}
    return features.defines(raised, clamped, counts) | features.SOON


def settings_for(settings: RenderSettings) -> RenderSettings | None:
    """The settings with which it renders the same picture; None where it cannot."""
    known = settings.estimator == "mis" and settings.sampler == "sobol"
    return replace(settings, adaptive=False, caustics="paths", filter_glossy=0.0) if known else None


def kernel_key(arrays: SceneArrays, settings: RenderSettings, raised: frozenset[str]) -> kernel_keys.KernelKey | None:
    """The key of the superset kernel with these flags; None where that cannot show such a scene."""
    if settings_for(settings) is None or features.needed(features.flags(arrays)) - raised:
        return None
    bound = kernel_keys.kernel_key(arrays, settings, raised).textures
    return kernel_keys.KernelKey(tuple(defines(raised, arrays).items()), bound)


def superset_keys(
    arrays: SceneArrays, settings: RenderSettings, raised: frozenset[str]
) -> list[kernel_keys.KernelKey]:
    """The keys of the superset kernels with these flags that sliders of the scene may need: one for the scene, and
    one for each number of solids that may begin to shine together."""
    found = [kernel_key(arrays, settings, raised)]
    owners = arrays.boxes["material"]
    quads, goes = quads_when_shining(arrays.boxes)
    shining = {(int(quads[owners == each].sum()), int(goes[owners == each].sum())) for each in np.unique(owners)}
    for more, gone in sorted(shining):
        faces = np.concatenate([arrays.quads, np.zeros(more, arrays.quads.dtype)])
        found.append(kernel_key(replace(arrays, boxes=arrays.boxes[gone:], quads=faces), settings, raised))
    return [key for key in found if key is not None]


def can_become(old: SceneArrays, new: SceneArrays) -> bool:
    """True if the scene differs in its camera, its materials or its environment's turn at most, so that a
    `FallbackScene` of it can be edited."""
    edited = ("camera", "materials", "environment")
    same = all(getattr(old, f.name) is getattr(new, f.name) for f in fields(SceneArrays) if f.name not in edited)
    was, is_ = old.environment, new.environment
    lit = was is is_ or (was is not None and is_ is not None and is_.has_map_of(was))
    return same and lit and len(old.materials) == len(new.materials)


class FallbackScene(Scene):
    """A scene whose pictures are made with its superset kernel. Made by `Renderer.load_fallback`."""

    def __init__(self, context: Any, arrays: SceneArrays, shared: SharedUploads, raised: frozenset[str]) -> None:
        self._superset = raised
        super().__init__(context, arrays, False, shared)

    def _flags(self) -> frozenset[str]:
        return self._superset

    def defines(self, settings: RenderSettings) -> dict[str, object]:
        return defines(self._superset, self.arrays)
