"""A picture from before an edit, as a guess at what it shows afterwards, until that has samples of its own.

A guess is for the eye alone: it is biased, and enters no accumulator. Two small pictures of few samples, before and
after the edit, say what the edit changes: both follow the same random numbers, so that they are equal where it
changes nothing. The idea is that of a control variate [Owen 2013, "Monte Carlo theory, methods and examples", section
8.9], with the picture before the edit, whose mean is known well, as the variate.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout import LUMINANCE
from gpu.layout.bindings import Slot
from gpu.layout.pixel_layers import VECTOR_BYTES
from gpu.layout.records import CameraKind
from gpu.picture.schedule import work_groups

# A change of the first share of both pictures' sum begins to replace the old picture, one of the second does wholly.
REPLACES_FROM, REPLACES_ALL = 0.3, 0.8
# What of an average's square is put down to chance, in variances around it: the average has the weight
# of 13 pixels.
NOISE = 1 / 13
LEAST_KNOWN = 0.5  # of a pixel: less of it says nothing of the change
SPARSE = 2  # each so-many-th row and column of a picture seen from elsewhere says enough of its averages
DARK = 1e-3  # of the mean luminance: shares of less light than this mean nothing
# Vectors of a pixel: before, as another camera sees it, the guess and its weight; and the depth.
VECTORS = 4.25
_LUMINANCE = np.array(LUMINANCE, np.float32)


def prior_bytes(width: int, height: int) -> int:
    """The bytes of the device that a prior of that size takes."""
    return round(VECTORS * VECTOR_BYTES * width * height)


def can_move(camera: np.void) -> bool:
    """True if what that camera sees can be seen from elsewhere, with its depth."""
    return int(camera["kind"]) == CameraKind.PERSPECTIVE


class Prior:
    """Made by `Renderer.prior`. `correct` makes the guess, and `Picture.display` shows it."""

    def __init__(
        self, context: Any, kernels: KernelCache, color: np.ndarray, camera: np.void, depth: np.ndarray | None
    ) -> None:
        """`color`: (height, width, 4) linear float32, premultiplied; `camera`: a `layout.Camera`; `depth`: (height,
        width, 1) along the camera's rays, 0 where they hit nothing. Raises OutOfMemory."""
        self.size = color.shape[1], color.shape[0]
        self.camera = camera
        self.context, self._kernels = context, kernels
        self._before: Any = None
        self._depth: Any = None
        self._warped: Any = None  # the picture as the camera of `_seen_by` sees it
        self._seen_by = b""
        self._seen: np.ndarray | None = None  # its pixels
        self.guess: dict[Slot, Any] = {}
        try:
            self._before = contexts.allocate(context, np.ascontiguousarray(color))
            if depth is not None:
                self._depth = contexts.allocate(context, np.ascontiguousarray(depth, np.float32))
            for slot in (Slot.SUM, Slot.MOMENTS):
                self.guess[slot] = contexts.allocate(context, VECTOR_BYTES * color.shape[0] * color.shape[1])
        except Exception:
            self.release()
            raise

    @property
    def bytes(self) -> int:
        return prior_bytes(*self.size)

    def serves(self, camera: np.void) -> bool:
        """True if it can guess what that camera sees."""
        return self._same(camera) or (self._depth is not None and can_move(self.camera) and can_move(camera))

    def _same(self, camera: np.void) -> bool:
        return camera.tobytes() == self.camera.tobytes()

    def correct(self, camera: np.void, before: np.ndarray | None, after: np.ndarray, worth: float) -> None:
        """Make the guess at what `camera` sees from two small pictures of equal size and samples, before and after
        the edit, as `Picture.read` gives them; each pixel of it counts for `worth` samples. Where the camera is
        another one, `before` is made from the picture itself. Raises OutOfMemory."""
        contexts.use(self.context)
        old, known = self._before, None
        if not self._same(camera):
            old, seen = self._warp(camera)
            step = SPARSE if 2 * SPARSE * max(after.shape[:2]) <= max(self.size) else 1
            before, known = averages(seen[::step, ::step], after.shape[1], after.shape[0])
        assert before is not None
        small = {Slot.CHANGE: change(before, after, known), Slot.AFTER: _blurred(after)}
        buffers = {slot: contexts.allocate(self.context, np.ascontiguousarray(v)) for slot, v in small.items()}
        kernel = self._kernels.get("prior.comp", features.defines(frozenset()))
        kernel["size"].value = self.size
        kernel["small_size"].value = after.shape[1], after.shape[0]
        kernel["worth"].value = worth
        for slot, buffer in {Slot.BEFORE: old, **buffers, **self.guess}.items():
            buffer.bind_to_storage_buffer(int(slot))
        contexts.dispatch(self.context, kernel, *work_groups(*self.size))
        for buffer in buffers.values():
            buffer.release()

    def _warp(self, camera: np.void) -> tuple[Any, np.ndarray]:
        """The picture as that camera would see it, on the device and as an array; alpha is -1 where nobody knows."""
        if self._warped is None:
            self._warped = contexts.allocate(self.context, VECTOR_BYTES * self.size[0] * self.size[1])
        if self._seen is None or self._seen_by != camera.tobytes():
            kernel = self._kernels.get("prior_warp.comp", features.defines(frozenset()))
            kernel["size"].value = self.size
            for name, each in (("old", self.camera), ("new", camera)):
                frame = np.stack([each["right"], -each["up"], each["forward"]])  # columns, one after the other
                kernel[f"{name}_position"].value = tuple(each["position"].tolist())
                kernel[f"{name}_frame"].value = tuple(frame.ravel().tolist())
                kernel[f"{name}_pixels"].value = 0.5 * self.size[1] / float(each["half_height"])
            for slot, buffer in (
                (Slot.BEFORE, self._before),
                (Slot.DEPTHS, self._depth),
                (Slot.OUTPUT, self._warped),
            ):
                buffer.bind_to_storage_buffer(int(slot))
            contexts.dispatch(self.context, kernel, *work_groups(*self.size))
            self._seen_by = camera.tobytes()
            self._seen = np.frombuffer(self._warped.read(), np.float32).reshape(self.size[1], self.size[0], 4)
        return self._warped, self._seen

    def release(self) -> None:
        """Release the device's memory."""
        for buffer in (self._before, self._depth, self._warped, *self.guess.values()):
            if buffer is not None:
                buffer.release()
        self._before = self._depth = self._warped = self._seen = None
        self.guess = {}


