"""Things that stand on a table: glasses and what is in them, a perfume bottle, a candle. Bodies that lie in one
another overlap by a hair, for shapes with priorities.
"""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.mesh import (
    Mesh,
    denser,
    filleted,
    joined,
    lathe,
    on_the_right,
    rounded_box,
    smooth,
    waves,
)

# A tumbler of whisky, in units of a decimetre: as the scene has it.
OUTSIDE, INSIDE, FOOT, TUMBLER_TALL = 0.5, 0.45, 0.44, 1.0  # radii at the rim and at the foot, height
BOTTOM, FILLED = 0.17, 0.52  # heights of the glass's inner bottom and of the whisky
OVERLAP = 0.003  # that a liquid reaches into its glass: without it air would be between them
MENISCUS = 0.022  # height to which it climbs the wall
# A glass of water.
WATER_RADIUS, WATER_WALL, WATER_TALL, WATER_FILLED = 0.36, 0.022, 1.25, 0.86


def tumbler() -> bytes:
    """A heavy glass with a thick bottom and a rounded rim; it stands on y = 0.001."""
    mesh = Mesh()
    rim = (OUTSIDE - INSIDE) / 2
    lathe(mesh, filleted([
        (0, 0.012, 0), (FOOT - 0.07, 0.012, 0.01), (FOOT - 0.06, 0.001, 0.008), (FOOT, 0.001, 0.05),
        (OUTSIDE, TUMBLER_TALL, rim * 0.98), (INSIDE, TUMBLER_TALL, rim * 0.98), (0.4, BOTTOM, 0.12), (0, BOTTOM, 0),
    ], steps=6), around=128)  # fmt: skip
    return mesh.file()


def whisky() -> bytes:
    """The liquid that fills the tumbler: it climbs the glass a little."""
    mesh = Mesh()
    lathe(mesh, _liquid(BOTTOM, 0.4, INSIDE, TUMBLER_TALL, FILLED, 0.12), around=128)
    return mesh.file()


def _liquid(bottom: float, low: float, high: float, tall: float, filled: float, corner: float):  # type: ignore[no-untyped-def]
    """Within a wall that goes from the radius `low` at the bottom to `high` at the top."""
    lean = (high - low) / (tall - bottom)
    edge = low + lean * (filled + MENISCUS - bottom) + OVERLAP
    body = filleted(
        [(0, bottom - OVERLAP, 0), (low + OVERLAP, bottom - OVERLAP, corner), (edge, filled + MENISCUS, 0)], steps=6
    )
    away = np.array([0, 0.006, 0.018, 0.04, 0.08, 0.16])  # from the wall; the surface falls off exponentially
    top = [(edge - x, filled + MENISCUS * float(np.exp(-x / 0.022))) for x in away]
    return joined(body, smooth([*top, (0.0, filled)], steps=3))


def water_glass() -> bytes:
    """A tall thin glass with a heavy foot."""
    mesh = Mesh()
    inside = WATER_RADIUS - WATER_WALL
    lathe(mesh, filleted([
        (0, 0.006, 0), (WATER_RADIUS - 0.08, 0.001, 0.01), (WATER_RADIUS - 0.04, 0.001, 0.035),
        (WATER_RADIUS, WATER_TALL, WATER_WALL * 0.49), (inside, WATER_TALL, WATER_WALL * 0.49),
        (inside - 0.04, 0.1, 0.09), (0, 0.1, 0),
    ], steps=6), around=128)  # fmt: skip
    return mesh.file()


def water() -> bytes:
    mesh = Mesh()
    inside = WATER_RADIUS - WATER_WALL
    lathe(mesh, _liquid(0.1, inside - 0.04, inside, WATER_TALL, WATER_FILLED, 0.09), around=128)
    return mesh.file()


def ice() -> bytes:
    """A cube of ice about 0, half melted: its edges are round, its faces uneven."""
    mesh = Mesh()

    def melted(p: np.ndarray, n: np.ndarray) -> np.ndarray:
        return np.asarray(p + n * (0.006 * waves(p, 5, 0.16) - 0.012 * (1 - np.abs(n).max(-1)))[..., None])

    rounded_box(mesh, (0.18, 0.17, 0.18), 0.055, steps=6, flats=(12, 12, 12), moved=melted)
    return mesh.file()


# A perfume bottle: a block of glass with a hollow, a collar and a cap.
BOTTLE_HALF = (0.46, 0.56, 0.24)  # metres: of the block of glass
BOTTLE_WALL = 0.075  # of its sides; the bottom is twice as thick


