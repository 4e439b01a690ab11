"""ICC profiles and CICP codes: what the numbers of a picture stand for, as files say it."""

from __future__ import annotations

import struct
from functools import cache

import numpy as np

from service.displays import Encoding

# Chromaticities x and y of red, green and blue [ITU-R BT.709, SMPTE EG 432-1, ITU-R BT.2020]; the white is D65.
PRIMARIES = {
    "rec709": ((0.64, 0.33), (0.3, 0.6), (0.15, 0.06)),
    "p3": ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06)),
    "rec2020": ((0.708, 0.292), (0.17, 0.797), (0.131, 0.046)),
}
WHITE = (0.3127, 0.329)
D50 = np.array([0.9642, 1.0, 0.8249])  # the white of a profile's connection space [ICC.1:2022, 7.2.16]
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_SRGB_CURVE = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)  # of type 3: (a x + b)^g, below d c x
_CODES = {"rec709": 1, "rec2020": 9, "p3": 12}, {"srgb": 13, "pq": 16, 2.2: 4}  # ITU-T H.273, tables 2 and 3


def cicp(encoding: Encoding) -> tuple[int, int] | None:
    """The codes of primaries and transfer of ITU-T H.273; None where it has none."""
    primaries, transfers = _CODES
    transfer = transfers.get(encoding.transfer)
    return None if transfer is None else (primaries[encoding.primaries], transfer)


def xyz_matrix(primaries: tuple[tuple[float, float], ...]) -> np.ndarray:
    """XYZ from linear values of these primaries, white having Y = 1."""
    columns = np.array([_xyz(*xy) for xy in primaries]).T
    return np.asarray(columns * np.linalg.solve(columns, _xyz(*WHITE)))


@cache
def profile(encoding: Encoding) -> bytes | None:
    """A display profile of version 4 [ICC.1:2022]; None for PQ, whose white has no place in one."""
    if encoding.transfer == "pq":
        return None
    scale = np.diag((BRADFORD @ D50) / (BRADFORD @ _xyz(*WHITE)))
    adapted = np.linalg.inv(BRADFORD) @ scale @ BRADFORD
    columns = (adapted @ xyz_matrix(PRIMARIES[encoding.primaries])).T
    srgb = encoding.transfer == "srgb"
    values = _SRGB_CURVE if srgb else (float(encoding.transfer),)
    curve = b"para" + struct.pack(">IHH", 0, 3 if srgb else 0, 0) + _fixed(values)
    name = f"{encoding.primaries} {encoding.transfer}" if encoding != Encoding("p3") else "Display P3"
    tags = [("desc", _text(name)), ("cprt", _text("CC0")), ("wtpt", _place(D50))]
    tags += [("chad", b"sf32\0\0\0\0" + _fixed(adapted.ravel()))]
    tags += [(f"{channel}XYZ", _place(column)) for channel, column in zip("rgb", columns, strict=True)]
    tags += [(f"{channel}TRC", curve) for channel in "rgb"]
    table, data = struct.pack(">I", len(tags)), b""
    start = 128 + 4 + 12 * len(tags)
    for tag, body in tags:
        table += tag.encode() + struct.pack(">II", start + len(data), len(body))
        data += body + b"\0" * (-len(body) % 4)
    size = start + len(data)
    made = struct.pack(">6H", 2026, 1, 1, 0, 0, 0)  # one date for all, so that equal pictures give equal files
    head = struct.pack(">I4sI4s4s4s", size, b"\0" * 4, 0x04400000, b"mntr", b"RGB ", b"XYZ ") + made + b"acsp"
    head = (head.ljust(68, b"\0") + _fixed(D50)).ljust(128, b"\0")
    return head + table + data


def _xyz(x: float, y: float) -> np.ndarray:
    return np.array([x / y, 1.0, (1 - x - y) / y])


def _fixed(values: object) -> bytes:
    """Numbers with 16 bits after the point."""
    return bytes(np.rint(np.asarray(values, float) * 65536).astype(">i4").data)


def _place(xyz: np.ndarray) -> bytes:
    return b"XYZ \0\0\0\0" + _fixed(xyz)


def _text(text: str) -> bytes:
    body = text.encode("utf-16-be")
    return b"mluc" + struct.pack(">3I2s2sII", 0, 1, 12, b"en", b"US", len(body), 28) + body
