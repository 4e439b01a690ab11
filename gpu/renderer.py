"""The one way in: load a scene, take a picture of it. All calls belong to the thread that made the Renderer."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu import layout
from gpu.arrays import SceneArrays
from gpu.bsdf.evaluator import BsdfEvaluator
from gpu.device.blank import dispatch_blank
from gpu.device.scene import Scene
from gpu.device.uploads import SharedUploads
from gpu.errors import SceneTooLarge, WrongThread
from gpu.kernels.cache import KernelCache
from gpu.kernels.source import SHADERS
from gpu.picture.picture import Picture
from gpu.picture.prior import Prior
from gpu.precompile.fallback import FallbackScene
from gpu.settings import RenderSettings


class Renderer:
    """A device with its context and compiled kernels. `shaders` are the folders in which shader files are looked for,
    one after the other. Raises ContextError where no context can be created.

    `context` is moderngl's; each method makes it current first."""

    def __init__(self, device: int | None = None, shaders: Sequence[Path] = (SHADERS,)) -> None:
        self._thread = threading.get_ident()
        self.context = contexts.create(device)
        self._kernels = KernelCache(self.context, shaders)
        self._shared = SharedUploads()
        self._bsdf = BsdfEvaluator(self.context, self._kernels)
        self._uniform_buffer = self.context.buffer(reserve=layout.Uniforms.dtype.itemsize)
        self.info: dict[str, Any] = contexts.describe(self.context)

    def _use_context(self) -> None:
        if threading.get_ident() != self._thread:
            raise WrongThread("a Renderer belongs to the thread that made it")
        contexts.use(self.context)

    def load(
        self,
        arrays: SceneArrays,
        editing: bool = False,
        everything: bool = False,
        raised: frozenset[str] = frozenset(),
    ) -> Scene:
        """Upload a scene. `editing` also raises the flags that sliders of its materials could raise, and those that
        were `raised` before; `everything` raises every common flag besides.

        Raises SceneTooLarge, OutOfMemory.
        """
        self._use_context()
        _check(arrays)
        return Scene(self.context, arrays, editing, self._shared, everything, raised)

    def load_fallback(self, arrays: SceneArrays, raised: frozenset[str]) -> Scene:
        """Upload a scene for the kernel of `fallback` with the flags `raised`, which must be able to show it. Images
        that it shares with other scenes are uploaded once.

        Raises SceneTooLarge, OutOfMemory.
        """
        self._use_context()
        _check(arrays)
        return FallbackScene(self.context, arrays, self._shared, raised)

    def picture(self, scene: Scene, settings: RenderSettings) -> Picture:
        """A picture of `scene`, at zero samples: compiles its kernel and allocates its accumulators.

        Raises CompileError, OutOfMemory.
        """
        self._use_context()
        return Picture(self.context, self._kernels, self._uniform_buffer, scene, settings)

    def prior(self, color: np.ndarray, camera: np.void, depth: np.ndarray | None = None) -> Prior:
        """A picture, (height, width, 4) linear float32 as `Picture.read` gives it, as a prior for pictures that edits
        of its scene lead to. With its `depth`, (height, width, 1), the camera may move.

        Raises OutOfMemory.
        """
        self._use_context()
        return Prior(self.context, self._kernels, color, camera, depth)

    @property
    def bsdf(self) -> BsdfEvaluator:
        """The evaluator of single materials' BSDFs."""
        self._use_context()
        return self._bsdf

    def tidy(self) -> float | None:
        """Release kernels and uploads that have not been used for long. Returns the seconds until the next call is
        due, or None."""
        self._use_context()
        before = self._shared.resting_bytes
        left = self._kernels.tidy(), self._shared.tidy()
        if self._shared.resting_bytes < before:
            self.let_go()
        return min((each for each in left if each is not None), default=None)

    def let_go(self) -> None:
        """Give the memory of released scenes back to the machine, where the driver keeps what the last dispatch read.
        Raises CompileError, DeviceLost."""
        self._use_context()
        if self.info["software"]:
            dispatch_blank(self.context, self._kernels)

    @property
    def shared_bytes(self) -> int:
        """About how many bytes of the device scenes take together for what they share."""
        return self._shared.bytes

    @property
    def resting_bytes(self) -> int:
        """About how many bytes of the device are kept for a moment, and used by no scene."""
        return self._shared.resting_bytes

    @property
    def kernels(self) -> int:
        """The number of compiled kernels in memory."""
        return len(self._kernels)

    @property
    def kernels_evicted(self) -> int:
        """The number of kernels that were evicted since the renderer was made."""
        return self._kernels.evicted

    @property
    def reset_reason(self) -> str | None:
        """Why the device was reset since the renderer was made, in words; None where it was not."""
        self._use_context()
        return contexts.reset_reason(self.context)

    def close(self) -> None:
        """Release the context with all that was made from it."""
        self._use_context()
        self._kernels.release()
        self._shared.release()
        self._bsdf.release()
        self._uniform_buffer.release()
        contexts.release(self.context)

    def __enter__(self) -> Renderer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _check(arrays: SceneArrays) -> None:
    for name in ("spheres", "quads", "boxes", "ellipsoids", "triangles"):
        count = len(getattr(arrays, name))
        if count > layout.LEAF_FIRST_MASK:
            raise SceneTooLarge(f"{count} {name}: at most {layout.LEAF_FIRST_MASK} of a kind")
