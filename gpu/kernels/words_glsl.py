"""Records read from words, as GLSL."""

from __future__ import annotations

import numpy as np

from gpu.layout.record import Record


def unpacked(record: type[Record], group: int) -> str:
    """The members of a record, taken from the words w0, w1, ... of `group` numbers each."""
    values = []
    for member, kind in record.members.items():
        at = record.offsets[member]
        swizzle = "xyzw"[at % group : at % group + kind.words]
        word = f"w{at // group}.{swizzle}"
        values.append(word if kind.base is np.uint32 else f"uintBitsToFloat({word})")
    return ", ".join(values)
