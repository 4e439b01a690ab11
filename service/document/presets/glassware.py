"""Glasses and what is in them: bodies that overlap by a hair, for shapes with priorities."""

from __future__ import annotations

import numpy as np

from service.document.presets.mesh import Mesh, filleted, joined, lathe, rounded_box, smooth, waves

# A tumbler of whisky, in units of a decimetre: as the scene has it.
OUTSIDE, INSIDE, FOOT, TALL = 0.5, 0.45, 0.44, 1.0  # radii at the rim and at the foot, height
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
        (OUTSIDE, TALL, rim * 0.98), (INSIDE, TALL, rim * 0.98), (0.4, BOTTOM, 0.12), (0, BOTTOM, 0),
    ], steps=6), around=128)  # fmt: skip
    return mesh.file()


def whisky() -> bytes:
    """What fills the tumbler: it climbs the glass a little."""
    mesh = Mesh()
    lathe(mesh, _liquid(BOTTOM, 0.4, INSIDE, TALL, FILLED, 0.12), around=128)
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
