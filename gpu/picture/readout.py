"""Reading a picture: its mean, variance and noise, the first hits, and the mean as a display shows it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout.bindings import Slot
from gpu.layout.pixel_layers import COVER_VECTORS, VECTOR_BYTES
from gpu.picture import noise_meter
from gpu.picture.accumulators import Accumulators
from gpu.picture.coverage import Coverage
from gpu.picture.dispatcher import Dispatcher
from gpu.picture.first_hit import FirstHit
from gpu.picture.light_paths import LightPaths
from gpu.picture.look import Look
from gpu.picture.noise_meter import NoiseMeter
from gpu.picture.prior import Prior
from gpu.picture.resolve import resolve
from gpu.picture.schedule import Tile, work_groups

_PIECE = 1 << 16  # pixels, a megabyte of each accumulator
_READ = 1 << 20  # pixels that are read at once, 16 MB: few reads, for which the device needs little memory
_LINE = 1024  # pixels in a row of mean.comp's invocations


def mean_defines(caustics: bool) -> dict[str, object]:
    """The defines that mean.comp is compiled with; `caustics` are those that were traced from the lights."""
    return features.defines(frozenset()) | {"LINE": _LINE, "CAUSTICS": int(caustics)}


class Readout:
    """Reads the picture's sums and the meter's, and traces first hits when they are first read."""

    def __init__(
        self, dispatcher: Dispatcher, kernels: KernelCache, sums: Accumulators, meter: NoiseMeter, light: LightPaths
    ) -> None:
        self._dispatcher, self._kernels, self._sums, self._meter = dispatcher, kernels, sums, meter
        self._light = light
        self._size = dispatcher.settings.width, dispatcher.settings.height
        self.first_hit = FirstHit(dispatcher.context, self._size, dispatcher.most_pixels)
        self.coverage = Coverage(dispatcher.context, self._size, dispatcher.most_pixels)

    def _pieces(self) -> Iterator[tuple[int, int]]:
        """The first pixel and the number of pixels of pieces that fit into a processor's cache: whole pictures take
        three times as long."""
        pixels = self._size[0] * self._size[1]
        return ((first, min(_PIECE, pixels - first)) for first in range(0, pixels, _PIECE))

    def color(self) -> np.ndarray:
        """Mean radiance and alpha: (height, width, 4) float32."""
        summed = self._color_in_numpy() if self._dispatcher.is_software else self._color_on_the_device()
        return summed.reshape(self._size[1], self._size[0], 4)

    def _color_in_numpy(self) -> np.ndarray:
        """(pixels, 4). On a processor it takes half the time of a kernel, whose result is one copy more."""
        mean = np.empty((self._size[0] * self._size[1], 4), np.float32)
        for first, count in self._pieces():
            mean[first : first + count] = self._sums.means(first, count)
            if self._light.on:
                mean[first : first + count, :3] += self._light.radiance(first, count)
        return mean

    def _color_on_the_device(self) -> np.ndarray:
        """The same bits. On an H200 numpy took 37 ms for 1920 x 1080 pixels; reading as many bytes takes 2.5 ms."""
        d, pixels = self._dispatcher, self._size[0] * self._size[1]
        kernel = self._kernels.get("mean.comp", mean_defines(self._light.on))
        mean = np.empty((pixels, 4), np.float32)
        most = min(pixels, _READ, d.most_pixels)
        output = contexts.allocate(d.context, VECTOR_BYTES * most)
        for first in range(0, pixels, most):
            count = min(most, pixels - first)
            self._sums.bind(kernel, first, count)
            if self._light.on:
                self._light.bind(kernel, first, count)
            output.bind_to_storage_buffer(int(Slot.OUTPUT))
            kernel["count"].value = count
            contexts.dispatch(d.context, kernel, *work_groups(_LINE, -(-count // _LINE)))
            output.read_into(mean[first : first + count].data, VECTOR_BYTES * count)
        output.release()
        return mean

    def variance(self) -> np.ndarray:
        """Variance of each pixel's mean, as if its samples were independent: (height, width, 3) float32."""
        out = np.empty((self._size[0] * self._size[1], 3), np.float32)
        scale = float(np.float32(self._dispatcher.scene.arrays.radiance_scale))
        for first, count in self._pieces():
            moments = self._sums.read_moments(first, count)
            n = np.maximum(moments[:, 3:], 1)
            spread = np.where(n > 1, moments[:, :3] / np.maximum(n - 1, 1) / n, 0)
            out[first : first + count] = np.minimum(spread.astype(np.float64) * scale**2, 3e38)
        shaped = out.reshape(self._size[1], self._size[0], 3)
        return np.minimum(shaped + self._light.variance(), 3e38).astype(np.float32) if self._light.on else shaped

    def noise(self, samples: int) -> float | None:
        """Estimated RMSE of the picture's luminance over its mean luminance; None before 2 samples, 0 if black."""
        if samples < 2:
            return None
        scale = float(self._dispatcher.scene.arrays.radiance_scale)
        error, mean = self._meter.error(self._sums, samples >= noise_meter.FROM, scale)
        if self._light.on:
            light, squared = self._light.squared_error()
            error, mean = float(np.sqrt(error**2 + squared.mean())), mean + float(light.mean())
        return error / mean if mean else 0.0

    def display(
        self, look: Look, dtype: str, color: np.ndarray | None, prior: Prior | None, samples: int
    ) -> np.ndarray:
        """Colour as `Picture.display` gives it, of a picture with that many samples."""
        d, buffers = self._dispatcher, dict[Slot, Any]()
        guess = {} if prior is None else prior.guess
        bind_sums: Callable[[Any, int, int], None] = self._sums.bind
        caustics = color is None and samples > 0 and self._light.on
        if color is not None:
            weight = samples if guess else 1
            given = {Slot.SUM: color * np.float32(weight), Slot.MOMENTS: np.full_like(color, weight)}
            buffers = {slot: d.context.buffer(values.tobytes()) for slot, values in given.items()}
            bind_sums = partial(self._sums.bind_alone, buffers)
        elif samples == 0:
            bind_sums, guess = partial(self._sums.bind_alone, guess), {}

        def bind(kernel: Any, first: int, count: int) -> None:
            bind_sums(kernel, first, count)
            self._sums.bind_guess(guess, kernel, first, count)
            if caustics:
                self._light.bind(kernel, first, count)

        count = self._size[0] * self._size[1]
        pixels = resolve(d.context, self._kernels, d.scene.looks, bind, count, d.most_pixels, look, dtype, caustics)
        for buffer in buffers.values():
            buffer.release()
        return pixels.reshape(self._size[1], self._size[0], 4)

    def trace_first_hits(self, want: int, until: float, rates: np.ndarray, coverage: bool = False) -> bool:
        """Trace first hits, or their `coverage`, until there are `want` samples, or until the clock (perf_counter) is
        at `until`. Returns whether all samples are there. `rates` are those of the picture's schedule."""
        d, hits = self._dispatcher, self.coverage if coverage else self.first_hit
        if not hits.buffers:
            hits.allocate()
        if hits.samples < want and time.perf_counter() < until:
            kernel = self._kernels.get("cover.comp" if coverage else "guides.comp", d.scene.defines(d.settings))
            vectors = COVER_VECTORS if coverage else 1
            d.bind()
            hits.trace(lambda tile, i: self._trace_first_hit(kernel, hits, vectors, tile, i), want, until, rates)
        return hits.samples >= want

    def _trace_first_hit(self, kernel: Any, hits: FirstHit, vectors: int, tile: Tile, sample: int) -> None:
        d = self._dispatcher
        uniforms = d.uniforms(tile[:2], tile[2:], sample, 1)
        uniforms["slot_first"] = d.bind_part(hits.buffers, tile, d.settings.width, vectors)
        d.run(kernel, uniforms, work_groups(tile[2], tile[3]))
        contexts.finish(d.context)
