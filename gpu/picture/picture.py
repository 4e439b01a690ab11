"""One picture in the making: samples added slice by slice, read whenever somebody looks.

The cut into tiles and slices follows measured cost and never shows: every pixel adds its samples one by one.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu import layout
from gpu.device.scene import Scene
from gpu.errors import NothingRendered
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout import bindings
from gpu.layout.bindings import Slot
from gpu.picture import display, filters, first_hit, noise_meter
from gpu.picture.adaptive import Adaptive
from gpu.picture.first_hit import FirstHit
from gpu.picture.noise_meter import NoiseMeter
from gpu.picture.resolve import resolve
from gpu.picture.sample_plan import DECISIONS
from gpu.picture.saved import Saved
from gpu.picture.tiles import MAX_SAMPLES_A_PASS, Tile, Tiles, samples_at_once
from gpu.settings import RenderSettings

_ALIGNED = 32  # pixels: a multiple of it is, at 8 bytes or 16, where a binding may begin on any driver


class Picture:
    """Accumulators and schedule of one scene at one size. Made by `Renderer.picture`."""

    def __init__(
        self, context: Any, kernels: KernelCache, frame: Any, scene: Scene, settings: RenderSettings
    ) -> None:
        self.context, self._kernels, self._frame_buffer = context, kernels, frame
        self.scene, self.settings = scene, settings
        self.compile_ms = 0.0
        pixels = settings.width * settings.height
        self._main: dict[Slot, Any] = {}
        self._guides = FirstHit(context, (settings.width, settings.height))
        self._adaptive: Adaptive | None = None
        self._ended = context.buffer(reserve=16)
        self._filter = context.buffer(reserve=16 * (features.FILTER_TABLE_SIZE + 1))
        self._kernel: Any = None
        self._most_pixels = contexts.storage_block_bytes(context) // 16 // _ALIGNED * _ALIGNED - _ALIGNED
        self._meter = NoiseMeter(context, kernels, (settings.width, settings.height), self._most_pixels)
        try:
            for slot in (Slot.SUM, Slot.COMPENSATION, Slot.MOMENTS):
                self._main[slot] = contexts.allocate(self.context, 16 * pixels)
            self._meter.allocate()
            self.reset()
        except Exception:
            self.release()
            raise

    def configure(self, settings: RenderSettings) -> None:
        """Other settings at the same size; starts again."""
        if (settings.width, settings.height) != (self.settings.width, self.settings.height):
            raise ValueError("a picture keeps its size: make another")
        self.settings = settings
        self.reset()

    def reset(self) -> None:
        """Start again at zero samples, with the scene as it is now."""
        contexts.use(self.context)
        kernel = self._kernels.get("pathtrace.comp", self.scene.defines(self.settings))
        self.compile_ms += self._kernels.last_compile_ms
        changed = kernel is not self._kernel
        if changed:
            self._kernels.hold(kernel)
            if self._kernel is not None:
                self._kernels.let_go(self._kernel)
        if changed or self._tiles.max_bounces != self.settings.max_bounces:
            self._kernel = kernel
            self._cut()
        if self._kernels.last_compile_ms:
            self._compile_fully()
        for buffer in self.state:
            buffer.clear()
        self._guides.clear()
        if self._adaptive is not None:
            self._adaptive.forget()
        table = np.zeros((features.FILTER_TABLE_SIZE + 1, 4), np.float32)
        table[:, 0] = filters.inverse(self.settings.filter, features.FILTER_TABLE_SIZE)
        self._filter.write(table)
        self.samples = 0
        self._pass_samples = 0  # samples of the pass under way; 0: none is
        self._row, self._column = 0, 0  # where its next tile begins; rows beyond the tiles' are the meter's

    def _compile_fully(self) -> None:
        """Drivers write machine code when a kernel first runs: here, over no pixel, and not in a timed slice."""
        start = time.perf_counter()
        self._bind()
        self._bind_part(self._main, (0, 0, 1, 1), 1)
        if self._adaptive is not None:
            self._adaptive.bind(None)
        self._frame_buffer.write(self._frame((0, 0), (0, 0), 0, 1).tobytes())
        self._kernel.run(1, 1)
        self.context.finish()
        self.compile_ms += (time.perf_counter() - start) * 1e3

    def _cut(self) -> None:
        s = self.settings
        samples = MAX_SAMPLES_A_PASS
        if contexts.describe(self.context)["software"]:
            counts = features.counts(self.scene.arrays)
            standing = sum(int(str(counts[name])) for name in features.COUNTS)
            samples = samples_at_once(s.max_bounces, standing, len(self.scene.arrays.nodes) // 8)
        self._most_samples = samples  # of an invocation
        if self._adaptive is not None:
            self._adaptive.release()
        self._adaptive, size = None, (s.width, s.height)
        if s.adaptive:
            self._adaptive = Adaptive(self.context, self._kernels, size, self._most_pixels, s.max_bounces)
        self._tiles = self._adaptive or Tiles(*size, self._most_pixels, s.max_bounces, samples)
        self._meter_tiles = Tiles(noise_meter.LINE, self._meter.lines, self._most_pixels, s.max_bounces, samples)

    @property
    def state(self) -> list[Any]:
        """The buffers that samples are added to."""
        plan = [] if self._adaptive is None else [self._adaptive.buffer]
        return [*self._main.values(), *self._meter.buffers.values(), self._ended, *plan]

    @property
    def under_way(self) -> tuple[int, int, int]:
        """Of the pass under way: its samples (0: there is none), row and column of the next tile."""
        return self._pass_samples, self._row, self._column

    @property
    def guided(self) -> bool:
        """Holds AOVs of the first hit."""
        return bool(self._guides.buffers)

    @property
    def guided_yet(self) -> bool:
        """Some of those were traced: their kernel is there."""
        return self._guides.begun

    def restore(self, saved: Saved) -> None:
        """Go on where a picture of the same scene and settings was saved."""
        contexts.use(self.context)
        for buffer, data in zip(self.state, saved.buffers, strict=True):
            buffer.write(data)
        self.samples = saved.samples
        self._pass_samples, self._row, self._column = saved.under_way
        if self._adaptive is not None:  # it begins its pass again: pixels that have theirs get no more
            self._adaptive.forget()
            self._row, self._column = 0, 0
            if self._pass_samples:
                self._list_pass()

    @property
    def any_samples(self) -> bool:
        return self.samples > 0

    @property
    def cost_s(self) -> float:
        """Seconds per sample of one pixel, as measured so far; 0 before the first slice."""
        return self._tiles.cost_s

    @property
    def warnings(self) -> list[str]:
        contexts.use(self.context)
        ended, cut = np.frombuffer(self._ended.read(8), np.uint32).tolist()
        out = [f"{ended} paths ended because their throughput passed 1e6"] if ended else []
        if cut:
            out.append(f"{cut} paths are short: this driver ends the loops of a kernel after 65 535 turns")
        return out

    def trace(self, budget_s: float, max_samples: int) -> float:
        """Trace for about `budget_s` seconds, never past `max_samples` per pixel; the seconds it took."""
        start = time.perf_counter()
        contexts.use(self.context)
        self._bind()
        while self.samples < max_samples:
            if self._pass_samples == 0:
                self._begin_pass(max_samples)
            self._slice()
            if time.perf_counter() - start >= budget_s:
                break
        return time.perf_counter() - start

    def _begin_pass(self, max_samples: int) -> None:
        stops = [noise_meter.FROM] if self._adaptive is None else [noise_meter.FROM, *DECISIONS]
        if self._adaptive is not None and self.samples in DECISIONS:
            self._adaptive.decide(self._main)
        end = min([max_samples, *(stop for stop in stops if stop > self.samples)])
        self._pass_samples = min(self._tiles.pass_samples(self.samples), end - self.samples)
        if self._adaptive is not None:
            self._list_pass()

    def _list_pass(self) -> None:
        assert self._adaptive is not None
        self._adaptive.begin(self.samples, self.samples + self._pass_samples, self._most_samples)

    def _slice(self) -> None:
        """The next tile of the pass: of the picture, then of the meter."""
        height, lines = self._tiles.size[1], self._meter.lines
        metering = self._row >= height
        tiles: Tiles | Adaptive = self._meter_tiles if metering else self._tiles
        rounds, samples = 1, self._pass_samples
        if self._adaptive is not None:
            rounds, samples = self._adaptive.rounds, self._adaptive.chunk
        row = (self._row - height) % lines if metering else self._row
        tile = tiles.tile(row, self._column, samples)
        start = time.perf_counter()
        self._dispatch(tile, metering)
        self.context.finish()
        tiles.took(tile, samples, time.perf_counter() - start)
        self._column = tile[0] + tile[2]
        if self._column >= tiles.size[0]:
            self._column, self._row = 0, self._row + tile[3]
        after = self.samples + self._pass_samples
        if self._row == height and self._column == 0 and self.samples < noise_meter.FROM <= after:
            self._meter.place(self._main, self.settings.seed)
            self._bind()
        if self._row >= height + lines * rounds or (self._row >= height and after < noise_meter.FROM):
            self._row = 0
            self.samples += self._pass_samples
            self._pass_samples = 0

    def _frame(self, tile: tuple[int, int], size: tuple[int, int], first: int, count: int) -> np.ndarray:
        s = self.settings
        frame: np.ndarray = np.zeros((), layout.Frame.dtype)
        self.scene.write_frame(frame)
        frame["resolution"] = (s.width, s.height)
        frame["tile_origin"], frame["tile_size"] = tile, size
        frame["sample_first"], frame["sample_count"] = first, count
        frame["max_bounces"], frame["roulette_depth"], frame["seed"] = s.max_bounces, s.roulette_depth, s.seed
        frame["clamp_radiance"] = math.inf if s.clamp is None else s.clamp
        frame["slot_width"] = s.width
        return frame

    def _bind(self) -> None:
        self.scene.bind()
        self._ended.bind_to_storage_buffer(int(Slot.ALBEDO))
        self._frame_buffer.bind_to_uniform_block(bindings.FRAME_BLOCK)
        self._filter.bind_to_uniform_block(bindings.FILTER_BLOCK)

    def _bind_part(self, buffers: dict[Slot, Any], tile: Tile, width: int) -> int:
        """Binds the part of each buffer that a tile touches, as a driver may bind no more than 128 MiB; its first
        pixel."""
        x, y, columns, rows = tile
        first = (y * width + x) // _ALIGNED * _ALIGNED
        count = (y + rows - 1) * width + x + columns - first
        for slot, buffer in buffers.items():
            pixel_bytes = 8 if slot == Slot.OUTPUT else 16
            buffer.bind_to_storage_buffer(int(slot), offset=first * pixel_bytes, size=count * pixel_bytes)
        return first

    def _dispatch(self, tile: Tile, metering: bool) -> None:
        if self._adaptive is not None:
            frame = self._adaptive_frame(self._adaptive, tile, metering)
        elif metering:
            first = self.samples if self.samples >= noise_meter.FROM else 0
            frame = self._frame(tile[:2], tile[2:], first, self.samples + self._pass_samples - first)
            self._bind_meter(frame, tile)
        else:
            frame = self._frame(tile[:2], tile[2:], self.samples, self._pass_samples)
            frame["slot_first"] = self._bind_part(self._main, tile, self.settings.width)
        self._frame_buffer.write(frame.tobytes())
        if self._adaptive is not None and not metering:
            self._kernel.run(tile[3], 1)
        else:
            self._kernel.run(-(-tile[2] // 8), -(-tile[3] // 8))

    def _adaptive_frame(self, adaptive: Adaptive, tile: Tile, metering: bool) -> np.ndarray:
        """Each pixel goes on from the samples that it has."""
        place = adaptive.bind(None if metering else tile)
        frame = self._frame(tile[:2], tile[2:] if metering else (tile[3], 1), 0, adaptive.chunk)
        if metering:
            self._bind_meter(frame, tile)
        else:
            frame["slot_first"] = self._bind_part(self._main, place, self.settings.width)
        return frame

    def _bind_meter(self, frame: np.ndarray, tile: Tile) -> None:
        frame["replicate"], frame["moment_scale"], frame["slot_width"] = 1, 0, noise_meter.LINE
        frame["slot_first"] = self._bind_part(self._meter.buffers, tile, noise_meter.LINE)

    def _need_samples(self) -> None:
        contexts.use(self.context)
        if self.samples == 0:
            raise NothingRendered("no sample is complete yet")

    def _vectors(self, buffer: Any) -> np.ndarray:
        flat = np.frombuffer(buffer.read(), np.float32)
        shaped: np.ndarray = flat.reshape(self.settings.height, self.settings.width, 4)
        return shaped

    def read(self, aov: str = "color") -> np.ndarray:
        """Linear (height, width, channels) float32, row 0 at the top: color 4 (premultiplied), albedo 3, normal 3,
        depth 1 (0 where nothing is hit), variance 3 (of the pixel's mean), shape_id and material_id 1 (index + 1 of
        what the first sample's camera ray met; 0 where it met nothing).

        Waits for the GPU. Raises NothingRendered before a sample is complete.
        """
        self._need_samples()
        if aov in (*first_hit.IDS, "albedo", "normal", "depth"):
            self.trace_guides()
            return self._guides.read(aov)
        moments = self._vectors(self._main[Slot.MOMENTS])
        n = np.maximum(moments[..., 3:], 1)
        if aov == "variance":
            scale = np.float32(self.scene.arrays.radiance_scale)
            spread = np.where(n > 1, moments[..., :3] / np.maximum(n - 1, 1) / n, 0)
            return np.minimum(spread.astype(np.float64) * float(scale) ** 2, 3e38).astype(np.float32)
        mean: np.ndarray = self._vectors(self._main[Slot.SUM]) / n
        return mean

    def guides(self, most: int) -> tuple[np.ndarray, np.ndarray]:
        """Albedo and normal of the first hit over exactly min(samples, most) samples, whatever was read before."""
        self.trace_guides(most=most)
        return self._guides.read("albedo"), self._guides.read("normal")

    def trace_guides(self, budget_s: float = math.inf, most: int | None = None) -> bool:
        """Trace the AOVs of the first hit for about `budget_s` seconds; whether they are all there.

        They are traced when first asked for, over the camera rays of the picture's first 256 samples at most, or over
        the first `most` and no others. `read` traces what is still missing.
        """
        self._need_samples()
        until = time.perf_counter() + budget_s
        want = min(self.samples, most or first_hit.SAMPLES)
        if not self._guides.buffers:
            self._guides.allocate()
        if most is not None:
            self._guides.limit(want)
        if self._guides.samples < want and budget_s > 0:
            kernel = self._kernels.get("guides.comp", self.scene.defines(self.settings))
            self._bind()
            self._guides.trace(lambda tile, sample: self._trace_guide(kernel, tile, sample), want, until)
        return self._guides.samples >= want

    def _trace_guide(self, kernel: Any, tile: Tile, sample: int) -> None:
        frame = self._frame(tile[:2], tile[2:], sample, 1)
        frame["slot_first"] = self._bind_part(self._guides.buffers, tile, self.settings.width)
        self._frame_buffer.write(frame.tobytes())
        kernel.run(-(-tile[2] // 8), -(-tile[3] // 8))
        self.context.finish()

    def noise(self) -> float | None:
        """Estimated RMSE of the picture's luminance over its mean luminance; None before 2 samples, 0 if black."""
        if self.samples < 2:
            return None
        contexts.use(self.context)
        scale = float(self.scene.arrays.radiance_scale)
        return self._meter.noise(self._main, self.samples >= noise_meter.FROM, scale)

    def display(
        self,
        aov: str = "color",
        exposure: float = 0.0,
        tone_map: str = "pbr_neutral",
        dtype: str = "u1",
        color: np.ndarray | None = None,
    ) -> np.ndarray:
        """Display-encoded (height, width, 4), straight alpha: uint8, or float32 in 0..1 with dtype "f4".

        Colour: exposed (stops), tone-mapped, sRGB; `color` in the place of the picture's own, as `read` gives it.
        Other AOVs: see `display.encode`.
        """
        self._need_samples()
        if aov != "color":
            return display.encode(aov, self.read(aov), dtype)
        own: dict[Slot, Any] = {}
        if color is not None:
            given = {Slot.SUM: color, Slot.MOMENTS: np.ones_like(color)}
            own = {slot: self.context.buffer(values.tobytes()) for slot, values in given.items()}
        most = self._most_pixels
        pixels = resolve(self.context, self._kernels, own or self._main, most, exposure, tone_map, dtype)
        for buffer in own.values():
            buffer.release()
        return pixels.reshape(self.settings.height, self.settings.width, 4)

    def release(self) -> None:
        contexts.use(self.context)
        for buffer in (*self.state, *self._guides.buffers.values()):
            buffer.release()
        if self._adaptive is not None:
            self._adaptive.release()
        self._filter.release()
        if self._kernel is not None:
            self._kernels.let_go(self._kernel)
            self._kernel = None
