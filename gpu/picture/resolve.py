"""Accumulators to display values, on the device."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout.bindings import Slot
from gpu.picture.schedule import work_groups

_LINE = 1024  # pixels in a row of resolve.comp's invocations


def defines(tone_map: str, dtype: str) -> dict[str, object]:
    """The defines that resolve.comp is compiled with."""
    out = features.defines(frozenset()) | {"TONE_MAP": f"{tone_map}_curve"}
    return out | {"OUTPUT_FLOAT": int(dtype == "f4"), "LINE": _LINE}


def resolve(
    context: Any,
    kernels: KernelCache,
    bind: Callable[[Any, int, int], None],
    pixels: int,
    most: int,
    exposure: float,
    tone_map: str,
    dtype: str,
) -> np.ndarray:
    """(`pixels`, 4) exposed, tone-mapped, sRGB: uint8, or float32 with dtype "f4". `bind(kernel, first, count)` binds
    the sums of at most `most` pixels."""
    floats = dtype == "f4"
    kernel = kernels.get("resolve.comp", defines(tone_map, dtype))
    kernel["exposure"].value = 2.0**exposure
    parts = []
    for first in range(0, pixels, most):
        count = min(most, pixels - first)
        output = contexts.allocate(context, (16 if floats else 4) * count)
        bind(kernel, first, count)
        output.bind_to_storage_buffer(int(Slot.OUTPUT))
        kernel["count"].value = count
        kernel.run(*work_groups(_LINE, -(-count // _LINE)))
        parts.append(output.read())
        output.release()
    return np.frombuffer(b"".join(parts), np.float32 if floats else np.uint8).reshape(pixels, 4)
