"""One kernel for many scenes. It is several times slower than a scene's own, but serves while that is compiled.

It has every flag on but those of features that it does not support, and reads the numbers of shapes from the frame.
So its machine code depends on no scene, only on whether the sides of the environment's map are powers of two.
"""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from gpu.arrays import SceneArrays
from gpu.device.scene import Scene
from gpu.device.textures import TextureCache
from gpu.kernels import features
from gpu.precompile import kernel_keys
from gpu.settings import RenderSettings

# Features that it does not support: textures are laid out anew for each scene; instances and the terms of
# `microfacet` are rare and would cost all other scenes time.
UNKNOWN = frozenset({
    "HAS_TEXTURES", "HAS_BYTE_TEXELS", "HAS_FLOAT_TEXELS", "HAS_SRGB_TEXELS", "HAS_CHECKERS", "HAS_UVS", "HAS_UVS_1",
    "HAS_VERTEX_COLORS", "HAS_NORMAL_MAPS", "HAS_COAT_NORMALS", "HAS_TEXTURED_LIGHTS", "HAS_INSTANCES",
    *(name for name in features.everything() if name.startswith("HAS_MICROFACET")),
})  # fmt: skip
_EDITED = {"camera", "materials", "environment"}  # what `Scene.edit` can change, as far as `edits` goes


def flags() -> frozenset[str]:
    return features.everything() - UNKNOWN


def defines() -> dict[str, object]:
    """The defines that it is compiled with, whatever the scene and its settings."""
    return features.defines(flags(), RenderSettings(1, 1, clamp=1.0)) | features.loops_from_frame()


def settings_for(settings: RenderSettings) -> RenderSettings | None:
    """The settings with which it renders the same picture; None where it cannot."""
    known = settings.estimator == "mis" and settings.sampler == "sobol"
    return replace(settings, adaptive=False) if known else None


def kernel_key(arrays: SceneArrays, settings: RenderSettings) -> kernel_keys.KernelKey | None:
    """The key by which it is compiled; None where it cannot show such a scene."""
    if settings_for(settings) is None or features.flags(arrays) & UNKNOWN:
        return None
    return kernel_keys.KernelKey(tuple(defines().items()), kernel_keys.kernel_key(arrays, settings, flags()).textures)


def edits(old: SceneArrays, new: SceneArrays) -> dict[str, Any] | None:
    """The arguments of `Scene.edit` that lead from one scene to the other; None where no edit does."""
    same = all(getattr(old, f.name) is getattr(new, f.name) for f in fields(SceneArrays) if f.name not in _EDITED)
    was, is_ = old.environment, new.environment
    if was is not None and is_ is not None:
        same = same and was.texels is is_.texels and was.sun == is_.sun and was.background == is_.background
    if not same or (was is None) != (is_ is None) or len(old.materials) != len(new.materials):
        return None
    turned = {} if is_ is None else {"environment": (is_.rotation, is_.scale)}
    return {"camera": new.camera, "materials": new.materials, **turned}


class FallbackScene(Scene):
    """A scene whose pictures are made with that kernel. Made by `Renderer.load_fallback`."""

    def __init__(self, context: Any, arrays: SceneArrays, texels: TextureCache) -> None:
        super().__init__(context, arrays, False, texels)

    def _raise_flags(self) -> None:
        self._looped = features.looped(self.arrays)
        self._raised = flags()

    def defines(self, settings: RenderSettings) -> dict[str, object]:
        return defines()
