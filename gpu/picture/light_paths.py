"""Caustics by paths of light: the first two of every LIGHT_PERIOD samples have as many of them as the picture has
pixels, traced after the paths from the camera. What they bring is summed in integers, so that the picture has the
same bits however its work was cut.

The paths of the first of these samples and those of the second ones have independent random numbers. The square of
the difference of what both bring is therefore an unbiased estimate of the variance of their sum, whatever the sampler
gains.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.kernels import caustics
from gpu.kernels.cache import KernelCache
from gpu.kernels.features import LIGHT_PERIOD, MOST_SPLATTED, SPLAT_UNITS
from gpu.layout import LUMINANCE
from gpu.layout.bindings import Slot
from gpu.layout.pixel_layers import SPLAT_BYTES
from gpu.picture.dispatcher import Dispatcher
from gpu.picture.schedule import Tile, work_groups

ENTRY = "lighttrace.comp"
_READ = ("lights", "materials", "environment", "spheres", "quads", "boxes", "ellipsoids", "triangles", "instances")
_SMOOTHED = 2  # pixels on each side over which an estimate of variance, from one difference, is averaged


def reversed_rays(defines: dict[str, object]) -> dict[str, object]:
    """The defines that lighttrace.comp is compiled with, from those of a picture's other kernels."""
    return defines | {"REVERSED": 1}


def samples_with_paths(samples: int) -> tuple[int, int]:
    """How many of the first samples have even paths of light, and how many have odd ones."""
    return (samples + LIGHT_PERIOD - 1) // LIGHT_PERIOD, (samples + LIGHT_PERIOD - 2) // LIGHT_PERIOD


