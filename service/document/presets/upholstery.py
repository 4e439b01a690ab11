"""An armchair, and a cloth of linen with the picture of its weave."""

from __future__ import annotations

import math

import numpy as np

from service.document.presets.encoders import encode_exr
from service.document.presets.mesh import Mesh, bent_normals, filleted, lathe, rounded_box, waves

SEAT, SEAT_HEIGHT = (0.36, 0.1, 0.38), 0.4  # half sizes of the cushion, height of its middle
BACK, LEAN = (0.36, 0.36, 0.11), math.radians(12)
ARM = (0.1, 0.27, 0.43)
ACROSS, UP = 0.24, 0.26  # from button to button


def cushion() -> bytes:
    """The seat, thicker in the middle, with the dents of use."""
    mesh = Mesh()

    def filled(p: np.ndarray, n: np.ndarray) -> np.ndarray:
        x, _, z = (p[..., k] / SEAT[k] for k in range(3))
        puff = 0.03 * (1 - x**2) * (1 - z**2) - 0.012 * np.exp(-(x**2 + (z - 0.1) ** 2) / 0.2)
        return np.asarray(
            p
            + np.array([0, 1.0, 0]) * (puff * np.sign(n[..., 1]))[..., None]
            + n * (0.0025 * waves(p, 3, 0.14))[..., None]
        )

    rounded_box(mesh, SEAT, 0.055, steps=8, flats=(28, 4, 28), moved=filled)
    return mesh.file()


def back() -> bytes:
    """Tufted on its front: creases run from button to button and leave cushions between."""
    mesh = Mesh()

    def tufted(p: np.ndarray, n: np.ndarray) -> np.ndarray:
        a, b = p[..., 0] / ACROSS + p[..., 1] / UP, p[..., 0] / ACROSS - p[..., 1] / UP
        puff = (np.abs(np.sin(math.pi * a)) * np.abs(np.sin(math.pi * b)) + 0.002) ** 0.42
        edge = np.clip(np.minimum(BACK[0] - np.abs(p[..., 0]), BACK[1] - np.abs(p[..., 1])) / 0.09, 0, 1)
        deep = np.clip(n[..., 2], 0, 1) * edge * (0.06 * (puff - 1) + 0.02)
        return np.asarray(p + np.array([0, 0, 1.0]) * deep[..., None] + n * (0.0015 * waves(p, 4, 0.09))[..., None])

    rounded_box(mesh, BACK, 0.06, steps=8, flats=(56, 56, 4), moved=tufted)
    return mesh.file()


def buttons() -> bytes:
    """Where the creases of the back cross."""
    mesh, one = Mesh(), Mesh()
    lathe(
        one,
        filleted([(0, -0.004, 0), (0.017, -0.004, 0.003), (0.017, 0.004, 0.006), (0, 0.008, 0)], steps=4),
        around=24,
    )
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # from +Y to +Z
    for row in range(-2, 3):
        for column in range(-3, 4):
            x, y = column * ACROSS / 2, row * UP / 2
            if (row + column) % 2 == 0 and abs(x) < BACK[0] - 0.08 and abs(y) < BACK[1] - 0.08:
                mesh.copy(one, turn, (x, y, BACK[2] - 0.034))
    return mesh.file()


def arm() -> bytes:
    """A padded side, rolled outward above; it stands to the left, a mirrored one to the right."""
    mesh = Mesh()

    def rolled(p: np.ndarray, n: np.ndarray) -> np.ndarray:
        high = np.clip((p[..., 1] - 0.08) / 0.19, 0, 1)
        out = np.stack(
            [-0.045 * high**2 + p[..., 0] * 0.25 * high, 0.012 * high * (1 - (p[..., 0] / ARM[0]) ** 2), 0 * high],
            axis=-1,
        )
        return np.asarray(p + out + n * (0.002 * waves(p, 7, 0.16))[..., None])

    rounded_box(mesh, ARM, 0.075, steps=10, flats=(8, 20, 20), moved=rolled)
    return mesh.file()


