"""Many pictures on one, each under what tells it from the others."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from PIL import Image, ImageDraw, ImageFont

PAPER, INK, FAINT, EMPTY = (255, 255, 255), (20, 20, 20), (110, 110, 110), (226, 226, 226)
GAP = 8  # pixels between pictures, and around all
SMALLEST_FONT, LARGEST_FONT = 10.0, 24.0
FONT_SHARE = 1 / 14  # of a picture's width
WIDE = 8  # pictures in a row, at most, of a list that has no second axis

Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


@dataclass(frozen=True)
class ContactSheet:
    """A table of pictures of `cell` pixels, width and height. With `rows` there is a name at the left of each row and
    one above each column; without, `columns` are a list that is set in lines, each name under its picture. `heading`
    stands on top."""

    cell: tuple[int, int]
    columns: Sequence[str]
    rows: Sequence[str] = ()
    heading: Sequence[str] = ()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels; nothing is drawn for it."""
        across, down = self._shape()
        line = self._line()
        width = self._margin() + across * (self.cell[0] + GAP) + GAP
        body = down * (self.cell[1] + GAP + (0 if self.rows else line)) + (line if self.rows else 0)
        return width, GAP + len(self.heading) * line + body + GAP

    def drawn(self, picture: Callable[[int], Image.Image | None], missing: Callable[[int], str]) -> Image.Image:
        """The sheet. `picture` gives the k-th in RGB, row by row, scaled to the cell here; where it is None the cell
        says what `missing` does."""
        sheet = Image.new("RGB", self.size, PAPER)
        draw, font = ImageDraw.Draw(sheet), self._font()
        line, (across, _), left = self._line(), self._shape(), self._margin() + GAP
        for i, text in enumerate(self.heading):
            draw.text((GAP, GAP + i * line), _cut(text, sheet.width - 2 * GAP, font), FAINT, font)
        top = GAP + len(self.heading) * line
        if self.rows:
            for i, name in enumerate(self.columns):
                _centred(draw, name, (left + i * (self.cell[0] + GAP), top), self.cell[0], font)
            top += line
        for k in range(len(self.columns) * max(len(self.rows), 1)):
            j, i = divmod(k, across)
            x = left + i * (self.cell[0] + GAP)
            y = top + j * (self.cell[1] + GAP + (0 if self.rows else line))
            if self.rows and i == 0:
                name = _cut(self.rows[j], self._margin() - GAP, font)
                draw.text((GAP, y + (self.cell[1] - line) // 2), name, INK, font)
            self._put(sheet, draw, (x, y), picture(k), missing(k))
            if not self.rows:
                _centred(draw, self.columns[k], (x, y + self.cell[1] + GAP // 4), self.cell[0], font)
        return sheet

    def _put(
        self,
        sheet: Image.Image,
        draw: ImageDraw.ImageDraw,
        at: tuple[int, int],
        picture: Image.Image | None,
        word: str,
    ) -> None:
        if picture is not None:
            sheet.paste(
                picture if picture.size == self.cell else picture.resize(self.cell, Image.Resampling.LANCZOS), at
            )
            return
        draw.rectangle((*at, at[0] + self.cell[0] - 1, at[1] + self.cell[1] - 1), EMPTY)
        _centred(draw, word, (at[0], at[1] + (self.cell[1] - self._line()) // 2), self.cell[0], self._font())

    def _shape(self) -> tuple[int, int]:
        """Pictures across and down."""
        if self.rows:
            return len(self.columns), len(self.rows)
        across = min(len(self.columns), WIDE, max(1, math.ceil(math.sqrt(len(self.columns) * 1.5))))
        return across, math.ceil(len(self.columns) / across)

    def _margin(self) -> int:
        """For the names of rows: what the longest takes, up to a picture's width."""
        if not self.rows:
            return 0
        longest = max(self._font().getlength(name) for name in self.rows)
        return min(math.ceil(longest), self.cell[0]) + GAP

    def _font(self) -> Font:
        return ImageFont.load_default(min(max(self.cell[0] * FONT_SHARE, SMALLEST_FONT), LARGEST_FONT))

    def _line(self) -> int:
        """Pixels from one line of text to the next."""
        return math.ceil(1.5 * min(max(self.cell[0] * FONT_SHARE, SMALLEST_FONT), LARGEST_FONT))


def _centred(draw: ImageDraw.ImageDraw, text: str, at: tuple[int, int], width: int, font: Font) -> None:
    text = _cut(text, width, font)
    draw.text((at[0] + (width - font.getlength(text)) / 2, at[1]), text, INK, font)


def _cut(text: str, width: float, font: Font) -> str:
    """As much of a text as fits, with three dots where something is missing."""
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(text + "...") > width:
        text = text[:-1]
    return text + "..."
