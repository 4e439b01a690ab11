"""Colours of an OBJ file's vertices: numbers after their places, or ZBrush's comments. sRGB -> linear, as those of
other formats."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from service.colorimetry import decode_srgb
from service.formats.read.polygons import Longs
from service.formats.types import Doubles, Floats

BYTES = 10  # colours beyond it are bytes, no bright ones


@dataclass
class VertexColors:
    """The colours found so far: rows with the number of the first vertex, the numbers after its place, how many
    numbers it has; and those of comments, one vertex after the other."""

    rows: list[tuple[int, Doubles, Longs]] = field(default_factory=list)
    comments: list[bytes] = field(default_factory=list)

    def add(self, at: int, more: Doubles, counts: Longs) -> None:
        self.rows.append((at, more, counts))

    def add_comments(self, comments: list[bytes]) -> None:
        self.comments += comments

    def resolved(self, vertices: int, warnings: list[str]) -> Floats | None:
        """(n, 3), linear; None where no vertex has a colour."""
        if self.rows:
            if self.comments:
                warnings.append(
                    "the colours of its #MRGB comments are not used: its vertices have colours of their own"
                )
            return self._of_rows(vertices, warnings)
        return self._of_comments(vertices, warnings) if self.comments else None

    def _of_rows(self, vertices: int, warnings: list[str]) -> Floats:
        """Of `x y z r g b`, or `x y z w r g b`; of seven numbers whose last alone is always 1, `x y z r g b a`."""
        found = np.ones((vertices, 3))
        colored = np.zeros(vertices, bool)
        sevens = np.concatenate([more[counts == 7] for _, more, counts in self.rows])
        is_alpha = bool(len(sevens) and (sevens[:, 3] == 1).all() and (sevens[:, 0] != 1).any())
        for at, more, counts in self.rows:
            where = np.flatnonzero((counts == 6) | (counts == 7))
            first = np.where((counts[where] == 7) & (not is_alpha), 1, 0)
            found[at + where] = np.take_along_axis(more[where], first[:, None] + np.arange(3), axis=1)
            colored[at + where] = True
        if not colored.all():
            _tell_white(int((~colored).sum()), warnings)
        lost = ~np.isfinite(found).all(axis=1)
        if lost.any():
            warnings.append(f"the colours of {int(lost.sum())} vertices are not finite; they are shown white")
            found[lost], colored[lost] = 1.0, False
        most = found[colored].max(initial=0)
        if 1 < most <= 255 and (most > BYTES or (found[colored] == np.floor(found[colored])).all()):
            warnings.append(f"its vertices' colours reach {most:g}; they are taken for 0 to 255")
            found[colored] /= 255
        beyond = int(np.count_nonzero(((found < 0) | (found > 1)).any(axis=1)))
        if beyond:
            warnings.append(f"the colours of {beyond} vertices were clamped to 0..1")
        linear: Floats = decode_srgb(np.clip(found, 0, 1)).astype(np.float32)
        return linear

    def _of_comments(self, vertices: int, warnings: list[str]) -> Floats:
        """Of `#MRGB` and eight hexadecimal digits for each vertex: a mask, which is not read, red, green, blue."""
        found = np.full((vertices, 3), 255, np.uint8)
        at, bad = 0, 0
        for comment in self.comments:
            digits = b"".join(comment.split())
            try:
                texels = np.frombuffer(bytes.fromhex(digits[: len(digits) // 8 * 8].decode("ascii")), np.uint8)
            except ValueError:
                texels, bad = np.full(len(digits) // 8 * 4, 255, np.uint8), bad + 1
            rows = texels.reshape(-1, 4)[: max(vertices - at, 0), 1:]
            found[at : at + len(rows)] = rows
            at += len(texels) // 4
        if bad:
            warnings.append(f"{bad} of its #MRGB comments are no hexadecimal digits; their vertices are shown white")
        if at < vertices:
            _tell_white(vertices - at, warnings)
        elif at > vertices:
            warnings.append(
                f"its #MRGB comments have {at} colours for {vertices} vertices; the last ones are not used"
            )
        linear: Floats = decode_srgb(found / 255).astype(np.float32)
        return linear


def _tell_white(count: int, warnings: list[str]) -> None:
    warnings.append("1 vertex has no colour; it is" if count == 1 else f"{count} vertices have no colour; they are")
    warnings[-1] += " shown white"
