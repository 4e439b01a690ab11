"""Words as meshes: capitals of three by five squares, for the labels of charts."""

from __future__ import annotations

import numpy as np

from service.document.presets import ply

# Rows from above, three bits each.
GLYPHS = {
    "A": 0o25755, "B": 0o65656, "C": 0o34443, "D": 0o65556, "E": 0o74647, "F": 0o74644, "G": 0o34553, "H": 0o55755,
    "I": 0o72227, "L": 0o44447, "M": 0o57755, "N": 0o65555, "O": 0o25552, "P": 0o65644, "R": 0o65655, "S": 0o34216,
    "T": 0o72222, "U": 0o55557, "0": 0o25552, "1": 0o26227, "2": 0o61247, "5": 0o74616, "7": 0o71222, ".": 0o00002,
    " ": 0,
}  # fmt: skip
ADVANCE = 4  # squares from one letter to the next


def written(lines: list[tuple[str, float, float, float]], size: float) -> bytes:
    """A binary PLY in the plane z = 0 that faces +Z. `lines`: (words, x, y, side) about whose middle height y they
    stand; `side` is where x lies in them: 0 at their left end, 1 at the right one. `size`: metres of a square."""
    corners = np.concatenate(
        [_squares(words) * size + _start(words, x, y, side, size) for words, x, y, side in lines]
    )
    flat = np.concatenate([corners, np.zeros_like(corners[..., :1])], axis=-1).reshape(-1, 3).round(6) + 0.0
    first = np.arange(len(corners))[:, None] * 4
    faces = np.concatenate([first + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    return ply.encode(dict(zip("xyz", flat.T, strict=True)), faces)


def _start(words: str, x: float, y: float, side: float, size: float) -> tuple[float, float]:
    return x - side * (len(words) * ADVANCE - 1) * size, y - 2.5 * size


def _squares(words: str) -> np.ndarray:
    """The corners of all squares that are black, (n, 4, 2), counter-clockwise."""
    places = [
        (ADVANCE * k + column, 4 - row)
        for k, letter in enumerate(words.upper())
        for row in range(5)
        for column in range(3)
        if GLYPHS[letter] >> (3 * (4 - row) + 2 - column) & 1
    ]
    return np.array(places, dtype=float)[:, None] + [[0, 0], [1, 0], [1, 1], [0, 1]]
