"""The edge of a selection, from a layer of one sample a pixel."""

from __future__ import annotations

import math
import random
from collections import Counter
from typing import Any

from playwright.sync_api import Page

from tests.web.modules import call

SIDE = 64


def edge(page: Page, ids: list[list[int]], shape: int) -> Any:
    floats = [x for row in ids for id in row for x in (float(id), 0.0, 0.0, 1.0)]
    layer = {"floats": floats, "width": len(ids[0]), "height": len(ids)}
    return call(page, "document/contour.js", "contour", layer, shape)


def test_the_edge_of_a_ball_is_round_though_its_pixels_tell_at_random(page: Page) -> None:
    """A pixel at the edge says at random which of two shapes it shows."""
    chance, radius = random.Random(2), 20.0

    def id(i: int, j: int) -> int:
        x, y = i + chance.random() - 32, j + chance.random() - 32
        return 3 if math.hypot(x, y) < radius else 1

    lines = edge(page, [[id(i, j) for i in range(SIDE)] for j in range(SIDE)], 2)
    away = [math.hypot(x - 32, y - 32) for line in lines for x, y in (line[:2], line[2:])]
    assert radius - 0.3 < min(away) and max(away) < radius + 1.6, "close to it, and around it"
    ends = Counter((round(x, 6), round(y, 6)) for line in lines for x, y in (line[:2], line[2:]))
    assert set(ends.values()) == {2}, "it is closed"
    length = sum(math.dist(line[:2], line[2:]) for line in lines)
    assert length < 1.12 * 2 * math.pi * radius, "and does not go to and fro"


def test_what_is_thin_or_cut_by_the_picture_has_an_edge_and_what_is_not_seen_none(page: Page) -> None:
    rows = [[2 if j == 5 else 0 for _ in range(16)] for j in range(12)]
    lines = edge(page, rows, 1)
    xs, ys = ([value for line in lines for value in line[k::2]] for k in (0, 1))
    assert min(ys) > 4 and max(ys) < 7, "a line of one pixel"
    assert min(xs) < 3 and max(xs) > 13, "from one side of the picture to the other"
    assert edge(page, rows, 0) == []
