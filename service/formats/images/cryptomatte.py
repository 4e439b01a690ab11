"""Cryptomatte: which things cover how much of each pixel, by the hash of their names [Friedman and Jones 2015].

A layer has ranks, the largest share first; two of them make the channels R (id), G (share), B (id) and A (share) of
one level. An id is a hash whose bits are a float's; the manifest in the metadata tells whose it is.
"""

from __future__ import annotations

import json
import struct
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

LAYERS = {"shape_coverage": "CryptoObject", "material_coverage": "CryptoMaterial"}
ENVIRONMENT = "/environment"  # the name of what is behind all things, whether it is seen or not
_MASK = 0xFFFFFFFF
_KEY_DIGITS = 7  # of the hash of a layer's name, by which the metadata names the layer


@dataclass(frozen=True)
class Cryptomatte:
    """`coverage`: of each of LAYERS (height, width, 2 * ranks) float32, index + 1, or -1 for the environment, and
    share; `names` by index."""

    coverage: Mapping[str, npt.NDArray[np.float32]]
    names: Mapping[str, Sequence[str]]

    @property
    def pixels(self) -> list[npt.NDArray[np.float32]]:
        """The channels of all layers, in the order of `channels`."""
        return [self._hashed(layer) for layer in LAYERS]

    @property
    def channels(self) -> tuple[str, ...]:
        ranks = {layer: self.coverage[layer].shape[2] // 4 for layer in LAYERS}
        return tuple(
            f"{LAYERS[layer]}{level:02}.{c}" for layer in LAYERS for level in range(ranks[layer]) for c in "RGBA"
        )

    @property
    def metadata(self) -> dict[str, str]:
        out: dict[str, str] = {}
        for layer, name in LAYERS.items():
            key = f"cryptomatte/{f'{murmur3(name.encode()):08x}'[:_KEY_DIGITS]}"
            manifest = {each: f"{id_bits(each):08x}" for each in (*self.names[layer], ENVIRONMENT)}
            out |= {f"{key}/name": name, f"{key}/hash": "MurmurHash3_32", f"{key}/conversion": "uint32_to_float32"}
            out[f"{key}/manifest"] = json.dumps(manifest, separators=(",", ":"))  # in ASCII
        return out

    def _hashed(self, layer: str) -> npt.NDArray[np.float32]:
        bits = np.array([0, *map(id_bits, self.names[layer]), id_bits(ENVIRONMENT)], np.uint32)
        out = self.coverage[layer].copy()
        out[..., 0::2] = bits.view(np.float32)[out[..., 0::2].astype(np.int64)]
        return out


def names_of(scene: Any) -> dict[str, list[str]]:
    """The names of a document's shapes and materials. A shape without one, or with that of an earlier one, is called
    by its place, so that each has an id of its own."""
    seen: Counter[str] = Counter()
    shapes = []
    for i, shape in enumerate(scene["shapes"]):
        name, place = shape.get("name"), f"/shapes/{i}"
        shapes.append(place if name is None else f"{name} {place}" if seen[name] else name)
        seen[name] += 1
    return {"shape_coverage": shapes, "material_coverage": list(scene["materials"])}


def id_bits(name: str) -> int:
    """The bits of a name's id: those of its hash, without the exponents of floats that are denormal or no number."""
    bits = murmur3(name.encode())
    return bits ^ 1 << 23 if bits >> 23 & 0xFF in (0, 0xFF) else bits


def murmur3(data: bytes) -> int:
    """MurmurHash3_x86_32 by Austin Appleby, with seed 0."""
    value, whole = 0, len(data) - len(data) % 4
    for (word,) in struct.iter_unpack("<I", data[:whole]):
        value = _rotated(value ^ _mixed(word), 13) * 5 + 0xE6546B64 & _MASK
    if whole < len(data):
        value ^= _mixed(int.from_bytes(data[whole:], "little"))
    value ^= len(data)
    value = (value ^ value >> 16) * 0x85EBCA6B & _MASK
    value = (value ^ value >> 13) * 0xC2B2AE35 & _MASK
    return value ^ value >> 16


def _mixed(word: int) -> int:
    return _rotated(word * 0xCC9E2D51 & _MASK, 15) * 0x1B873593 & _MASK


def _rotated(word: int, by: int) -> int:
    return (word << by | word >> 32 - by) & _MASK