def bottle() -> bytes:
    """The block about 0 with its hollow, which is round at its edges."""
    mesh = Mesh()
    rounded_box(mesh, BOTTLE_HALF, 0.05, steps=6, flats=(2, 2, 2))
    rounded_box(
        mesh,
        (BOTTLE_HALF[0] - BOTTLE_WALL, BOTTLE_HALF[1] - 1.35 * BOTTLE_WALL, BOTTLE_HALF[2] - BOTTLE_WALL),
        0.06,
        steps=8,
        flats=(2, 2, 2),
        hollow=True,
    )
    return mesh.file()


def collar() -> bytes:
    """A ring with two grooves, from y = 0 up."""
    mesh = Mesh()
    lathe(mesh, filleted([
        (0, 0.0, 0), (0.15, 0.0, 0.008), (0.15, 0.035, 0.006), (0.14, 0.04, 0.004), (0.14, 0.048, 0.004),
        (0.15, 0.053, 0.006), (0.15, 0.088, 0.006), (0.14, 0.093, 0.004), (0.14, 0.101, 0.004),
        (0.15, 0.106, 0.006), (0.15, 0.14, 0.01), (0, 0.14, 0),
    ], steps=3), around=96)  # fmt: skip
    return mesh.file()


def cap() -> bytes:
    """A block about 0 with rounded edges."""
    mesh = Mesh()
    rounded_box(mesh, (0.2, 0.19, 0.2), 0.028, steps=6, flats=(2, 2, 2))
    return mesh.file()


# A candle that has burnt for a while: wax with a pool and drips, a flame, a plate with a rim.
RADIUS, TALL = 0.24, 0.8  # metres
WICK = 0.62  # height of the melted wax about the wick
DRIPS = ((0.4, 0.5), (1.5, 0.3), (2.9, 0.62), (4.1, 0.38), (5.2, 0.55))  # the angle of each, and how far down it came
FLAME, FLAME_FOOT = 0.3, 0.1  # heights of the flame and of its blue foot


def wax() -> bytes:
    """It stands on y = 0.001; its pool is 2 cm below the rim."""
    mesh = Mesh()
    line = filleted([
        (0, 0.001, 0), (RADIUS, 0.001, 0.02), (RADIUS, 0.2, 0.05), (RADIUS, 0.4, 0.05), (RADIUS, 0.6, 0.05),
        (RADIUS, TALL, 0.03), (RADIUS - 0.055, TALL, 0.022), (RADIUS - 0.075, TALL - 0.05, 0.05),
        (0.0, TALL - 0.055, 0),
    ], steps=5)  # fmt: skip
    # Drips bend what would be straight.
    points = denser(line[0], 0.025)
    lathe(mesh, (points, on_the_right(points)), around=144, shape=_ran)
    return mesh.file()


def _ran(angles: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Wax that ran down, thick at its lower end."""
    grown = np.zeros(np.broadcast_shapes(angles.shape, heights.shape))
    for at, length in DRIPS:
        apart = np.abs((angles - at + math.pi) % (2 * math.pi) - math.pi) * RADIUS
        end = TALL - length
        along = np.clip((heights - end) / 0.05, 0, 1) ** 0.5
        fat = 0.034 + 0.026 * np.exp(-(((heights - end - 0.045) / 0.04) ** 2))
        grown += fat * along * np.exp(-((apart / 0.03) ** 2))
    fade = np.clip((TALL - 0.005 - heights) / 0.05, 0, 1)
    return np.asarray(1 + grown / RADIUS * fade + 0.006 * np.sin(3 * angles + 5 * heights))


def flame() -> bytes:
    """The outer flame from y = 0 up, pointed above."""
    return _turned(
        [(0.0, 0.0), (0.032, 0.012), (0.056, 0.06), (0.06, 0.11), (0.044, 0.19), (0.018, 0.26), (0.0, FLAME)]
    )


def flame_foot() -> bytes:
    """The blue part round the wick."""
    return _turned([(0.0, -0.008), (0.036, 0.0), (0.062, 0.045), (0.056, 0.075), (0.03, 0.09), (0.0, FLAME_FOOT)])


def _turned(points: list[tuple[float, float]]) -> bytes:
    mesh = Mesh()
    lathe(mesh, smooth(points), around=48)
    return mesh.file()


def plate() -> bytes:
    """A dish whose rim rises; the candle stands on 0.03."""
    mesh = Mesh()
    lathe(mesh, filleted([
        (0, 0.006, 0), (0.3, 0.006, 0.004), (0.31, 0.001, 0.004), (0.34, 0.001, 0.01), (0.37, 0.012, 0.06),
        (0.56, 0.075, 0.011), (0.55, 0.1, 0.011), (0.36, 0.03, 0.06), (0, 0.03, 0),
    ], steps=5), around=128)  # fmt: skip
    return mesh.file()
