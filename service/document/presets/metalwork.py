"""A watch, and the flank of a car."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.mesh import (
    Curve,
    Mesh,
    bent_normals,
    denser,
    filleted,
    lathe,
    on_the_right,
    rounded_box,
)

CASE, DIAL = 1.0, 0.8  # radii: of the case, of the dial
HEIGHT = 0.42  # of the case; the dial lies at 0.26
STRAP, PADDING = 0.44, 0.055  # half its width at the case, half its thickness


def case() -> bytes:
    """The ring of the case, its bezel and what is under the dial, on y = 0."""
    mesh = Mesh()
    lathe(mesh, filleted([
        (0, 0.0, 0), (0.82, 0.0, 0.05), (0.97, 0.1, 0.05), (CASE, 0.14, 0.03), (CASE, 0.28, 0.02),
        (0.985, 0.31, 0.01), (0.975, 0.315, 0.006), (0.95, 0.37, 0.03), (0.87, HEIGHT, 0.02),
        (0.835, HEIGHT, 0.015), (DIAL, 0.36, 0.012), (DIAL, 0.24, 0.008), (0, 0.24, 0),
    ], steps=4), around=144)  # fmt: skip
    for x in (-1, 1):
        for z in (-1, 1):
            _lug(mesh, x * (STRAP + 0.08), z)
    return mesh.file()


def _lug(mesh: Mesh, x: float, side: float) -> None:
    """An arm that holds the strap, bent down to its end."""

    def bent(p: np.ndarray, _: np.ndarray) -> np.ndarray:
        down = np.clip((p[..., 2] + 0.3) / 0.6, 0, 1)
        moved = p * np.stack([np.ones_like(down), 1 - 0.45 * down, np.ones_like(down)], axis=-1)
        moved[..., 1] -= 0.14 * down**2
        return np.asarray((moved + np.array([x, 0.2, 1.02])) * [1, 1, side])

    rounded_box(mesh, (0.075, 0.12, 0.32), 0.035, steps=4, flats=(2, 2, 6), moved=bent)


def markers() -> bytes:
    """Batons at the hours, two at twelve, and fine strokes at the minutes."""
    mesh, hour, minute = Mesh(), Mesh(), Mesh()
    rounded_box(hour, (0.022, 0.018, 0.1), 0.008, steps=2)
    rounded_box(minute, (0.005, 0.004, 0.02), 0.0018, steps=2)
    for k in range(60):
        # Angles run clockwise from twelve, which is at -Z, as seen from above.
        c, s = math.cos(k * math.pi / 30), math.sin(k * math.pi / 30)
        turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
        if k % 5:
            mesh.copy(minute, turn, turn @ [0, 0.244, -0.745])
        else:
            for aside in (-0.035, 0.035) if k == 0 else (0.0,):
                mesh.copy(hour, turn, turn @ [aside, 0.252, -0.63])
    return mesh.file()


def hands() -> bytes:
    """Ten past ten, and a second hand with its tail."""
    mesh = Mesh()
    _hand(mesh, math.radians(305), -0.12, 0.46, 0.03, 0.275)
    _hand(mesh, math.radians(60), -0.14, 0.68, 0.024, 0.292)
    _hand(mesh, math.radians(204), -0.2, 0.72, 0.006, 0.308)
    lathe(
        mesh, filleted([(0, 0.245, 0), (0.045, 0.245, 0.002), (0.045, 0.32, 0.01), (0, 0.325, 0)], steps=3), around=32
    )
    return mesh.file()


def _hand(mesh: Mesh, angle: float, tail: float, tip: float, half_width: float, height: float) -> None:
    """A blade with a ridge along its middle."""
    c, s = math.cos(angle), math.sin(angle)

    def placed(p: np.ndarray, _: np.ndarray) -> np.ndarray:
        along = (p[..., 2] + 0.5) * (tip - tail) + tail
        taper = np.clip((tip - along) / (0.35 * tip), 0.12, 1)
        x = p[..., 0] * taper
        y = p[..., 1] * (1 - 0.6 * (p[..., 0] / half_width) ** 2) + height
        return np.stack([c * x + s * along, y, s * x - c * along], axis=-1)

    rounded_box(mesh, (half_width, 0.008, 0.5), 0.003, steps=2, flats=(2, 1, 6), moved=placed)


def crown() -> bytes:
    """A knob with a milled side, about +Y from 0; a transform lays it to the side."""
    mesh = Mesh()
    lathe(
        mesh,
        filleted(
            [
                (0, -0.1, 0),
                (0.05, -0.1, 0.004),
                (0.06, 0.0, 0.004),
                (0.13, 0.01, 0.015),
                (0.13, 0.15, 0.02),
                (0, 0.165, 0),
            ]
        ),
        around=120,
        shape=lambda angles, heights: 1 + 0.035 * np.cos(30 * angles) * (heights > 0.02) * (heights < 0.14),
    )
    return mesh.file()


def strap() -> bytes:
    """Both halves: padded leather that leaves the lugs, bends down to the table and lies on it."""
    mesh = Mesh()
    for side in (-1.0, 1.0):
        _half_strap(mesh, side)
    return mesh.file()


def _spine() -> Curve:
    """(distance from the middle of the watch, height) along the strap, and the normals above."""
    line, _ = filleted([(0.98, 0.2, 0), (1.32, 0.14, 0.3), (1.9, 0.075, 1.2), (5.4, 0.075, 0)], steps=10)
    points = denser(line, 0.08)
    return points, -on_the_right(points)


def _half_strap(mesh: Mesh, side: float) -> None:
    (points, normals), half = _spine(), PADDING
    path = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    turn = np.linspace(0, 2 * math.pi, 41)
    width = STRAP * (1 - 0.16 * np.clip(path / 3.5, 0, 1))
    # A superellipse: flat below, padded above.
    x = np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** 0.35
    y = np.sign(np.sin(turn)) * np.abs(np.sin(turn)) ** 0.7
    fat = np.where(
        y > 0, half * (0.75 + 0.9 * np.exp(-((path / 1.3) ** 2)))[:, None] * (1 - 0.3 * np.abs(x) ** 6), half
    )
    across, up = width[:, None] * x, fat * y
    grid = np.stack(
        [
            across,
            points[:, None, 1] + up * normals[:, None, 1],
            side * (points[:, None, 0] + up * normals[:, None, 0]),
        ],
        axis=-1,
    )
    rough = np.stack(
        np.broadcast_arrays(x, y * normals[:, None, 1] + 0 * up, side * y * normals[:, None, 0]), axis=-1
    )
    bent = bent_normals(grid, rough)
    uvs = np.stack(np.broadcast_arrays(path[:, None], across + half * y), axis=-1)
    mesh.add(grid, bent, uvs)
    for end in (0, -1):
        middle = grid[end].mean(axis=0)
        face = np.stack([np.broadcast_to(middle, grid[end].shape), grid[end]])
        out = np.array([0, 0, side * (-1 if end == 0 else 1)])
        mesh.add(face, np.broadcast_to(out, face.shape), np.stack([uvs[end], uvs[end]]))


def stitches() -> bytes:
    """Thread along both edges of the strap, in short pieces."""
    mesh, stitch = Mesh(), Mesh()
    rounded_box(stitch, (0.011, 0.011, 0.045), 0.01, steps=2)
    points, _ = _spine()
    path = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1).cumsum()])
    for at in np.arange(0.3, 3.4, 0.13):
        z, y = (float(np.interp(at, path, points[:, k])) for k in (0, 1))
        aside = 0.86 * STRAP * (1 - 0.16 * min(at / 3.5, 1))
        lift = 0.86 * PADDING * (0.75 + 0.9 * math.exp(-((at / 1.3) ** 2)))
        for x in (-aside, aside):
            for side in (-1, 1):
                mesh.copy(stitch, np.eye(3), (x, y + lift, side * z))
    return mesh.file()


# The flank of a car: a door and a fender with a crease along them, and the gap between.
DOOR, FENDER = (-3.4, 0.44), (0.46, 3.4)  # metres along the car; the gap lies in between
GAP_EDGE = 0.03  # depth to which the sheet is bent inward at the gap
ACROSS = 150  # points over the height


def door() -> bytes:
    return _panel(DOOR, gap=1)


def fender() -> bytes:
    return _panel(FENDER, gap=0)


def _flank(x: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Points over places along the car and 0..1 from the sill to the shoulder, which leans back to the bonnet."""
    y = 1.15 * v
    crease = 0.74 + 0.035 * x - 0.004 * x**2
    over, under = np.maximum(y - crease, 0), np.maximum(crease - y, 0)
    # Hollow below the crease, round above it; the crease itself is bent over half a centimetre.
    z = 0.18 - 0.62 * over**2 - 0.9 * over**4 - 0.34 * (1 - np.exp(-under / 0.1)) * 0.3
    z += 0.1 * np.exp(-(((y - 0.32) / 0.26) ** 2)) - 0.35 * np.maximum(0.12 - y, 0)
    z += 0.02 * np.cos(x * 0.6) - 0.012 * x**2
    z += 0.1 * np.exp(-(((x - 1.5) / 0.75) ** 2) - ((y - 0.5) / 0.34) ** 2)  # over the wheel
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _panel(span: tuple[float, float], gap: int) -> bytes:
    """`gap`: the end (0 or 1) at which it is bent inward."""
    mesh = Mesh()
    x = np.linspace(*span, 64)
    v = np.linspace(0, 1, ACROSS)
    edge = span[gap]
    rows = [_flank(np.full(1, place)[:, None], v)[0] for place in x]
    turn = np.linspace(0, math.pi / 2, 6)[1:]
    radius = 0.007
    fold = []
    for angle in turn:
        step = radius * math.sin(angle) * (1 if gap else -1)
        row = _flank(np.full(1, edge)[:, None], v)[0] + [step, 0, -radius * (1 - math.cos(angle))]
        fold.append(row)
    fold.append(fold[-1] - [0, 0, GAP_EDGE])
    rows = rows + fold if gap else fold[::-1] + rows
    grid = np.array(rows)
    rough = np.broadcast_to([0.0, 0.2, 1.0], grid.shape).copy()
    side = slice(len(x), None) if gap else slice(0, len(fold))
    rough[side] = [1.0 if gap else -1.0, 0, 0.3]
    mesh.add(grid, bent_normals(grid, rough), grid[..., :2])
    return mesh.file()