class LightPaths:
    """The sums of one picture, whose first `even` and `odd` paths they have. They take memory where the kernel leaves
    caustics out of the camera's paths."""

    def __init__(self, dispatcher: Dispatcher, kernels: KernelCache) -> None:
        self._dispatcher, self._kernels = dispatcher, kernels
        self._pixels = dispatcher.settings.width * dispatcher.settings.height
        self._kernel: Any = None
        self._sums: Any = None
        self._sources: Any = None  # `caustics.words` on the device
        self._begins = False  # whether there is a light, and a target to aim at
        self._read: tuple[Any, ...] = ()  # the members of the scene from which these were made
        self.even, self.odd = 0, 0

    @property
    def on(self) -> bool:
        return self._sums is not None

    @property
    def buffers(self) -> tuple[Any, ...]:
        """The buffers in the picture's saved state."""
        return () if self._sums is None else (self._sums,)

    def reset(self) -> float:
        """Start again at no path, with the present scene and settings. Returns the milliseconds of compilation.
        Raises CompileError, OutOfMemory."""
        d = self._dispatcher
        defines = d.scene.defines(d.settings)
        self.even = self.odd = 0
        if not defines["CAUSTICS"]:
            self.release()
            return 0.0
        kernel = self._kernels.get(ENTRY, reversed_rays(defines))
        compile_ms = self._kernels.last_compile_ms
        if kernel is not self._kernel:
            self._kernels.hold(kernel)
            self._let_go()
            self._kernel = kernel
        if self._sums is None:
            self._sums = contexts.allocate(d.context, SPLAT_BYTES * self._pixels)
        self._sums.clear()
        read = tuple(getattr(d.scene.arrays, name) for name in _READ)
        if len(read) != len(self._read) or any(a is not b for a, b in zip(read, self._read, strict=True)):
            words = caustics.words(d.scene.arrays)
            if self._sources is not None:
                self._sources.release()
            self._sources, self._read = contexts.allocate(d.context, words), read
            self._begins = bool(words[0, 1])
        return compile_ms

    @property
    def warnings(self) -> list[str]:
        """A warning where light of lamps without extent cannot be found."""
        d = self._dispatcher
        if not caustics.hides(d.scene.arrays):
            return []
        if self.on:
            return [
                "the caustics of lamps without extent are there where they are seen directly; in mirrors, through "
                "glass and as light for other surfaces they are missing"
            ]
        if d.settings.adaptive or d.settings.filter_glossy > 0:
            how = '; they need settings.caustics "light", which goes neither with adaptive nor with filter_glossy'
        elif d.settings.width * d.settings.height > MOST_SPLATTED:
            how = f"; they are traced from the lights in pictures of at most {MOST_SPLATTED} pixels"
        else:
            how = '; settings.caustics "light" finds them'
        return [f"the caustics of lamps without extent are missing{how}"]

    def compile_fully(self) -> float:
        """Run the kernel over no pixel, for the reason of `Passes._compile_fully`. Returns the milliseconds."""
        start = time.perf_counter()
        self._dispatcher.bind()
        self._start((0, 0, 0, 0), 0, 1, (1, 1))
        contexts.finish(self._dispatcher.context)
        return (time.perf_counter() - start) * 1e3

    def trace(self, tile: Tile, first: int, samples: int) -> None:
        """Start the paths of the pixels of a tile in some samples; the caller waits for it."""
        if self._begins and samples_with_paths(first + samples) != samples_with_paths(first):
            self._start(tile, first, samples, work_groups(tile[2], tile[3]))

    def _start(self, tile: Tile, first: int, samples: int, groups: tuple[int, int]) -> None:
        d = self._dispatcher
        self._sums.bind_to_storage_buffer(int(Slot.SPLATS))
        self._sources.bind_to_storage_buffer(int(Slot.LIGHT_SOURCES))
        d.run(self._kernel, d.uniforms(tile[:2], tile[2:], first, samples), groups)

    def _numbers(self, first: int, count: int) -> np.ndarray:
        data = self._sums.read(SPLAT_BYTES * count, offset=SPLAT_BYTES * first)
        return np.frombuffer(data, "<i8").reshape(count, 4)

    @property
    def _unit(self) -> float:
        return float(self._dispatcher.scene.arrays.radiance_scale) / SPLAT_UNITS

    @property
    def _scale(self) -> float:
        """The factor from a pixel's sums to their mean; the sums are 0 before there is a path."""
        return self._unit * self._pixels / max(self.even + self.odd, 1)

    def radiance(self, first: int, count: int) -> np.ndarray:
        """Mean radiance that they bring to pixels [first, first + count): (count, 3) float32."""
        if not self.on:
            return np.zeros((count, 3), np.float32)
        return (self._numbers(first, count)[:, :3] * self._scale).astype(np.float32)

    def bind(self, kernel: Any, first: int, count: int) -> None:
        """Bind these pixels for a kernel that includes `accumulate/splats_mean.glsl`."""
        self._sums.bind_to_storage_buffer(int(Slot.LIGHT_SUMS), offset=SPLAT_BYTES * first, size=SPLAT_BYTES * count)
        kernel["light_scale"].value = self._scale

    def squared_error(self) -> tuple[np.ndarray, np.ndarray]:
        """The luminance that they bring to each pixel, and an unbiased estimate of its squared error from a single
        difference: each (pixels,) float64. The second is 0 before there are two samples."""
        if not self.on or self.even + self.odd == 0:
            return np.zeros(self._pixels), np.zeros(self._pixels)
        numbers = self._numbers(0, self._pixels).astype(np.float64) * (self._unit * self._pixels)
        both, apart = numbers[:, :3] @ np.asarray(LUMINANCE), numbers[:, 3]
        n, even, odd = self.even + self.odd, self.even, self.odd
        if odd == 0:
            return both / n, np.zeros(self._pixels)
        difference = (both + apart) / (2 * even) - (both - apart) / (2 * odd)
        return both / n, difference**2 * (even * odd / n**2)

    def variance(self) -> np.ndarray:
        """The variance of what they bring to each pixel, averaged over its neighbours: (height, width, 3) float64."""
        settings = self._dispatcher.settings
        shape = settings.height, settings.width
        error = _smoothed(self.squared_error()[1].reshape(shape))
        light = self.radiance(0, self._pixels).astype(np.float64).reshape(*shape, 3)
        around = np.stack([_smoothed(light[..., k]) for k in range(3)], axis=-1)
        luminance = around @ np.asarray(LUMINANCE)
        share = np.divide(around, luminance[..., None], out=np.ones_like(around), where=luminance[..., None] > 0)
        return np.asarray(error[..., None] * share**2)

    def _let_go(self) -> None:
        if self._kernel is not None:
            self._kernels.let_go(self._kernel)
            self._kernel = None

    def release(self) -> None:
        for buffer in (self._sums, self._sources):
            if buffer is not None:
                buffer.release()
        self._sums = self._sources = None
        self._read = ()
        self._let_go()


def _smoothed(values: np.ndarray) -> np.ndarray:
    """The mean of each element of a (rows, columns) array and of those around it."""
    total, count = np.zeros_like(values), np.zeros_like(values)
    rows, columns = values.shape
    for dy in range(-_SMOOTHED, _SMOOTHED + 1):
        for dx in range(-_SMOOTHED, _SMOOTHED + 1):
            here = np.s_[max(0, -dy) : rows - max(0, dy), max(0, -dx) : columns - max(0, dx)]
            there = np.s_[max(0, dy) : rows - max(0, -dy), max(0, dx) : columns - max(0, -dx)]
            total[here] += values[there]
            count[here] += 1
    out: np.ndarray = total / count
    return out
