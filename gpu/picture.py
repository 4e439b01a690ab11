"""One picture in the making: samples added slice by slice, read whenever somebody looks.

The cut into tiles and slices follows measured cost and never shows: every pixel adds its samples one by one.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu import display, features, filters, layout, meter
from gpu.errors import NothingRendered
from gpu.kernels import Kernels
from gpu.layout import Slot
from gpu.meter import Meter
from gpu.saved import Saved
from gpu.scene import Scene
from gpu.settings import RenderSettings
from gpu.tiles import MAX_SAMPLES_A_PASS, Tile, Tiles, samples_at_once

_GUIDE_SAMPLES = 256  # AOVs of the first hit average at most so many
_GUIDE_PIXELS = 1 << 16  # traced at once for them: 25 ms on llvmpipe in a large mesh
_LINE = 1024  # pixels that resolve.comp takes for a row
_ALIGNED = 32  # pixels: a multiple of it is, at 8 bytes or 16, where a binding may begin on any driver
IDS = ("shape_id", "material_id")


class Picture:
    """Accumulators and schedule of one scene at one size. Made by `Renderer.picture`."""

    def __init__(self, context: Any, kernels: Kernels, frame: Any, scene: Scene, settings: RenderSettings) -> None:
        self.context, self._kernels, self._frame_buffer = context, kernels, frame
        self.scene, self.settings = scene, settings
        self.compile_ms = 0.0
        pixels = settings.width * settings.height
        self._main: dict[Slot, Any] = {}
        self._guides: dict[Slot, Any] = {}
        self._ended = context.buffer(reserve=16)
        self._filter = context.buffer(reserve=16 * (features.FILTER_TABLE_SIZE + 1))
        self._kernel: Any = None
        self._most_pixels = contexts.storage_block_bytes(context) // 16 // _ALIGNED * _ALIGNED - _ALIGNED
        self._meter = Meter(context, kernels, (settings.width, settings.height), self._most_pixels)
        self._cut()
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
        for buffer in (*self.state, *self._guides.values()):
            buffer.clear()
        table = np.zeros((features.FILTER_TABLE_SIZE + 1, 4), np.float32)
        table[:, 0] = filters.inverse(self.settings.filter, features.FILTER_TABLE_SIZE)
        self._filter.write(table)
        self.samples = 0
        self._guide_samples, self._guide_row = 0, 0
        self._pass_samples = 0  # samples of the pass under way; 0: none is
        self._row, self._column = 0, 0  # where its next tile begins; rows beyond the picture are the meter's

    def _compile_fully(self) -> None:
        """Drivers write machine code when a kernel first runs: here, over no pixel, and not in a timed slice."""
        start = time.perf_counter()
        self._bind()
        self._bind_part(self._main, (0, 0, 1, 1), 1)
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
        self._tiles = Tiles(s.width, s.height, self._most_pixels, s.max_bounces, samples)
        self._meter_tiles = Tiles(meter.LINE, self._meter.lines, self._most_pixels, s.max_bounces, samples)

    @property
    def state(self) -> list[Any]:
        """The buffers that samples are added to."""
        return [*self._main.values(), *self._meter.buffers.values(), self._ended]

    @property
    def under_way(self) -> tuple[int, int, int]:
        """Of the pass under way: its samples (0: there is none), row and column of the next tile."""
        return self._pass_samples, self._row, self._column

    @property
    def guided(self) -> bool:
        """Holds AOVs of the first hit."""
        return bool(self._guides)

    @property
    def guided_yet(self) -> bool:
        """Some of those were traced: their kernel is there."""
        return (self._guide_samples, self._guide_row) > (0, 0)

    def restore(self, saved: Saved) -> None:
        """Go on where a picture of the same scene and settings was saved."""
        contexts.use(self.context)
        for buffer, data in zip(self.state, saved.buffers, strict=True):
            buffer.write(data)
        self.samples = saved.samples
        self._pass_samples, self._row, self._column = saved.under_way

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
                end = min(max_samples, meter.FROM) if self.samples < meter.FROM else max_samples
                self._pass_samples = min(self._tiles.pass_samples(self.samples), end - self.samples)
            self._slice()
            if time.perf_counter() - start >= budget_s:
                break
        return time.perf_counter() - start

    def _slice(self) -> None:
        """The next tile of the pass: of the picture, then of the meter."""
        height = self.settings.height
        metering = self._row >= height
        tiles = self._meter_tiles if metering else self._tiles
        tile = tiles.tile(self._row - height if metering else self._row, self._column, self._pass_samples)
        start = time.perf_counter()
        self._dispatch(tile, metering)
        self.context.finish()
        tiles.took(tile, self._pass_samples, time.perf_counter() - start)
        self._column = tile[0] + tile[2]
        if self._column >= tiles.size[0]:
            self._column, self._row = 0, self._row + tile[3]
        after = self.samples + self._pass_samples
        if self._row == height and self._column == 0 and self.samples < meter.FROM <= after:
            self._meter.place(self._main, self.settings.seed)
            self._bind()
        if self._row >= height + self._meter.lines or (self._row >= height and after < meter.FROM):
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
        frame["clamp_radiance"] = s.clamp or 0.0
        frame["slot_width"] = s.width
        return frame

    def _bind(self) -> None:
        self.scene.bind()
        self._ended.bind_to_storage_buffer(int(Slot.ALBEDO))
        self._frame_buffer.bind_to_uniform_block(layout.FRAME_BLOCK)
        self._filter.bind_to_uniform_block(layout.FILTER_BLOCK)

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
        if metering:
            first = self.samples if self.samples >= meter.FROM else 0
            frame = self._frame(tile[:2], tile[2:], first, self.samples + self._pass_samples - first)
            frame["replicate"], frame["moment_scale"], frame["slot_width"] = 1, 0, meter.LINE
            frame["slot_first"] = self._bind_part(self._meter.buffers, tile, meter.LINE)
        else:
            frame = self._frame(tile[:2], tile[2:], self.samples, self._pass_samples)
            frame["slot_first"] = self._bind_part(self._main, tile, self.settings.width)
        self._frame_buffer.write(frame.tobytes())
        self._kernel.run(-(-tile[2] // 8), -(-tile[3] // 8))

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
        if aov in IDS:
            return self._read_id(aov)
        if aov in ("albedo", "normal", "depth"):
            return self._read_guide(aov)
        moments = self._vectors(self._main[Slot.MOMENTS])
        n = np.maximum(moments[..., 3:], 1)
        if aov == "variance":
            scale = np.float32(self.scene.arrays.radiance_scale)
            spread = np.where(n > 1, moments[..., :3] / np.maximum(n - 1, 1) / n, 0)
            return np.minimum(spread.astype(np.float64) * float(scale) ** 2, 3e38).astype(np.float32)
        mean: np.ndarray = self._vectors(self._main[Slot.SUM]) / n
        return mean

    def _read_guide(self, aov: str) -> np.ndarray:
        self.trace_guides()
        if aov != "depth":
            return self._mean_guide(Slot.ALBEDO if aov == "albedo" else Slot.NORMAL)
        albedo, normal = (self._vectors(self._guides[s]) for s in (Slot.ALBEDO, Slot.NORMAL))
        hits = albedo[..., 3:]
        return np.where(hits > 0, normal[..., 3:] / np.maximum(hits, 1), 0).astype(np.float32)

    def _mean_guide(self, slot: Slot) -> np.ndarray:
        mean: np.ndarray = self._vectors(self._guides[slot])[..., :3] / np.float32(self._guide_samples)
        return mean

    def guides(self, most: int) -> tuple[np.ndarray, np.ndarray]:
        """Albedo and normal of the first hit over exactly min(samples, most) samples, whatever was read before."""
        self.trace_guides(most=most)
        return self._mean_guide(Slot.ALBEDO), self._mean_guide(Slot.NORMAL)

    def _read_id(self, aov: str) -> np.ndarray:
        self.trace_guides()
        met = np.frombuffer(self._guides[Slot.OUTPUT].read(), np.uint32)
        ids: np.ndarray = met.reshape(self.settings.height, self.settings.width, 2)[..., IDS.index(aov), None]
        return ids.astype(np.float32)  # whole up to 2^24, the most shapes of a kind that a scene holds

    def trace_guides(self, budget_s: float = math.inf, most: int | None = None) -> bool:
        """Trace the AOVs of the first hit for about `budget_s` seconds; whether they are all there.

        They are traced when first asked for, over the camera rays of the picture's first 256 samples at most, or over
        the first `most` and no others. `read` traces what is still missing.
        """
        self._need_samples()
        start = time.perf_counter()
        want = min(self.samples, most or _GUIDE_SAMPLES)
        width, height = self.settings.width, self.settings.height
        if not self._guides:
            for slot, pixel_bytes in ((Slot.ALBEDO, 16), (Slot.NORMAL, 16), (Slot.OUTPUT, 8)):
                self._guides[slot] = contexts.allocate(self.context, pixel_bytes * width * height)
                self._guides[slot].clear()
        if most is not None and (self._guide_samples, self._guide_row) > (want, 0):
            for buffer in self._guides.values():
                buffer.clear()
            self._guide_samples, self._guide_row = 0, 0
        if self._guide_samples < want and budget_s > 0:
            kernel = self._kernels.get("guides.comp", self.scene.defines(self.settings))
            self._bind()
        rows = max(1 if width > _GUIDE_PIXELS else 8, _GUIDE_PIXELS // width // 8 * 8)
        while self._guide_samples < want and time.perf_counter() - start < budget_s:
            size = (width, min(rows, height - self._guide_row))
            frame = self._frame((0, self._guide_row), size, self._guide_samples, 1)
            frame["slot_first"] = self._bind_part(self._guides, (0, self._guide_row, *size), width)
            self._frame_buffer.write(frame.tobytes())
            kernel.run(-(-size[0] // 8), -(-size[1] // 8))
            self.context.finish()
            self._guide_row += size[1]
            if self._guide_row >= height:
                self._guide_samples, self._guide_row = self._guide_samples + 1, 0
        return self._guide_samples >= want

    def noise(self) -> float | None:
        """Estimated RMSE of the picture's luminance over its mean luminance; None before 2 samples, 0 if black."""
        if self.samples < 2:
            return None
        contexts.use(self.context)
        scale = float(self.scene.arrays.radiance_scale)
        return self._meter.noise(self._main, self.samples >= meter.FROM, scale)

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
        width, height = self.settings.width, self.settings.height
        floats = dtype == "f4"
        defines = features.defines(frozenset()) | {"TONE_MAP": f"{tone_map}_curve"}
        defines |= {"OUTPUT_FLOAT": int(floats), "LINE": _LINE}
        kernel = self._kernels.get("resolve.comp", defines)
        kernel["exposure"].value = 2.0**exposure
        own = [] if color is None else [self.context.buffer(a.tobytes()) for a in (color, np.ones_like(color))]
        sums, counts = own or (self._main[Slot.SUM], self._main[Slot.MOMENTS])
        parts = []
        for first in range(0, width * height, self._most_pixels):  # no more than a driver binds at once
            count = min(self._most_pixels, width * height - first)
            output = contexts.allocate(self.context, (16 if floats else 4) * count)
            for slot, source in ((Slot.SUM, sums), (Slot.MOMENTS, counts)):
                source.bind_to_storage_buffer(int(slot), offset=16 * first, size=16 * count)
            output.bind_to_storage_buffer(int(Slot.OUTPUT))
            kernel["count"].value = count
            kernel.run(_LINE // 8, -(-count // (8 * _LINE)))
            parts.append(output.read())
            output.release()
        for buffer in own:
            buffer.release()
        pixels = np.frombuffer(b"".join(parts), np.float32 if floats else np.uint8)
        return pixels.reshape(height, width, 4)

    def release(self) -> None:
        contexts.use(self.context)
        for buffer in (*self.state, *self._guides.values()):
            buffer.release()
        self._filter.release()
        if self._kernel is not None:
            self._kernels.let_go(self._kernel)
            self._kernel = None