def averages(pixels: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """A small picture, (height, width, 4), of the pixels whose alpha is not negative; and which share of each of its
    pixels these are, (height, width, 1)."""
    known = pixels[..., 3:] >= 0
    both = np.concatenate([np.where(known, pixels, 0), known], axis=2, dtype=np.float32)
    for axis, count in ((0, height), (1, width)):
        first = np.arange(count) * both.shape[axis] // count
        both = np.add.reduceat(both, first, axis)
    area = pixels.shape[0] * pixels.shape[1] / (width * height)
    return both[..., :4] / np.maximum(both[..., 4:], 1), np.minimum(both[..., 4:] / np.float32(area), 1)


def change(before: np.ndarray, after: np.ndarray, known: np.ndarray | None = None) -> np.ndarray:
    """(height, width, 4) float32: what the edit adds to the radiance, without most of its noise, and in the last
    channel how much of the picture is to be replaced, 0 to 1. `known` is the share of each pixel that `before` is
    of."""
    if known is not None:
        before = np.where(known > LEAST_KNOWN, before, after)  # says nothing of what is added
    with np.errstate(over="ignore", invalid="ignore"):
        added = after[..., :3] - before[..., :3]
        both = before[..., :3] @ _LUMINANCE + after[..., :3] @ _LUMINANCE
        dark = DARK * max(float(both.mean(dtype=np.float64)), 1e-30)
        share = _blurred((np.abs(added) @ _LUMINANCE / (both + np.float32(dark)))[..., None])
        out = np.empty((*added.shape[:2], 4), np.float32)
        out[..., :3] = _significant(added)
        out[..., 3:] = np.clip((share - REPLACES_FROM) / (REPLACES_ALL - REPLACES_FROM), 0.0, 1.0)
    return np.nan_to_num(out, nan=0.0, posinf=0.0, neginf=0.0)


def _significant(added: np.ndarray) -> np.ndarray:
    """The average change around each pixel, and less of it the less it stands out from its own noise: a change of
    nothing but noise would only blur the picture before [James and Stein 1961]."""
    mean = _blurred(added)
    squared = np.square(mean).sum(2, keepdims=True)
    spread = np.maximum(_blurred(np.square(added).sum(2, keepdims=True)) - squared, 0)
    out: np.ndarray = mean * np.clip(1 - NOISE * spread / np.maximum(squared, 1e-30), 0, 1)
    return out


def _blurred(values: np.ndarray) -> np.ndarray:
    """Averages of 5 x 5 pixels with binomial weights."""
    for axis in (0, 1):
        pad = [(2, 2) if each == axis else (0, 0) for each in range(values.ndim)]
        wide = np.pad(values, pad, "edge")
        count = values.shape[axis]
        parts = [np.take(wide, range(k, k + count), axis) for k in range(5)]
        values = (parts[0] + 4 * parts[1] + 6 * parts[2] + 4 * parts[3] + parts[4]) / 16
    return values
