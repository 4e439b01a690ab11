"""Runs kernels over parts of a picture: what all of them read is bound here, and their `Uniforms` are written."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.device.scene import Scene
from gpu.kernels import features
from gpu.layout import Uniforms, bindings
from gpu.layout.bindings import Slot
from gpu.layout.pixel_layers import VECTOR_BYTES
from gpu.picture import filters
from gpu.picture.schedule import Tile, group_stride
from gpu.settings import ESTIMATORS, SAMPLERS, RenderSettings

_ALIGNED = 32  # pixels; on every driver a binding may begin at a multiple of this


class Dispatcher:
    """Made for one picture; `uniform_buffer` is the device's buffer of `Uniforms`, which all pictures share."""

    def __init__(self, context: Any, uniform_buffer: Any, scene: Scene, settings: RenderSettings) -> None:
        self.context, self._uniform_buffer = context, uniform_buffer
        self.scene, self.settings = scene, settings
        # As drivers bind no more than 128 MiB at once, to be sure of.
        self.most_pixels = contexts.storage_block_bytes(context) // VECTOR_BYTES // _ALIGNED * _ALIGNED - _ALIGNED
        self.counters = context.buffer(reserve=16)  # paths ended by their throughput, samples cut short
        self.is_software = contexts.is_software(context)
        self._uniforms_beside = context.buffer(reserve=Uniforms.dtype.itemsize)
        self._filter = context.buffer(reserve=16 * (features.FILTER_TABLE_SIZE + 1))

    def configure(self, settings: RenderSettings) -> None:
        """Set the settings of the dispatches that follow."""
        self.settings = settings
        table = np.zeros((features.FILTER_TABLE_SIZE + 1, 4), np.float32)
        table[:, :2] = filters.table(settings.filter, features.FILTER_TABLE_SIZE)
        self._filter.write(table)

    def bind(self) -> None:
        """Bind the buffers that every kernel reads; `bind_part` binds those that it writes."""
        self.scene.bind()
        self.counters.bind_to_storage_buffer(int(Slot.COUNTERS))
        self._uniform_buffer.bind_to_uniform_block(bindings.UNIFORM_BLOCK)
        self._filter.bind_to_uniform_block(bindings.FILTER_BLOCK)

    def bind_part(self, buffers: dict[Slot, Any], tile: Tile, width: int, vectors: int = 1) -> int:
        """Bind the part of each buffer, of rows of `width` pixels with `vectors` for each, that a tile touches; the
        part's first pixel."""
        x, y, columns, rows = tile
        each = VECTOR_BYTES * vectors
        first = (y * width + x) // _ALIGNED * _ALIGNED
        count = (y + rows - 1) * width + x + columns - first
        for slot, buffer in buffers.items():
            buffer.bind_to_storage_buffer(int(slot), offset=first * each, size=count * each)
        return first

    def uniforms(self, origin: tuple[int, int], size: tuple[int, int], first: int, count: int) -> np.ndarray:
        """The `Uniforms` for samples [first, first + count) of the invocations of a tile."""
        s = self.settings
        uniforms: np.ndarray = np.zeros((), Uniforms.dtype)
        self.scene.write_uniforms(uniforms)
        uniforms["resolution"] = (s.width, s.height)
        uniforms["tile_origin"], uniforms["tile_size"] = origin, size
        uniforms["sample_first"], uniforms["sample_count"] = first, count
        uniforms["max_bounces"], uniforms["roulette_depth"], uniforms["seed"] = (
            s.max_bounces,
            s.roulette_depth,
            s.seed,
        )
        uniforms["footprint_share"] = filters.FOOTPRINT[s.filter]
        uniforms["estimator"], uniforms["sampler"] = ESTIMATORS.index(s.estimator), SAMPLERS.index(s.sampler)
        uniforms["clamp_radiance"] = math.inf if s.clamp is None else s.clamp
        uniforms["filter_glossy"] = s.filter_glossy
        uniforms["slot_width"] = s.width
        return uniforms

    def run(self, kernel: Any, uniforms: np.ndarray, groups: tuple[int, int], beside: bool = False) -> None:
        """Start a kernel; the caller waits for it. With `beside` the next one, `run_beside`, may run at the same
        time."""
        uniforms["group_stride"] = group_stride(groups[0] * groups[1]) if self.is_software else 1
        self._uniform_buffer.write(uniforms.tobytes())
        contexts.dispatch(self.context, kernel, *groups, beside=beside)

    def run_beside(self, kernel: Any, uniforms: np.ndarray, groups: tuple[int, int]) -> None:
        """Start a kernel beside the one before. Its uniforms are in a buffer of their own, as those of the other may
        still be read."""
        self._uniforms_beside.bind_to_uniform_block(bindings.UNIFORM_BLOCK)
        uniforms["group_stride"] = 1
        self._uniforms_beside.write(uniforms.tobytes())
        contexts.dispatch(self.context, kernel, *groups)
        self._uniform_buffer.bind_to_uniform_block(bindings.UNIFORM_BLOCK)

    @property
    def counts(self) -> tuple[int, int]:
        """Counts of paths that were ended by their throughput, and of samples that were cut short."""
        ended, cut = np.frombuffer(self.counters.read(8), np.uint32).tolist()
        return ended, cut

    @counts.setter
    def counts(self, values: tuple[int, int]) -> None:
        self.counters.write(np.minimum(values, 0xFFFFFFFF).astype(np.uint32).tobytes())

    @property
    def warnings(self) -> list[str]:
        """Warnings about paths that the kernel could not follow to their end."""
        ended, cut = self.counts
        out = [f"{ended} paths ended because their throughput passed 1e6"] if ended else []
        if cut:
            out.append(
                f"{cut} paths were cut short and lack light: they came to too many shapes or transparent layers; "
                "lower max_bounces, or take layers away"
            )
        return out

    def release(self) -> None:
        self._filter.release()
        self._uniforms_beside.release()
        self.counters.release()
