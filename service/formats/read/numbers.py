"""Numbers in texts, also those that are none, as C libraries print them."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.types import Doubles

# What Microsoft's C library prints for infinity and NaN, `1.#QNAN00` and `-1.#IND`, rounded also `1.#R` and `1.#J`;
# later versions print `nan(ind)`.
NO_NUMBER = re.compile(rb"(?<![^\s])[-+]?(?:1\.#[A-Za-z]\w*+|s?nan(?:\([^\s()]*+\))?)(?![^\s])", re.IGNORECASE)


def plain(text: bytes) -> bytes:
    """The text with `nan` for each word that stands for no number."""
    return NO_NUMBER.sub(b"nan", text) if b"#" in text or b"n" in text or b"N" in text else text


def quickly(text: bytes, dtype: type[np.generic] = np.float64) -> npt.NDArray[Any] | None:
    """The numbers of a text between blanks; None where a word is none."""
    if not text or text.isspace():
        return np.empty(0, dtype)  # numpy would read a -1
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # numpy warns where it stops short of the end
        try:
            return np.fromstring(text, dtype, sep=" ")
        except (ValueError, DeprecationWarning):
            return None


def parsed(text: bytes) -> Doubles:
    """The numbers of a text between blanks, NaN for words that are none."""
    found = quickly(text)
    if found is not None:
        return found
    found = quickly(plain(text))
    return found if found is not None else np.array([number(word) for word in text.split()], np.float64)


def number(word: bytes) -> float:
    """The number that a word stands for, else NaN."""
    try:
        return float(word) if b"_" not in word else np.nan
    except ValueError:
        return np.nan
