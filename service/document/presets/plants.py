"""An orange, its slices and its leaf; and a tree in winter."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.mesh import Mesh, bent_normals, waves

RADIUS = 0.45
SLICE = 0.11  # thickness
SEGMENTS = 10
PITH, FLESH, CORE = 0.965, 0.885, 0.09  # where the pith, the flesh and the core end, in radii
PEEL_COLOR = np.array([0.92, 0.3, 0.012])
PITH_COLOR = np.array([0.93, 0.83, 0.6])
FLESH_COLOR, PALE_FLESH = np.array([0.93, 0.27, 0.008]), np.array([0.97, 0.45, 0.05])
LEAF_LONG, LEAF_WIDE = 0.95, 0.2  # length, and half its greatest width


def orange() -> bytes:
    """A whole one about 0, with its stem's dimple above."""
    mesh = Mesh()
    _peel(mesh, 0.0, math.pi)
    return mesh.file()


def half() -> bytes:
    """Its cut face lies on y = 0 and looks up."""
    mesh = Mesh()
    _peel(mesh, math.pi / 2, math.pi)
    _face(mesh, 0.0, 1.0, seed=4)
    return mesh.file()


def slice_() -> bytes:
    """A wheel about 0 whose axis is Y."""
    mesh = Mesh()
    for side in (-1.0, 1.0):
        _face(mesh, side * SLICE / 2, side, seed=4)
    angles = np.linspace(0, 2 * math.pi, 129)
    y = np.array([-SLICE / 2, 0.0, SLICE / 2])
    out = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=1)
    grid = (out[:, None] * RADIUS) + np.array([0, 1.0, 0]) * y[:, None]
    normals = np.broadcast_to(out[:, None], grid.shape)
    mesh.add(grid, normals, grid[..., :2], np.broadcast_to(PEEL_COLOR, grid.shape))
    return mesh.file()


def _peel(mesh: Mesh, begin: float, end: float) -> None:
    """From one polar angle to another: dimpled but for the edge of a cut."""
    polar = np.linspace(begin, end, round(80 * (end - begin) / math.pi) + 1)[:, None]
    angles = np.linspace(0, 2 * math.pi, 129)
    out = np.stack(
        np.broadcast_arrays(np.sin(polar) * np.sin(angles), np.cos(polar), np.sin(polar) * np.cos(angles)), -1
    )
    out[:, -1] = out[:, 0]
    bumps = waves(out * RADIUS, 8, 0.034, 48)
    keep = np.clip((polar - begin) / 0.06, 0, 1) if begin else np.ones_like(polar)
    stem = 0.05 * np.exp(-((polar / 0.16) ** 2))
    radius = RADIUS * (1 + keep * (0.0032 * np.minimum(bumps, 0.4) + 0.008 * waves(out, 2, 1.0)) - stem)
    grid = out * radius[..., None]
    normals = bent_normals(grid.swapaxes(0, 1), out.swapaxes(0, 1), closed=True).swapaxes(0, 1)
    tone = 1 + 0.06 * waves(out * RADIUS, 9, 0.25)
    green = np.exp(-((polar / 0.1) ** 2))[..., None] * np.array([-0.55, 0.05, 0.03])
    colors = np.clip(PEEL_COLOR * tone[..., None] + green, 0.005, 1)
    mesh.add(grid, normals, np.stack(np.broadcast_arrays(angles, polar), axis=-1), colors)


def _face(mesh: Mesh, height: float, side: float, seed: int) -> None:
    """A cut through the middle: its segments bulge a little between their skins."""
    share = np.concatenate([np.linspace(0, FLESH, 32), np.linspace(FLESH + 0.014, 1, 5)])[:, None]
    angles = np.linspace(0, 2 * math.pi, 161)
    draw = np.random.default_rng(seed)
    walls = (np.arange(SEGMENTS) + 0.16 * draw.normal(size=SEGMENTS)) * 2 * math.pi / SEGMENTS
    apart = np.abs((angles[:, None] - walls + math.pi) % (2 * math.pi) - math.pi).min(axis=1)
    skin = apart * share * RADIUS  # the distance to the nearest skin
    inside = (
        np.clip((FLESH - share) / 0.03, 0, 1)
        * np.clip((share - CORE) / 0.04, 0, 1)
        * np.clip((skin - 0.003) / 0.009, 0, 1)
    )
    place = (
        np.stack(np.broadcast_arrays(share * np.sin(angles), 0.0 * share, share * np.cos(angles)), axis=-1) * RADIUS
    )
    place[:, -1] = place[:, 0]
    inside[:, -1] = inside[:, 0]
    # Vesicles point to the middle: long along the radius, narrow across it.
    cells = np.stack(np.broadcast_arrays(np.sin(angles) * 0.5, share * 0.14, np.cos(angles) * 0.5), axis=-1)
    grain = waves(cells, seed, 0.035, 40)
    grain[:, -1] = grain[:, 0]
    flesh = FLESH_COLOR + (PALE_FLESH - FLESH_COLOR) * np.clip(0.4 + 0.32 * grain, 0, 1)[..., None]
    colors = PITH_COLOR + (flesh - PITH_COLOR) * inside[..., None]
    rim = np.clip((share - PITH) / (1 - PITH), 0, 1)[..., None]
    colors = colors + (PEEL_COLOR - colors) * np.broadcast_to(rim, colors.shape)
    grid = (
        place
        + np.array([0, 1.0, 0]) * (height + side * inside * (0.006 + 0.0016 * grain) * (share < FLESH))[..., None]
    )
    up = np.broadcast_to([0.0, side, 0], grid.shape)
    normals = bent_normals(grid.swapaxes(0, 1), up.swapaxes(0, 1), closed=True).swapaxes(0, 1)
    mesh.add(grid, normals, place[..., [0, 2]], np.clip(colors, 0, 1))


