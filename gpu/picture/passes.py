"""Tracing a picture: passes of some samples for every pixel, cut into slices of bounded time.

The cut follows the measured cost and never changes the picture: every pixel adds its samples one by one, in order.
No pass crosses the border of a block of samples (see `blocks`), at which each pixel's block is merged into its total.
"""

from __future__ import annotations

import time
from typing import Any

from gpu import context as contexts
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout.bindings import Slot
from gpu.picture import blocks, noise_meter
from gpu.picture.accumulators import Accumulators
from gpu.picture.adaptive import Adaptive
from gpu.picture.bands import BandTracer
from gpu.picture.dispatcher import Dispatcher
from gpu.picture.light_paths import LightPaths, samples_with_paths
from gpu.picture.noise_meter import NoiseMeter
from gpu.picture.schedule import Schedule, Tile, work_groups
from gpu.picture.tiles import GPU_FLOOR, MAX_SAMPLES_A_PASS, SLICE_S, Tiles, samples_at_once

_MERGED = 1 << 18  # pixels that a slice merges, in some milliseconds of llvmpipe


class Passes:
    """The progress of a picture, whose accumulators are `sums`. The meter's pixels are traced after each pass, and a
    block is merged after the pass that completes it."""

    def __init__(
        self, dispatcher: Dispatcher, kernels: KernelCache, sums: Accumulators, meter: NoiseMeter, light: LightPaths
    ) -> None:
        self._dispatcher, self._kernels, self._sums, self._meter = dispatcher, kernels, sums, meter
        self._light = light
        self._kernel: Any = None
        self._schedule: Schedule | None = None
        self.compile_ms = 0.0  # since the picture was made
        self._begin_again()

    def _begin_again(self) -> None:
        self.samples = 0  # of every pixel; in the mean, where the schedule is adaptive
        self._pass_samples = 0  # of the pass under way; 0: none
        # The beginning of the next tile. The picture's rows are followed by those of its paths of light, these by the
        # meter's, and these by the rows to merge.
        self._row, self._column = 0, 0

    def reset(self) -> None:
        """Start at zero samples, with the present scene and settings. The accumulators are cleared."""
        d = self._dispatcher
        kernel = self._kernels.get("pathtrace.comp", d.scene.defines(d.settings))
        compiled_ms = self._kernels.last_compile_ms
        self.compile_ms += compiled_ms
        light_ms = self._light.reset()
        if kernel is not self._kernel:
            self._kernels.hold(kernel)
            self._let_go()
            self._kernel = kernel
            self._cut()
        elif self.schedule.max_bounces != d.settings.max_bounces:
            self._cut()
        if compiled_ms:
            self._compile_fully()
        self.compile_ms += light_ms + (self._light.compile_fully() if light_ms else 0.0)
        for buffer in self.schedule.buffers:
            buffer.clear()
        self.schedule.forget()
        self._begin_again()

    @property
    def schedule(self) -> Schedule:
        """The schedule, which the first `reset` makes."""
        assert self._schedule is not None
        return self._schedule

    @property
    def under_way(self) -> tuple[int, int, int]:
        """The pass under way: its samples (0: none), row and column of the next tile."""
        return self._pass_samples, self._row, self._column

    def restore(self, samples: int, under_way: tuple[int, int, int]) -> None:
        """Continue a saved pass; the caller has written the buffers."""
        self.samples = samples
        self._pass_samples, row, column = under_way
        self.schedule.forget()
        self._row, self._column = self.schedule.resume(row, column)
        if self._pass_samples:
            self._begin_schedule()
        self._count_light()

    def trace(self, budget_s: float, max_samples: int, sharers: int = 1) -> float:
        """Trace for about `budget_s` seconds, never past `max_samples` per pixel. Returns the seconds that it
        took."""
        start = time.perf_counter()
        enough = start + budget_s - SLICE_S / 2
        self._dispatcher.bind()
        while self.samples < max_samples:
            if self._pass_samples == 0:
                self._begin_pass(max_samples, sharers)
            self._slice()
            if time.perf_counter() >= enough:
                break
        return time.perf_counter() - start

    def trace_band(self, tracer: BandTracer, budget_s: float) -> float:
        """Trace a band into the block's accumulators for about `budget_s` seconds, at most to its end. Returns the
        seconds that it took."""
        start = time.perf_counter()
        enough = start + budget_s - SLICE_S / 2
        self._dispatcher.bind()
        while not tracer.complete:
            tile, first, samples = tracer.next(self._tiles, self._most_samples)
            began = time.perf_counter()
            self._trace(self._sums.block, tile, tile[:2], tile[2:], first, samples, work_groups(tile[2], tile[3]))
            contexts.finish(self._dispatcher.context)
            self._tiles.took(tile, samples, time.perf_counter() - began)
            tracer.took(tile, self._dispatcher.settings.width)
            if time.perf_counter() >= enough:
                break
        return time.perf_counter() - start

    @property
    def _tiles(self) -> Tiles:
        assert isinstance(self.schedule, Tiles)
        return self.schedule

    def complete(self, end: int) -> None:
        """Continue as after a pass up to `end` samples, at the end of the picture."""
        self._pass_samples = end - self.samples
        self._row, self._column = self.schedule.size[1], 0
        self._begin_schedule()

    def release(self) -> None:
        if self._schedule is not None:
            self._schedule.release()
        self._let_go()

    def _let_go(self) -> None:
        if self._kernel is not None:
            self._kernels.let_go(self._kernel)
            self._kernel = None

    def _cut(self) -> None:
        """Make the schedules for this kernel and these settings."""
        d, s = self._dispatcher, self._dispatcher.settings
        samples, floor = MAX_SAMPLES_A_PASS, GPU_FLOOR
        if d.is_software:
            floor = 0
            counts = features.counts(d.scene.arrays)
            standing = sum(int(str(counts[name])) for name in features.COUNTS)
            samples = samples_at_once(s.max_bounces, standing, len(d.scene.arrays.nodes) // 8)
        self._most_samples = samples  # of an invocation
        rates = None if self._schedule is None else self._schedule.rates
        if self._schedule is not None:
            self._schedule.release()
            self._schedule = None
        size = s.width, s.height
        if s.adaptive:
            self._schedule = Adaptive(d.context, self._kernels, size, d.most_pixels, s.max_bounces)
        else:
            self._schedule = Tiles(*size, d.most_pixels, s.max_bounces, samples, floor)
        if rates is not None:
            self._schedule.expect(rates)  # of another kernel: the best estimate
        self._light_tiles = Tiles(*size, d.most_pixels, s.max_bounces, samples, floor)
        self._meter_tiles = Tiles(noise_meter.LINE, self._meter.lines, d.most_pixels, s.max_bounces, samples, floor)

    def _compile_fully(self) -> None:
        """Run the kernel over no pixel: drivers make machine code in the first run, which must not be timed."""
        start = time.perf_counter()
        d = self._dispatcher
        d.bind()
        d.bind_part(self._sums.total, (0, 0, 1, 1), 1)
        self.schedule.bind()
        d.run(self._kernel, d.uniforms((0, 0), (0, 0), 0, 1), (1, 1))
        contexts.finish(d.context)
        self.compile_ms += (time.perf_counter() - start) * 1e3

    @property
    def _parted(self) -> bool:
        """True if samples are summed in blocks."""
        return not self._dispatcher.settings.adaptive

    def _begin_pass(self, max_samples: int, sharers: int = 1) -> None:
        schedule = self.schedule
        if self._parted and self.samples >= blocks.FIRST:
            self._sums.open_block()
        schedule.decide(self.samples, self._sums.total)
        stops = (stop for stop in (noise_meter.FROM, *schedule.stops) if stop > self.samples)
        end = min([max_samples, blocks.stop_after(self.samples), *stops])
        self._pass_samples = min(schedule.pass_samples(self.samples, sharers), end - self.samples)
        self._begin_schedule()

    def _begin_schedule(self) -> None:
        self.schedule.begin(self.samples, self.samples + self._pass_samples, self._most_samples)

    def _slice(self) -> None:
        """Trace the next tile of the pass, of the picture, its paths of light or the meter, or merge some pixels of a
        block."""
        height, after = self.schedule.size[1], self.samples + self._pass_samples
        lit = height + self._light_rows
        metered = lit
        if after >= noise_meter.FROM:
            metered += self._meter.lines * self.schedule.meter_rounds(noise_meter.FROM)
        if self._row < height:
            self._trace_picture()
        elif self._row < lit:
            self._trace_light(self._row - height)
        elif self._row < metered:
            self._trace_meter(self._row - lit)
        else:
            self._merge(self._row - metered)
        if self._row == height and self._column == 0 and self.samples < noise_meter.FROM <= after:
            self._meter.place(self._sums.total, self._dispatcher.settings.seed)
            self._dispatcher.bind()
        merges = self._merges
        if self._row >= metered + (self._dispatcher.settings.height if merges else 0):
            if merges:
                self._sums.end_block()
            self._row = 0
            self.samples += self._pass_samples
            self._pass_samples = 0
        self._count_light()

    @property
    def _light_rows(self) -> int:
        """The rows of the picture's paths of light in a pass."""
        return self._dispatcher.settings.height if self._light.on else 0

    def _count_light(self) -> None:
        """Tell the sums of the paths of light how many they have."""
        settings, first, samples = self._dispatcher.settings, self.samples, self._pass_samples
        pixels, row = settings.width * settings.height, self._row - self.schedule.size[1]
        part = 0
        if self._light.on and samples and row >= 0:
            part = pixels if row >= self._light_rows else self._light_tiles.pixels_before(row, self._column)
        (even, odd), (evens, odds) = samples_with_paths(first), samples_with_paths(first + samples)
        self._light.even = pixels * even + part * (evens - even)
        self._light.odd = pixels * odd + part * (odds - odd)

    def _trace_light(self, row: int) -> None:
        tiles, samples = self._light_tiles, self._pass_samples
        tile = tiles.tile(row, self._column, samples)
        start = time.perf_counter()
        self._light.trace(tile, self.samples, samples)
        contexts.finish(self._dispatcher.context)
        tiles.took(tile, samples, time.perf_counter() - start)
        self._advance(tile, tiles.size[0])

    def _trace_picture(self) -> None:
        schedule = self.schedule
        tile = schedule.tile(self._row, self._column, schedule.chunk)
        is_last = tile[0] + tile[2] == schedule.size[0] and tile[1] + tile[3] == schedule.size[1]
        beside = is_last and self._meters_beside
        start = time.perf_counter()
        sums = self._sums.block if self._sums.open else self._sums.total
        self._trace(sums, *schedule.dispatch(tile), beside=beside)
        merges = beside and self._merges
        if beside:
            self._start_meter((0, 0, noise_meter.LINE, self._meter.lines), 0, beside=True)
        if merges:  # one wait for both
            self._sums.merge(0, schedule.size[0] * schedule.size[1])
            self._dispatcher.bind()
        self._took(schedule, tile, schedule.chunk, start)
        if beside:
            self._row += self._meter.lines
        if merges:
            self._row += schedule.size[1]

    @property
    def _merges(self) -> bool:
        """True if the pass under way ends a block."""
        return self._sums.open and self.samples + self._pass_samples == blocks.border_after(self.samples)

    @property
    def _meters_beside(self) -> bool:
        """True if the noise meter's pixels, too few to fill a GPU, are traced beside the picture's last tile."""
        d = self._dispatcher
        ready = self.samples >= noise_meter.FROM and not self._light.on and not d.is_software
        fits = d.settings.width * d.settings.height <= d.most_pixels
        return ready and fits and self._parted and self.schedule.meter_rounds(noise_meter.FROM) == 1

    def _trace(
        self, sums: dict[Slot, Any], part: Tile, origin: tuple[int, int], size: tuple[int, int], first: int,
        samples: int, groups: tuple[int, int], beside: bool = False,
    ) -> None:  # fmt: skip
        d = self._dispatcher
        uniforms = d.uniforms(origin, size, first, samples)
        uniforms["slot_first"] = d.bind_part(sums, part, d.settings.width)
        d.run(self._kernel, uniforms, groups, beside)

    def _trace_meter(self, row: int) -> None:
        turn, row = divmod(row, self._meter.lines)
        _, samples = self.schedule.meter_samples(noise_meter.FROM, turn)
        tile = self._meter_tiles.tile(row, self._column, samples)
        start = time.perf_counter()
        self._start_meter(tile, turn)
        self._took(self._meter_tiles, tile, samples, start)

    def _start_meter(self, tile: Tile, turn: int, beside: bool = False) -> None:
        d, schedule = self._dispatcher, self.schedule
        first, samples = schedule.meter_samples(noise_meter.FROM, turn)
        schedule.bind()
        uniforms = d.uniforms(tile[:2], tile[2:], first, samples)
        uniforms["replicate"], uniforms["moment_scale"], uniforms["slot_width"] = 1, 0, noise_meter.LINE
        uniforms["slot_first"] = d.bind_part(self._meter.buffers, tile, noise_meter.LINE)
        run = d.run_beside if beside else d.run
        run(self._kernel, uniforms, work_groups(tile[2], tile[3]))

    def _took(self, tiles: Schedule, tile: Tile, samples: int, start: float) -> None:
        """Wait for the tile that began at `start`, and advance to the next one."""
        contexts.finish(self._dispatcher.context)
        tiles.took(tile, samples, time.perf_counter() - start)
        self._advance(tile, tiles.size[0])

    def _advance(self, tile: Tile, width: int) -> None:
        self._column = tile[0] + tile[2]
        if self._column >= width:
            self._column, self._row = 0, self._row + tile[3]

    def _merge(self, row: int) -> None:
        settings, most = self._dispatcher.settings, self._dispatcher.most_pixels
        if self._dispatcher.is_software:
            most = min(_MERGED, most)
        width = min(settings.width - self._column, most)
        rows = min(max(1, most // settings.width), settings.height - row) if self._column == 0 else 1
        tile = self._column, row, width, rows
        self._sums.merge(row * settings.width + self._column, width * rows)
        self._dispatcher.bind()
        self._advance(tile, settings.width)