def pillow() -> bytes:
    """A square one about 0 whose seam runs round it and whose corners are ears."""
    mesh = Mesh()
    half = 0.21

    def stuffed(p: np.ndarray, n: np.ndarray) -> np.ndarray:
        x, y = p[..., 0] / half, p[..., 1] / half
        full = np.sqrt(np.clip((1 - np.abs(x) ** 2.4) * (1 - np.abs(y) ** 2.4), 0, 1))
        pull = 1 - 0.09 * (1 - np.abs(x) ** 2) * (np.abs(y) ** 3) - 0.09 * (1 - np.abs(y) ** 2) * (np.abs(x) ** 3)
        creases = 1 + 0.02 * waves(np.stack([x, y, 0 * x], -1) * 0.2, 12, 0.1)
        return np.asarray(
            np.stack([p[..., 0] * pull, p[..., 1] * pull, p[..., 2] * (0.1 + 0.9 * full * creases)], axis=-1)
        )

    rounded_box(mesh, (half, half, 0.085), 0.03, steps=6, flats=(30, 30, 4), moved=stuffed)
    return mesh.file()


def leg() -> bytes:
    """From y = 0 up, thinner below."""
    mesh = Mesh()
    lathe(mesh, filleted([(0, 0, 0), (0.016, 0.0, 0.003), (0.032, 0.2, 0.004), (0, 0.2, 0)], steps=3), around=32)
    return mesh.file()


# Linen: a cloth with a few soft folds, and the picture of its weave.
CLOTH_HALF, CLOTH_STEPS = 9.0, 96  # metres from the middle to the edges; squares along an edge
THREADS, TEXELS = 16, 256  # of a tile of the weave, along each side


def linen_cloth() -> bytes:
    """A binary PLY, flat near the middle, where its highest point lies on y = 0; coordinates are metres."""
    mesh = Mesh()
    x = np.linspace(-1, 1, CLOTH_STEPS + 1)
    side = CLOTH_HALF * (0.25 * x + 0.75 * x**3)  # closer together where the picture looks
    xx, zz = np.meshgrid(side, side, indexing="ij")
    grid = np.stack([xx, np.zeros_like(xx), zz], axis=-1)
    far = np.hypot(xx, zz)
    folds = 0.045 * waves(grid * [0.7, 1, 1.5], 11, 1.1, 16) * np.clip((far - 0.5) / 1.2, 0, 1) ** 2
    grid[..., 1] = folds - np.maximum(folds.max(), 0) * np.clip((far - 0.5) / 1.2, 0, 1) ** 2
    mesh.add(grid, bent_normals(grid, np.broadcast_to([0.0, 1, 0], grid.shape)), grid[..., [0, 2]])
    return mesh.file()


def linen_weave() -> bytes:
    """A tile that repeats: threads over and under one another, uneven as flax is, lighter where they are higher."""
    draw = np.random.default_rng(3)
    t = (np.arange(TEXELS) + 0.5) / TEXELS * THREADS
    thick = 1 + 0.22 * draw.normal(size=(2, THREADS))
    tone = 1 + 0.05 * draw.normal(size=(2, THREADS))
    warp, weft = np.meshgrid(t, t, indexing="ij")
    i, j = warp.astype(int), weft.astype(int)
    over = (i + j) % 2 == 0

    def thread(across: np.ndarray, along: np.ndarray, fat: np.ndarray) -> np.ndarray:
        round_ = np.clip(1 - ((across % 1 - 0.5) * 2 / fat) ** 2, 0, 1) ** 0.5
        return np.asarray(round_ * (0.55 + 0.45 * np.sin(math.pi * (along % 1))))

    one, two = thread(warp, weft, thick[0][i]), thread(weft, warp, thick[1][j])
    height = np.where(over, np.maximum(one, 0.5 * two), np.maximum(two, 0.5 * one))
    color = (0.62 + 0.38 * height) * np.where(over, tone[0][i], tone[1][j])
    return encode_exr(np.clip(color, 0, 1)[..., None] * np.array([1.0, 0.985, 0.955]))