def leaf() -> bytes:
    """A sheet along +X from 0 that bends down to its tip, with paler veins."""
    mesh = Mesh()
    t = np.linspace(0, 1, 81)[:, None]
    s = np.linspace(-1, 1, 49)
    wide = LEAF_WIDE * np.maximum(np.sin(math.pi * t**0.85), 0) ** 0.75 + 0.006
    z = wide * s
    ripple = 0.012 * np.sin(18 * t + 2 * s) * np.abs(s) ** 2
    y = 0.22 * t * (1 - t) * 1.6 - 0.1 * t**2 + 0.32 * np.abs(z) - 0.5 * np.abs(z) ** 1.6 + ripple
    grid = np.stack(np.broadcast_arrays(LEAF_LONG * t, y, z), axis=-1)
    # Side veins leave the midrib at a slant.
    slant = (t * 9 - np.abs(s) * 1.1) % 1
    veins = np.exp(-(((slant - 0.5) / 0.09) ** 2)) * 0.55 + np.exp(-((z / 0.008) ** 2))
    green = np.array([0.05, 0.19, 0.025]) * (1 + 0.12 * waves(grid, 6, 0.08))[..., None]
    colors = np.clip(green + np.array([0.12, 0.2, 0.05]) * np.clip(veins, 0, 1)[..., None], 0, 1)
    mesh.add(grid, bent_normals(grid, np.broadcast_to([0.0, 1, 0], grid.shape)), grid[..., [0, 2]], colors)
    return mesh.file()


# A tree in winter: branches of branches, as tubes that grow thinner.
TRUNK_TALL, TRUNK_THICK = 1.5, 0.15  # length and radius of the trunk, in metres; the whole is three times as high
LEVELS, AROUND = 6, 7  # of branching; sides of a tube
SHORTER, THINNER = 0.76, 0.66  # what a branch keeps of its parent's length and radius


def bare_tree() -> bytes:
    mesh = Mesh()
    _grow(mesh, np.random.default_rng(17), np.zeros(3), np.array([0.03, 1.0, 0.0]), TRUNK_TALL, TRUNK_THICK, LEVELS)
    return mesh.file()


def _grow(
    mesh: Mesh,
    draw: np.random.Generator,
    start: np.ndarray,
    way: np.ndarray,
    length: float,
    radius: float,
    level: int,
) -> None:
    way = way / np.linalg.norm(way)
    bend = np.cross(way, draw.normal(size=3))
    t = np.linspace(0, 1, 4)[:, None]
    middle = start + length * (t * way + 0.12 * t * (1 - t) * bend)
    side = np.cross(way, [0.0, 0.0, 1.0] if abs(way[2]) < 0.8 else [1.0, 0, 0])
    side /= np.linalg.norm(side)
    turn = np.linspace(0, 2 * math.pi, AROUND + 1)[:, None]
    out = np.cos(turn) * side + np.sin(turn) * np.cross(way, side)
    out[-1] = out[0]
    grid = middle[:, None] + out * (radius * (1 - (1 - THINNER) * t))[:, None]
    mesh.add(grid, np.broadcast_to(out, grid.shape), np.stack(np.broadcast_arrays(turn[:, 0], t * length), axis=-1))
    if level == 0:
        return
    for k in range(3 if level in (LEVELS, 3) else 2):
        angle = 2.4 * k + draw.uniform(0, 2 * math.pi)
        spread = draw.uniform(0.35, 0.75)
        around = math.cos(angle) * side + math.sin(angle) * np.cross(way, side)
        ahead = way * math.cos(spread) + around * math.sin(spread) + np.array([0, 0.12, 0])
        _grow(mesh, draw, middle[-1], ahead, length * SHORTER * draw.uniform(0.75, 1.1), radius * THINNER, level - 1)
