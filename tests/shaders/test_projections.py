"""Textures by box and by sphere lie where docs/rendering.md says, in the shape's own space, on any shape."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from service.document import parse_scene
from service.document.transform import Transform
from service.pack import pack
from service.problems import InvalidDocument
from tests.documents import Few
from tests.extremes.scenes import icosphere
from tests.normal_maps import facing
from tests.rendering import Images, document, render
from tests.shaders.textured import BARE, at
from tests.shaders.textured import BOX as UNMOVED

Doc = dict[str, Any]
RNG = np.random.default_rng(11)
N = 6
PIXELS = RNG.random((N, N, 3), np.float32)
STEP = (np.arange(64, dtype=np.float32) + 0.5) / 64
RIGHT = np.broadcast_to(STEP[None, :, None], (64, 64, 3)).copy()  # grows by 1 for a unit of u
IMAGES = Images(pixels=PIXELS, right=RIGHT, up=np.rot90(RIGHT).copy(), bent=facing(0.6, 0, 0.8),
                bent_up=facing(0, 0.6, 0.8))  # fmt: skip

PLACED = {"translate": [3, -1, 2], "rotate": [20, 50, -10], "scale": [0.5, 2, 0.8]}
MIRRORED = {"translate": [-4, 1, 0], "rotate": [0, 30, 0], "scale": [-1, 1.5, 1]}
BOX = {**UNMOVED, "min": [4, -2, -3], "max": [6, 2, 3]}  # its middle is [5, 0, 0]
BALL = {"type": "sphere", "center": [0, 3, 0], "radius": 2, "material": "m"}
MESH = {**icosphere("m", 1), "smooth": False}
MIDDLES = {"box": [5, 0, 0], "sphere": [0, 3, 0], "mesh": [0, 0, 0]}
SIDES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


def on(shape: Doc) -> list[tuple[np.ndarray, np.ndarray]]:
    """Places in the shape's own space, from its middle, and the normals there: some on every side of a box."""
    if shape["type"] == "box":
        half = (np.array(shape["max"]) - shape["min"]) / 2
        return [(np.where(n != 0, n * half, RNG.uniform(-0.9, 0.9, 3) * half), n) for n in SIDES]
    if shape["type"] == "sphere":
        directions = [n / np.linalg.norm(n) for n in SIDES + RNG.uniform(-0.5, 0.5, (6, 3))]
        return [(shape["radius"] * n, n) for n in directions]
    vertices = np.array(shape["vertices"])
    corners = [vertices[face] for face in shape["faces"][:: len(shape["faces"]) // 8]]
    weights = RNG.dirichlet([4, 4, 4], len(corners))
    return [(w @ v, np.cross(v[1] - v[0], v[2] - v[0])) for v, w in zip(corners, weights, strict=True)]


def by_box(q: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(uv, the directions of u and v) as the documentation has them."""
    axis = int(np.argmax(np.abs(n)))
    s = np.sign(n[axis])
    u = [[0, 0, -s], [1, 0, 0], [s, 0, 0]][axis]
    v = [[0, 1, 0], [0, 0, -s], [0, 1, 0]][axis]
    return np.array([q @ u, q @ v]), np.array(u), np.array(v)


def by_sphere(q: np.ndarray) -> np.ndarray:
    return np.array([0.5 + np.arctan2(q[0], q[2]) / (2 * np.pi), 1 - np.arccos(q[1] / np.linalg.norm(q)) / np.pi])


def bilinear(uv: np.ndarray) -> np.ndarray:
    x, y = uv[0] * N - 0.5, (1 - uv[1]) * N - 0.5
    i, j = int(np.floor(x)), int(np.floor(y))
    corners = itertools.product((0, 1), (0, 1))
    weights = [(a, b, (x - i if a else 1 - x + i) * (y - j if b else 1 - y + j)) for a, b in corners]
    return np.asarray(sum(w * PIXELS[(j + b) % N, (i + a) % N] for a, b, w in weights))


def world(shape: Doc, q: np.ndarray, n: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The place and the outward unit normal in the world, and the map there from the shape's own space."""
    matrix = Transform.model_validate(shape.get("transform", {})).matrix4() if "transform" in shape else np.eye(4)
    outward = np.linalg.inv(matrix[:3, :3]).T @ n
    place = matrix[:3, :3] @ (q + MIDDLES[shape["type"]]) + matrix[:3, 3]
    return place, outward / np.linalg.norm(outward), matrix[:3, :3]


def seen(
    gpu: Renderer, shape: Doc, place: np.ndarray, away: np.ndarray, layer: str, textures: Doc, material: Doc
) -> np.ndarray:
    """What a place shows. The other shapes are there for one kernel to serve all of them."""
    others = [{**other, "transform": {"translate": [0, -1e3, 0]}} for other in (BOX, BALL, MESH)]
    scene = document([shape, *others], {"m": {"type": "diffuse", "albedo": 0.5, **material}}, textures=textures,
                     camera=at(place.tolist(), away.tolist(), (0.01, 1, 0.02)))  # fmt: skip
    return render(gpu, scene, 1, layer, assets=IMAGES, width=8, height=8)[4, 4]


SHAPES = [
    {**shape, **({"transform": by} if by else {})}
    for shape, by in itertools.product((BOX, BALL, MESH), (None, PLACED, MIRRORED))
]


@pytest.mark.parametrize("mapping", ["box", "sphere"])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: f"{shape['type']}-{shape.get('transform', '')}"[:24])
def test_a_texture_lies_in_the_shapes_own_space(gpu: Renderer, shape: Doc, mapping: str) -> None:
    """The texel is that of the coordinates in float64, on all six sides of a box, a ball and a mesh without any
    coordinates, wherever a transform takes them."""
    placing = {"scale": [0.7, 0.4], "rotation": 30, "offset": [0.1, 0.2]}
    turn = np.array([[np.cos(np.pi / 6), -0.5], [0.5, np.cos(np.pi / 6)]])
    textures = {"t": {"asset": "pixels", "mapping": mapping, **placing}}
    for q, n in on(shape):
        place, outward, _ = world(shape, q, n)
        uv = by_box(q, n)[0] if mapping == "box" else by_sphere(q)
        got = seen(gpu, shape, place, 3 * outward, "albedo", textures, {"albedo": {"texture": "t"}})
        want = bilinear(turn @ (placing["scale"] * uv) + placing["offset"])
        np.testing.assert_allclose(got[:3], want, atol=3e-3, err_msg=f"{q} {n}")


@pytest.mark.parametrize("shape", [SHAPES[1], SHAPES[2], SHAPES[7]], ids=["box", "mirrored", "mesh"])
def test_red_is_along_u_and_green_along_v(gpu: Renderer, shape: Doc) -> None:
    """A normal map's red points the way in which u grows while v stays, also where a mesh has no tangents."""
    for q, n in on(shape)[:6]:
        place, outward, matrix = world(shape, q, n)
        _, u, v = by_box(q, n)
        grow_u, grow_v = (np.linalg.inv(matrix).T @ axis for axis in (u, v))
        along = np.cross(grow_v, outward)
        along *= np.sign(along @ grow_u) / np.linalg.norm(along)
        across = np.cross(outward, along)
        across *= np.sign(across @ grow_v)
        for name, direction in (("bent", along), ("bent_up", across)):
            textures = {"t": {"asset": name, "mapping": "box"}}
            got = seen(gpu, shape, place, 3 * outward, "normal", textures, {"normal_map": {"texture": "t"}})
            np.testing.assert_allclose(got[:3], 0.8 * outward + 0.6 * direction, atol=3e-3, err_msg=f"{q} {n}")


def test_a_height_rises_along_the_shape(gpu: Renderer) -> None:
    """A ramp on the side of a box tilts its normal by its slope, and a ball's along a meridian."""
    height = {"height": {"texture": "t", "scale": 0.3}}
    for q, n in on(BOX):
        _, u, v = by_box(q, n)
        for name, along in (("right", u), ("up", v)):
            textures = {"t": {"asset": name, "mapping": "box", "scale": [0.1, 0.1], "offset": [0.5, 0.5]}}
            got = seen(gpu, BOX, world(BOX, q, n)[0], 3 * n, "normal", textures, height)
            want = n - 0.03 * along
            np.testing.assert_allclose(got[:3], want / np.linalg.norm(want), atol=2e-4, err_msg=f"{q} {n}")
    n = np.array([0.6, 0, 0.8])
    textures = {"t": {"asset": "up", "mapping": "sphere"}}
    got = seen(gpu, BALL, world(BALL, 2 * n, n)[0], 3 * n, "normal", textures, height)
    want = n - 0.3 / (2 * np.pi) * np.array([0, 1, 0])
    np.testing.assert_allclose(got[:3], want / np.linalg.norm(want), atol=2e-4)


def test_a_cut_out_needs_no_coordinates(gpu: Renderer) -> None:
    """Opacity is read where a ray only passes a mesh, which knows less of the place there."""
    textures = {"t": {"type": "checker", "a": 0, "b": 1, "scale": [1, 1], "mapping": "box"}}
    cut = {"alpha": {"texture": "t"}}
    for q, n in on(MESH):
        place, outward, _ = world(MESH, q, n)
        odd = np.floor(by_box(q, n)[0]).sum() % 2 != 0
        alone = document([MESH], {"m": {"type": "diffuse", "albedo": 1, **cut}}, textures=textures,
                         environment={"type": "constant", "radiance": 1},
                         camera=at(place.tolist(), (1e-2 * outward).tolist(), (0.01, 1, 0.02)))  # fmt: skip
        depth = render(gpu, alone, 1, "depth", assets=IMAGES, width=8, height=8)[4, 4, 0]
        assert (0 < depth < 0.011) == odd, (q, n, depth)


def test_a_far_projection_is_the_mean_of_its_texels(gpu: Renderer) -> None:
    """Footprints work without coordinates: thousands of squares in a pixel are grey at the first sample."""
    textures = {"t": {"type": "checker", "a": 0, "b": 1, "scale": [500, 500], "mapping": "box"}}
    scene = document([BOX], {"m": {"type": "diffuse", "albedo": {"texture": "t"}}}, textures=textures,
                     camera={"position": [9, 9, 14], "target": [5, 0, 0], "vfov": 5})  # fmt: skip
    grey = render(gpu, scene, 1, "albedo", width=16, height=16)[..., 0]
    np.testing.assert_allclose(grey, 0.5, atol=0.02)


def refused(texture: Doc, **shape: Any) -> tuple[str, str]:
    read = {"texture": "t"}
    material = {"type": "diffuse", "albedo": read, "height": read}
    with pytest.raises(InvalidDocument) as error:
        pack(parse_scene(document([{**BARE, **shape}], {"m": material}, textures={"t": texture})), Few())
    ((pointer, detail),) = [(each.pointer, each.detail) for each in error.value.errors]
    return pointer, detail


def test_what_is_refused_says_what_would_be_right() -> None:
    checker = {"type": "checker", "a": 0, "b": 1}
    pointer, detail = refused(checker)
    assert pointer == "/shapes/0/uvs" and "mapping 'box' or 'sphere'" in detail
    pointer, detail = refused({**checker, "mapping": "box"}, displacement=True)
    assert pointer == "/textures/t/mapping" and "'uv'" in detail
    pointer, detail = refused({"asset": "grey", "mapping": "sphere", "uv": 1})
    assert pointer == "/textures/t/uv" and "mapping 'sphere' reads no coordinates" in detail
    pointer, _ = refused({**checker, "mapping": "tube"})
    assert pointer == "/textures/t/mapping"
