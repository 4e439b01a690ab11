"""Records read from words, as GLSL."""

from __future__ import annotations

import numpy as np

from gpu.layout import bindings
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


def fetched(texels: str, record: type[Record], i: str = "i") -> str:
    """Lines that read the words w0, w1, ... of record `i`, four numbers each, from a texture of one long row."""
    groups = record.words // 4
    places = ((k, f"a{k}") for k in range(groups))
    return "\n".join(
        f"    uint {a} = {groups}u * {i} + {k}u;\n"
        f"    uvec4 w{k} = texelFetch({texels}, ivec2({a} & {bindings.TEXELS_A_ROW - 1}u,"
        f" {a} / {bindings.TEXELS_A_ROW}u), 0);"
        for k, a in places
    )
