"""Accumulators to display values, on the device."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.device.uploads import Buffer, UploadCache
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout.bindings import Slot
from gpu.picture.look import Look
from gpu.picture.schedule import work_groups

_LINE = 1024  # pixels in a row of resolve.comp's invocations


def defines(look: Look, dtype: str, caustics: bool = False) -> dict[str, object]:
    """The defines that resolve.comp is compiled with; `caustics` are those that were traced from the lights."""
    more = {"OUTPUT_FLOAT": int(dtype == "f4"), "LINE": _LINE, "CAUSTICS": int(caustics)}
    return features.defines(frozenset()) | look.defines | more


def resolve(
    context: Any,
    kernels: KernelCache,
    tables: UploadCache[Buffer],
    bind: Callable[[Any, int, int], None],
    pixels: int,
    most: int,
    look: Look,
    dtype: str,
    caustics: bool,
) -> np.ndarray:
    """(`pixels`, 4) exposed, tone-mapped, encoded: uint8, or float32 with dtype "f4". `bind(kernel, first, count)`
    binds the sums of at most `most` pixels, and those of `caustics`."""
    floats = dtype == "f4"
    kernel = kernels.get("resolve.comp", defines(look, dtype, caustics))
    look.set_uniforms(kernel)
    taken = None
    if look.key:
        taken = tables.take(look.key, partial(_upload, context, look))
        taken.upload.buffer.bind_to_storage_buffer(int(Slot.TABLES))
    parts = []
    for first in range(0, pixels, most):
        count = min(most, pixels - first)
        output = contexts.allocate(context, (16 if floats else 4) * count)
        bind(kernel, first, count)
        output.bind_to_storage_buffer(int(Slot.OUTPUT))
        kernel["count"].value = count
        contexts.dispatch(context, kernel, *work_groups(_LINE, -(-count // _LINE)))
        parts.append(output.read())
        output.release()
    if taken:
        taken.release()
    return np.frombuffer(b"".join(parts), np.float32 if floats else np.uint8).reshape(pixels, 4)


def _upload(context: Any, look: Look) -> Buffer:
    return Buffer(contexts.allocate(context, look.texels()))
