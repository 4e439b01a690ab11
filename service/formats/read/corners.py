"""Vertices for the corners of faces: corners that agree in all that they carry share one."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from service.formats.read.polygons import Longs

Ints = npt.NDArray[np.int32]
SHARES = 8


def distinct(
    corner: npt.NDArray[np.signedinteger], have: int, others: list[tuple[npt.NDArray[np.signedinteger], int]]
) -> tuple[Longs, Ints]:
    """(the first corner of each distinct set of indices, in their order; the number of each corner's set).

    `others`: indices from -1 on, and how many rows they count in. A share of the vertices at a time: sorting all
    corners of a million triangles at once takes a quarter of a gigabyte.
    """
    firsts, joined, count = [], np.empty(len(corner), np.int32), 0
    step = max(have // SHARES, 1)
    for low in range(0, have, step):
        these = np.flatnonzero((corner >= low) & (corner < low + step))
        mixed = corner[these].astype(np.int64)
        for number, (place, rows) in enumerate(others):
            mixed = mixed * (rows + 1) + (place[these] + 1)
            if number < len(others) - 1:  # three indices of 31 bits don't fit into 64: two at a time
                mixed = np.unique(mixed, return_inverse=True)[1]
        _, first, inverse = np.unique(mixed, return_index=True, return_inverse=True)
        firsts.append(these[first])
        joined[these] = inverse + count
        count += len(first)
    return np.concatenate(firsts), joined


def numbered(rows: npt.NDArray[np.floating]) -> tuple[Longs, int]:
    """(n,) a number from 0 on for each row, equal for equal rows; and how many numbers there are."""
    key, count = np.zeros(len(rows), np.int64), 1
    for column in rows.T:
        values, inverse = np.unique(column, return_inverse=True)
        found, key = np.unique(key * len(values) + inverse.reshape(-1), return_inverse=True)
        key, count = key.reshape(-1), len(found)
    return key, count
