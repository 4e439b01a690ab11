"""Scan lines of Radiance files that are not in its newer run lengths: flat ones, and the older runs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.types import Floats

NEW_RUNS = range(8, 0x8000)  # lengths of a line that newer run lengths take
BIAS = 128 + 8  # of an exponent, for mantissas of eight bits


def is_new(data: bytes, start: int, length: int) -> bool:
    """True where the lines, of so many texels, that begin at `start` are in the newer run lengths."""
    return length in NEW_RUNS and data[start : start + 2] == b"\2\2" and data[start + 2 : start + 3] < b"\x80"


def read_lines(data: bytes, start: int, lines: int, length: int) -> Floats:
    """(lines, length, 3): four bytes are a texel, or, with 1 1 1 before it, how often the texel before is repeated;
    each further count in a row has eight bits more. Raises ParseError."""
    words = np.frombuffer(data, np.uint8, (len(data) - start) // 4 * 4, start).reshape(-1, 4)
    wanted = lines * length
    words = words[: 5 * wanted]  # as no texel needs more: one and four counts
    repeats = (words[:, :3] == 1).all(axis=1)
    if len(words) and repeats[0]:
        raise ParseError("its first scan line begins with a run length, and has no texel to repeat")
    places = np.arange(len(words))
    texel = np.maximum.accumulate(np.where(repeats, 0, places))
    digit = np.clip(places - texel - 1, 0, 4)
    counts = np.where(repeats, np.minimum(words[:, 3].astype(np.int64) << 8 * digit, wanted), 1)
    ends = np.cumsum(counts)
    if not len(ends) or ends[-1] < wanted:
        held = int(ends[-1]) if len(ends) else 0
        raise ParseError(f"the file is cut off: it has {held} of {wanted} texels")
    last = int(np.searchsorted(ends, wanted))
    counts[last] -= ends[last] - wanted
    texels = words[np.repeat(texel[: last + 1], counts[: last + 1])].reshape(lines, length, 4)
    return _floats(texels)


def _floats(texels: npt.NDArray[np.uint8]) -> Floats:
    exponents = texels[..., 3:].astype(np.int32)
    scale = np.where(exponents > 0, np.ldexp(np.float32(1), exponents - BIAS), 0).astype(np.float32)
    return texels[..., :3] * scale
