"""Documents and files that nobody means well with: good ones, broken at random, the same for the same seed."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator
from typing import Any

# What is put where something else stood.
VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 0.5, 1e-320, 1e9, 1.1e9, 1e20, 1e308, -1e308, 2**31, 2**53, 2**64, 10**400,
    float("nan"), float("inf"), -float("inf"), "", "a", "#ff0000", "#zz", "\x00", "\u202e", "x" * 10_000,
    "sha256:" + "0" * 64, "http://127.0.0.1:1/secret", "file:///etc/passwd", "../../etc/passwd", [], [[]], {},
    {"type": "sphere"}, [0, 0, 0], [1e20] * 3, [0.0] * 16, ["a"], {"texture": "none"},
    {"texture": "t", "channel": "a"},
    [[0, 0, 0]] * 3, list(range(1000)),
]  # fmt: skip
WORDS = (b"\xff\xff\xff\xff", b"\0\0\0\0", b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f", b"\1\0\0\0")
TEXTS = (b"999999999", b"-1", b"nan", b"1e999", b"\n", b" ", b"\0", b"/", b"..", b"{", b'"')
KEYS = ["type", "asset", "assets", "texture", "__proto__", "", "~/~1", "albedo", "transform", "emission", "\ud7ff"]


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every step into a document."""
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in children:
        yield (*path, key)
        yield from places(child, (*path, key))


def _times(number: float, factor: float) -> float:
    try:
        return number * factor
    except OverflowError:  # a whole number of hundreds of digits, from an earlier mutation
        return number


def mutated_document(document: Any, rng: random.Random) -> Any:
    """One to four values replaced, moved, doubled, left out or scaled; perhaps one more field.

    Half of the time only numbers are scaled a little, which often leaves a document valid.
    """
    out = copy.deepcopy(document)
    mild = rng.random() < 0.5
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        known = list(places(out))
        if not known:
            return rng.choice(VALUES)
        *way, last = rng.choice(known)
        holder = out
        for step in way:
            holder = holder[step]
        what = rng.randrange(7)
        if mild:
            if isinstance(holder[last], float | int) and not isinstance(holder[last], bool):
                holder[last] = _times(holder[last], rng.choice((0.0, 0.5, 0.999, 1.001, 1.5, 3.0, -1.0)))
        elif what == 0:
            del holder[last]
        elif what == 1 and isinstance(holder, list):
            holder[last : last + 1] = [copy.deepcopy(holder[last])] * rng.choice((2, 3, 100))
        elif what == 2 and isinstance(holder, dict):
            holder[rng.choice(KEYS)] = copy.deepcopy(rng.choice(VALUES))
        elif what == 3 and isinstance(holder[last], int | float) and not isinstance(holder[last], bool):
            holder[last] = _times(holder[last], rng.choice((-1, 0, 1e-30, 1e30, 1e9, 2)))
        elif what == 4:
            other = out
            for step in rng.choice(known):
                try:
                    other = other[step]
                except (KeyError, IndexError, TypeError):
                    break
            holder[last] = copy.deepcopy(other)
        else:
            holder[last] = copy.deepcopy(rng.choice(VALUES))
    return out


def mutated_json(document: Any, rng: random.Random) -> bytes:
    """As it would be sent; one in ten is broken as text too."""
    data = json.dumps(mutated_document(document, rng)).encode("utf-8", "surrogatepass")
    return mutated_bytes(data, rng) if rng.random() < 0.1 else data


def mutated_bytes(data: bytes, rng: random.Random) -> bytes:
    """Some bytes changed, cut out, doubled or put in; numbers that claim much; or the file cut off."""
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        if not out:
            break
        at = rng.randrange(len(out))
        what = rng.randrange(7)
        if what == 0:
            out[at] ^= 1 << rng.randrange(8)
        elif what == 1:
            out[at : at + 4] = rng.choice(WORDS)
        elif what == 2:
            del out[at : at + rng.choice((1, 4, 100))]
        elif what == 3:
            out[at:at] = out[at : at + rng.choice((1, 16, 300))]
        elif what == 4:
            del out[at:]
        elif what == 5:
            out[at:at] = rng.choice(TEXTS)
        else:
            out[at] = rng.randrange(256)
    return bytes(out)
