"""One picture in the making: accumulators, settings, tracing, reading, saving and restoring."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.device.scene import Scene
from gpu.errors import NothingRendered
from gpu.kernels.cache import KernelCache
from gpu.layout.pixel_layers import ACCUMULATORS, VECTOR_BYTES
from gpu.picture import blocks, display, first_hit
from gpu.picture.accumulators import Accumulators
from gpu.picture.dispatcher import Dispatcher
from gpu.picture.light_paths import LightPaths
from gpu.picture.look import Look, Lut, ViewTable
from gpu.picture.noise_meter import NoiseMeter
from gpu.picture.passes import Passes
from gpu.picture.prior import Prior
from gpu.picture.readout import Readout
from gpu.picture.saved import NO_BLOCK, Saved
from gpu.picture.shared_block import SharedBlock
from gpu.settings import COVERAGE_AOVS, FIRST_HIT_AOVS, RenderSettings

PIECE_BYTES = 16 << 20  # of a saved buffer that one step reads, in some milliseconds


def _bytes(size: int) -> np.ndarray:
    return np.empty(size, np.uint8)


class Picture:
    """A picture of one scene at one size, made by `Renderer.picture`. Samples are added slice by slice, and between
    two slices it can be read. By `block` several renderers trace its samples."""

    def __init__(
        self, context: Any, kernels: KernelCache, uniform_buffer: Any, scene: Scene, settings: RenderSettings
    ) -> None:
        self.context, self.scene, self.settings = context, scene, settings
        self.released = False
        size = settings.width, settings.height
        self._dispatcher = Dispatcher(context, uniform_buffer, scene, settings)
        self._meter = NoiseMeter(context, kernels, size, self._dispatcher.most_pixels)
        self._sums = Accumulators(self._dispatcher, kernels)
        self._light = LightPaths(self._dispatcher, kernels)
        self._passes = Passes(self._dispatcher, kernels, self._sums, self._meter, self._light)
        self._readout = Readout(self._dispatcher, kernels, self._sums, self._meter, self._light)
        self.block = SharedBlock(self._dispatcher, self._sums, self._passes)
        try:
            self._sums.allocate()
            self._meter.allocate()
            self.reset()
        except Exception:
            self.release()
            raise

    def configure(self, settings: RenderSettings) -> None:
        """Start again with other settings of the same size."""
        if (settings.width, settings.height) != (self.settings.width, self.settings.height):
            raise ValueError("a picture keeps its size: make another")
        self.settings = settings
        self.reset()

    def reset(self) -> None:
        """Start again at zero samples, with the present scene."""
        contexts.use(self.context)
        self._dispatcher.configure(self.settings)
        self._passes.reset()
        self._sums.reset()
        self.block.reset()
        for buffer in self._beside:
            buffer.clear()
        self._readout.first_hit.clear()
        self._readout.coverage.clear()

    @property
    def _beside(self) -> list[Any]:
        """The buffers of its state, without the accumulators."""
        plan = self._passes.schedule.buffers
        return [*self._meter.buffers.values(), self._dispatcher.counters, *plan, *self._light.buffers]

    @property
    def state(self) -> list[Any]:
        """The buffers that samples are added to, without a block that is shared."""
        return [*self._sums.total.values(), *self._beside, *self._sums.buffers]

    @property
    def state_sizes(self) -> list[int]:
        """The bytes that `save` reads."""
        return [buffer.size for buffer in self.state] + [NO_BLOCK.nbytes] * self._says_no_block

    @property
    def _says_no_block(self) -> bool:
        parted = not self.settings.adaptive
        return parted and not self._sums.open and self.samples + self.under_way[0] > blocks.FIRST

    @property
    def samples(self) -> int:
        """The samples of each pixel in whole passes; with `adaptive` their mean over the pixels."""
        return self._passes.samples

    @property
    def under_way(self) -> tuple[int, int, int]:
        """The pass under way: its samples (0: none), row and column of the next tile."""
        return self._passes.under_way

    @property
    def traces_caustics(self) -> bool:
        """True if its caustics are traced from the lights."""
        return self._light.on

    @property
    def at_border(self) -> bool:
        """True if it has 8, 16, 32, or a multiple of 64 samples, at which passes end however fast the device is, and
        no pass or shared block is under way."""
        return blocks.is_stop(self.samples) and not self.under_way[0] and not self.block.shared

    @property
    def compile_ms(self) -> float:
        """Milliseconds that its kernels took to compile."""
        return self._passes.compile_ms

    @property
    def cost_s(self) -> float:
        """Seconds per sample of one pixel, as measured so far; 0 before the first slice."""
        return self._passes.schedule.cost_s

    def expect_costs(self, other: Picture) -> None:
        """Size the first slices by the measured cost of another picture of the scene: without it a picture that
        begins with the sky would take everything below for sky as well."""
        self._passes.schedule.expect(other._passes.schedule.rates)

    @property
    def guided(self) -> bool:
        """True if AOVs of the first hit are allocated."""
        return bool(self._readout.first_hit.buffers)

    @property
    def covered(self) -> bool:
        """True if coverage is allocated."""
        return bool(self._readout.coverage.buffers)

    def guided_yet(self, coverage: bool = False) -> bool:
        """True if any first hit, or its coverage, was traced: then their kernel is compiled."""
        return (self._readout.coverage if coverage else self._readout.first_hit).begun

    @property
    def warnings(self) -> list[str]:
        """Warnings about paths that were not followed to their end, and about light that no path can find."""
        contexts.use(self.context)
        return [*self._dispatcher.warnings, *self._light.warnings]

    def save(self, room: Callable[[int], np.ndarray] = _bytes) -> Generator[None, None, Saved]:
        """Read the picture's state piece by piece, a step each; the picture must not be traced meanwhile.

        `room` allocates the memory for a number of bytes.
        """
        out: list[np.ndarray] = []
        for buffer in self.state:
            data = room(buffer.size)
            for start in range(0, buffer.size, PIECE_BYTES):
                contexts.use(self.context)
                piece = data[start : start + PIECE_BYTES]
                buffer.read_into(piece.data, piece.nbytes, offset=start)
                yield
            out.append(data)
        if self._says_no_block:
            data = room(NO_BLOCK.nbytes)
            data[:] = NO_BLOCK
            out.append(data)
        return Saved(self.settings, self.samples, self.under_way, out)

    def fits(self, saved: Saved, goes_on: bool = True) -> bool:
        """True if `saved` is of a picture of this size, and can be restored; with `goes_on`, so that more samples
        lead to the same bits, which those of earlier versions do not."""
        sizes, pixels = [data.nbytes for data in saved.buffers], self.settings.width * self.settings.height
        even = [buffer.size for buffer in (*self._sums.total.values(), *self._beside)]
        if sizes == even:
            return self.settings.adaptive or not goes_on or saved.samples + saved.under_way[0] <= blocks.FIRST
        parted = [NO_BLOCK.nbytes], [VECTOR_BYTES * pixels] * len(ACCUMULATORS)
        return not self.settings.adaptive and sizes in [even + more for more in parted]

    def restore(self, saved: Saved) -> None:
        """Continue from a saved picture of the same scene and settings. Raises OutOfMemory."""
        contexts.use(self.context)
        self.block.reset()
        even = [*self._sums.total.values(), *self._beside]
        more = saved.buffers[len(even) :]
        self._sums.restore_block(more if len(more) > 1 else [])
        for buffer, data in zip(even, saved.buffers[: len(even)], strict=True):
            buffer.write(data)
        self._passes.restore(saved.samples, saved.under_way)

    def trace(self, budget_s: float, max_samples: int, sharers: int = 1) -> float:
        """Trace for about `budget_s` seconds, never past `max_samples` per pixel; while its block is shared, the rows
        of its own, whatever `max_samples` is. Returns the seconds that it took. Raises OutOfMemory, when the second
        block begins.

        `sharers` pictures, this one included, take turns on the device: the more there are, the fewer samples are in
        a pass, so that nobody waits long for the next. It changes no bit.
        """
        contexts.use(self.context)
        if self.block.shared:
            return self.block.trace_own(budget_s)
        return self._passes.trace(budget_s, max_samples, sharers)

    def _need_samples(self) -> None:
        contexts.use(self.context)
        if self.samples == 0:
            raise NothingRendered("no sample is complete yet")

    def read(self, aov: str = "color") -> np.ndarray:
        """Linear (height, width, channels) float32, row 0 at the top: color 4 (premultiplied), albedo 3, normal 3,
        depth 1 (0 where nothing is hit), variance 3 (of the pixel's mean), shape_id and material_id 1 (index + 1 of
        the shape that the first sample's camera ray hits; 0 where it hits nothing), shape_coverage and
        material_coverage 12 (see `Coverage.read`).

        Waits for the GPU. Raises NothingRendered before a sample is complete.
        """
        self._need_samples()
        if aov in COVERAGE_AOVS:
            self.trace_guides(coverage=True)
            return self._readout.coverage.read(aov, self.scene.arrays.material_numbers)
        if aov in FIRST_HIT_AOVS:
            self.trace_guides()
            return self._readout.first_hit.read(aov, self.scene.arrays.material_numbers)
        return self._readout.variance() if aov == "variance" else self._readout.color()

    def depth(self) -> np.ndarray | None:
        """Depth of the first hit, (height, width, 1), over the samples that were traced of it; None where none is
        complete."""
        contexts.use(self.context)
        hits = self._readout.first_hit
        return hits.read("depth") if hits.samples else None

    def guides(self, most: int) -> tuple[np.ndarray, np.ndarray]:
        """Albedo and normal of the first hit over exactly min(samples, most) samples, whatever was read before."""
        self.trace_guides(most=most)
        return self._readout.first_hit.read("albedo"), self._readout.first_hit.read("normal")

    def trace_guides(self, budget_s: float = math.inf, most: int | None = None, coverage: bool = False) -> bool:
        """Trace the AOVs of the first hit, or `coverage`, for about `budget_s` seconds; whether they are all there.

        They cover the camera rays of the picture's first 256 samples at most, or with `most` exactly the first
        `most`. `read` traces those that are still missing.
        """
        self._need_samples()
        until = time.perf_counter() + budget_s
        want = min(self.samples, most or first_hit.SAMPLES)
        if most is not None:
            self._readout.first_hit.limit(want)
        return self._readout.trace_first_hits(want, until, self._passes.schedule.rates, coverage)

    def noise(self) -> float | None:
        """Estimated RMSE of the picture's luminance over its mean luminance; None before 2 samples, 0 if black."""
        contexts.use(self.context)
        return self._readout.noise(self.samples)

    def display(
        self,
        aov: str = "color",
        exposure: float = 0.0,
        tone_map: str | ViewTable = "pbr_neutral",
        dtype: str = "u1",
        color: np.ndarray | None = None,
        p3: bool = False,
        lut: Lut | None = None,
        prior: Prior | None = None,
    ) -> np.ndarray:
        """Display-encoded (height, width, 4), straight alpha: uint8, or float32 in 0..1 with dtype "f4".

        Colour: see `Look`; `color` in the place of the picture's own, as `read` gives it; averaged with the guess of
        a `prior` of this size, which is shown alone where the picture has no samples. Other AOVs: see
        `display.encode`.
        """
        if prior is None:
            self._need_samples()
        contexts.use(self.context)
        if aov != "color":
            return display.encode(aov, self.read(aov), dtype)
        return self._readout.display(Look(exposure, tone_map, p3, lut), dtype, color, prior, self.samples)

    def release(self) -> None:
        """Release the device's memory."""
        contexts.use(self.context)
        self._sums.release()
        self._light.release()
        for buffer in self._meter.buffers.values():
            buffer.release()
        self._readout.first_hit.release()
        self._readout.coverage.release()
        self._passes.release()
        self._dispatcher.release()
        self.released = True
