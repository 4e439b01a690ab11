"""An EXR of six faces is the environment that the same radiance is as a latitude-longitude image."""

from __future__ import annotations

import numpy as np
import pytest

from service.problems import AssetError
from service.server.assets import AssetStore
from tests import asset_files as make
from tests.documents import packed, sphere

CUBE = (b"envmap", b"envmap", b"\1")
LATLONG = (b"envmap", b"envmap", b"\0")
SIDE = 32
# The corners of the cube, as the figure in OpenEXR's documentation numbers them, and the four of each face.
CORNERS = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
FIGURE = (
    (3, 7, 1, 5),
    (6, 2, 4, 0),
    (6, 7, 2, 3),
    (0, 1, 4, 5),
    (7, 6, 5, 4),
    (2, 3, 0, 1),
)  # upper and lower


def radiance(d: np.ndarray) -> np.ndarray:
    """Smooth, and different in every direction."""
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    return (2 + d + 0.5 * d[..., [1, 2, 0]] * d).astype(np.float32)


def strip(side: int) -> np.ndarray:
    """Six faces whose outermost texels lie on the edges, between the corners of the figure."""
    t = np.linspace(0, 1, side)
    u, v = t[None, :, None], t[:, None, None]
    faces = []
    for four in FIGURE:
        a, b, c, d = CORNERS[list(four)]
        faces.append(radiance((a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v))
    return np.concatenate(faces)


def panorama(rows: int) -> np.ndarray:
    """Latitude from +90 degrees at the top; longitude 0, which is +Z, in the middle, and 90, +X, left of it."""
    latitude = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)[:, None]
    longitude = np.pi * (1 - (np.arange(2 * rows) + 0.5) / rows)[None]
    level = np.cos(latitude)
    x, y, z = np.broadcast_arrays(np.sin(longitude) * level, np.sin(latitude), np.cos(longitude) * level)
    return radiance(np.stack([x, y, z], axis=-1))


def test_six_faces_are_the_same_environment_as_a_panorama(store: AssetStore) -> None:
    cube = store.add(make.exr(strip(SIDE), more=(CUBE,)))
    flat = store.add(make.exr(panorama(2 * SIDE), more=(LATLONG,)))
    assert [each["detail"] for each in cube.warnings or ()] == [
        "its six faces of a cube are shown as a latitude-longitude image"
    ]
    assert flat.warnings is None and (cube.width, cube.height) == (flat.width, flat.height) == (4 * SIDE, 2 * SIDE)
    assert np.abs(store.image(cube.id).pixels - store.image(flat.id).pixels).max() < 0.01
    shown = [packed(sphere(), assets=store, environment={"type": "image", "asset": each.id}) for each in (cube, flat)]
    ours, theirs = (scene.arrays.environment for scene in shown)
    assert ours is not None and theirs is not None and np.abs(ours.texels - theirs.texels).max() < 0.01
    assert shown[0].warnings == [
        "/environment/asset: its six faces of a cube are shown as a latitude-longitude image"
    ]


@pytest.mark.parametrize("side", [1, 2, 3])
def test_the_smallest_cubes(store: AssetStore, side: int) -> None:
    """Each face is seen where it lies."""
    faces = np.repeat(np.arange(1, 7, dtype=np.float32), side * side).reshape(6 * side, side, 1)
    seen = store.image(store.add(make.exr(np.repeat(faces, 3, axis=2), more=(CUBE,))).id).pixels
    height, width = seen.shape[:2]
    assert (height, width) == (2 * side, 4 * side)
    assert (
        (seen[0] <= 5).all() and seen[0].mean() < 5 and set(np.unique(seen)) <= {1, 2, 3, 4, 5, 6, *np.unique(seen)}
    )


def test_a_bright_texel_keeps_its_power(store: AssetStore) -> None:
    faces = np.zeros((6 * 16, 16, 3), np.float32)
    faces[5 * 16 + 7, 8] = 1000  # near the middle of a face
    seen = store.image(store.add(make.exr(faces, more=(CUBE,))).id).pixels[..., 0]
    rows = len(seen)
    weights = np.cos(np.pi * (0.5 - (np.arange(rows) + 0.5) / rows))[:, None] * (np.pi / rows) ** 2
    assert (seen * weights).sum() == pytest.approx(1000 * (2 / 15) ** 2, rel=0.1)


@pytest.mark.parametrize("shape", [(8, 8), (24, 5), (36, 5)])
def test_other_shapes_are_no_cubes(store: AssetStore, shape: tuple[int, int]) -> None:
    with pytest.raises(AssetError, match=f"cube map; {shape[1]} x {shape[0]} texels are not six squares in a column"):
        store.add(make.exr(np.ones((*shape, 3), np.float32), more=(CUBE,)))
