"""A perfume bottle: a block of glass with a hollow, a collar and a cap."""

from __future__ import annotations

from service.document.presets.mesh import Mesh, filleted, lathe, rounded_box

HALF = (0.46, 0.56, 0.24)  # metres: of the block of glass
WALL = 0.075  # of its sides; the bottom is twice as thick


def bottle() -> bytes:
    """The block about 0 with its hollow, which is round at its edges."""
    mesh = Mesh()
    rounded_box(mesh, HALF, 0.05, steps=6, flats=(2, 2, 2))
    rounded_box(
        mesh, (HALF[0] - WALL, HALF[1] - 1.35 * WALL, HALF[2] - WALL), 0.06, steps=8, flats=(2, 2, 2), hollow=True
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
