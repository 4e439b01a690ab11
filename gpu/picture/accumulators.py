"""A picture's accumulators on the device: the total of whole blocks of samples, and the block under way."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout.bindings import BlockSlot, GuessSlot, Slot
from gpu.layout.pixel_layers import ACCUMULATORS, VECTOR_BYTES
from gpu.picture.blocks import Sums, merged, merged_moments
from gpu.picture.dispatcher import Dispatcher
from gpu.picture.schedule import work_groups

_LINE = 1024  # pixels in a row of merge.comp's invocations


def defines() -> dict[str, object]:
    """The defines that merge.comp is compiled with."""
    return features.defines(frozenset()) | {"LINE": _LINE}


class Accumulators:
    """The total's accumulators are allocated by `allocate`, the block's when they are first needed."""

    def __init__(self, dispatcher: Dispatcher, kernels: KernelCache) -> None:
        self._dispatcher, self._kernels = dispatcher, kernels
        self._context, settings = dispatcher.context, dispatcher.settings
        self._size = settings.width, settings.height
        self.total: dict[Slot, Any] = {}
        self.block: dict[Slot, Any] = {}
        self.open = False  # whether a block of the picture is under way
        self._clean = False  # whether the block's buffers hold zeros
        self._zero: Any = None  # one pixel, bound in the place of a block

    def allocate(self) -> None:
        self._zero = contexts.allocate(self._context, np.zeros(4, np.float32))
        self._take(self.total)

    def _take(self, buffers: dict[Slot, Any]) -> None:
        try:
            for slot in ACCUMULATORS:
                buffers[slot] = contexts.allocate(self._context, VECTOR_BYTES * self._size[0] * self._size[1])
        except Exception:
            self._release(buffers)
            raise

    def reset(self) -> None:
        """Start again at zero samples. With `adaptive` there is never a block."""
        for buffer in self.total.values():
            buffer.clear()
        self.close()
        if self._dispatcher.settings.adaptive:
            self._release(self.block)

    def close(self) -> None:
        """Drop the block."""
        self.open = self._clean = False

    def allocate_block(self) -> None:
        """Allocate a block's memory, with undefined contents. Raises OutOfMemory, and then changes nothing."""
        if not self.block:
            self._take(self.block)
            self._clean = False

    def empty_block(self) -> None:
        """Make a block of zeros, which is not part of the picture yet. Raises OutOfMemory."""
        self.allocate_block()
        if not self._clean:
            for buffer in self.block.values():
                buffer.clear()
        self._clean = self.open = False

    def open_block(self) -> None:
        """Begin a block, unless one is under way. Raises OutOfMemory."""
        if not self.open:
            self.empty_block()
            self.open = True

    def restore_block(self, contents: list[np.ndarray]) -> None:
        """Have this block, in the order of ACCUMULATORS; without contents, none. Raises OutOfMemory."""
        if contents:
            self.allocate_block()
            for buffer, data in zip(self.block.values(), contents, strict=True):
                buffer.write(data)
        self._clean, self.open = False, bool(contents)

    @property
    def buffers(self) -> list[Any]:
        """The buffers of the block under way."""
        return list(self.block.values()) if self.open else []

    @property
    def moment_scale(self) -> float:
        """Second moments are of radiance times this."""
        return 1.0 / self._dispatcher.scene.arrays.radiance_scale

    def merge(self, first: int, count: int) -> None:
        """Merge the block's pixels [first, first + count), counted row by row, and clear them in the block."""
        kernel = self._kernels.get("merge.comp", defines())
        part = first, 0, count, 1
        begins = self._dispatcher.bind_part(self.total, part, 0)
        self._dispatcher.bind_part(_beside(self.block), part, 0)
        kernel["first"].value, kernel["count"].value = first - begins, count
        kernel["moment_scale"].value = self.moment_scale
        contexts.dispatch(self._context, kernel, *work_groups(_LINE, -(-count // _LINE)))
        contexts.finish(self._context)

    def end_block(self) -> None:
        """End the block, all of which was merged."""
        self.open, self._clean = False, True

    def bind(self, kernel: Any, first: int, count: int) -> None:
        """Bind these pixels for a kernel that includes `accumulate/accumulators.glsl`."""
        self._bind_sums(kernel, self.total, self.block if self.open else {}, first, count)

    def bind_alone(self, sums: dict[Slot, Any], kernel: Any, first: int, count: int) -> None:
        """Bind other sums in their place, given as SUM and MOMENTS."""
        self._bind_sums(kernel, sums, {}, first, count)

    def bind_guess(self, guess: dict[Slot, Any], kernel: Any, first: int, count: int) -> None:
        """Bind a guess for resolve.comp, which adds it to the sums; it is SUM and MOMENTS, or empty."""
        for slot, place in _GUESS.items():
            self._bind_at(place, guess.get(slot), first, count)
        kernel["guess_stride"].value = int(bool(guess))

    def _bind_sums(self, kernel: Any, total: dict[Slot, Any], block: dict[Slot, Any], first: int, count: int) -> None:
        for slot, place in _BESIDE.items():
            self._bind_at(slot, total.get(slot), first, count)
            self._bind_at(place, block.get(slot), first, count)
        for name, value in (("block_stride", int(bool(block))), ("moment_scale", self.moment_scale)):
            uniform = kernel.get(name, None)  # a kernel without moments lacks this uniform
            if uniform is not None:
                uniform.value = value

    def _bind_at(self, place: int, buffer: Any, first: int, count: int) -> None:
        """Bind these pixels of a buffer, or a zero where there is none."""
        if buffer is None:
            self._zero.bind_to_storage_buffer(int(place))
        else:
            buffer.bind_to_storage_buffer(int(place), offset=VECTOR_BYTES * first, size=VECTOR_BYTES * count)

    def means(self, first: int, count: int) -> np.ndarray:
        """Mean radiance and alpha of pixels [first, first + count): (count, 4) float32, as `accumulators_sum`
        computes them."""
        sum_, moments = (self._vectors(self.total[slot], first, count) for slot in (Slot.SUM, Slot.MOMENTS))
        n = moments[:, 3:]
        if self.open:
            sum_ = sum_ + self._vectors(self.block[Slot.SUM], first, count)
            n = n + self._vectors(self.block[Slot.MOMENTS], first, count)[:, 3:]
        mean: np.ndarray = sum_ / np.maximum(n, 1)
        return mean

    def read(self, first: int, count: int) -> Sums:
        """The sums of the samples of pixels [first, first + count): each (count, 4) float32."""
        total = Sums(*(self._vectors(buffer, first, count) for buffer in self.total.values()))
        if not self.open:
            return total
        block = Sums(*(self._vectors(buffer, first, count) for buffer in self.block.values()))
        return merged(total, block, self.moment_scale)

    def read_moments(self, first: int, count: int) -> np.ndarray:
        """Second moments and the number of samples of these pixels: (count, 4) float32."""
        if not self.open:
            return self._vectors(self.total[Slot.MOMENTS], first, count)
        total, block = (
            Sums(*(self._vectors(buffer, first, count) for buffer in buffers.values()))
            for buffers in (self.total, self.block)
        )
        return merged_moments(total, block, self.moment_scale)

    def _vectors(self, buffer: Any, first: int, count: int) -> np.ndarray:
        data = buffer.read(VECTOR_BYTES * count, offset=VECTOR_BYTES * first)
        return np.frombuffer(data, np.float32).reshape(count, 4)

    def clear_rows(self, top: int, rows: int) -> None:
        """Clear rows of the block."""
        width = self._size[0]
        for buffer in self.block.values():
            buffer.clear(VECTOR_BYTES * width * rows, offset=VECTOR_BYTES * width * top)

    def read_rows(self, top: int, rows: int) -> np.ndarray:
        """Rows of the block: (rows, width, 4 * accumulators) float32."""
        width = self._size[0]
        parts = [self._vectors(buffer, width * top, width * rows) for buffer in self.block.values()]
        return np.concatenate(parts, axis=-1).reshape(rows, width, 4 * len(ACCUMULATORS))

    def write_rows(self, top: int, values: np.ndarray) -> None:
        """Write rows of the block, as `read_rows` returns them."""
        for k, buffer in enumerate(self.block.values()):
            part = np.ascontiguousarray(values[..., 4 * k : 4 * k + 4], np.float32)
            buffer.write(part, offset=VECTOR_BYTES * self._size[0] * top)

    def release(self) -> None:
        self._release(self.total)
        self._release(self.block)
        if self._zero is not None:
            self._zero.release()

    @staticmethod
    def _release(buffers: dict[Slot, Any]) -> None:
        for buffer in buffers.values():
            buffer.release()
        buffers.clear()


_BESIDE = dict(zip(ACCUMULATORS, BlockSlot, strict=True))
_GUESS = {Slot.SUM: GuessSlot.SUM, Slot.MOMENTS: GuessSlot.MOMENTS}


def _beside(block: dict[Slot, Any]) -> dict[Any, Any]:
    return {_BESIDE[slot]: buffer for slot, buffer in block.items()}
