"""Textures are averaged over the footprint of a ray, and not at all where they are magnified."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.footprint import scene_bytes
from gpu.kernels.cache import KernelCache
from gpu.kernels.source import SHADERS
from gpu.layout import texture_records
from gpu.layout.bindings import Slot
from gpu.layout.texture_records import Texels
from gpu.picture import filters
from gpu.tables.mip_levels import mip_levels, srgb_of_bytes
from service.document import parse_scene
from service.pack import pack
from tests.probing import PROBES
from tests.rendering import Images, document, render
from tests.shaders.textured import QUAD

Doc = dict[str, Any]
RNG = np.random.default_rng(4)
HALF, WIDTH, HEIGHT, FOV = 2000.0, 48, 32, 50.0  # of the plane, m; of the picture, pixels; degrees
TILE = np.array([[0.1, 0.9], [0.9, 0.1]], np.float32)  # row 0 is the upper one: the cell at the origin is light
CHECKERS = {
    "checker": {"type": "checker", "a": 0.9, "b": 0.1, "scale": [2 * HALF, 2 * HALF]},
    "image": {"asset": "tile", "scale": [HALF, HALF]},
}
ASSETS = Images(tile=np.kron(TILE, np.ones((128, 128), np.float32))[..., None])


def closed_form(places: int) -> np.ndarray:
    """(HEIGHT, WIDTH): the mean of the checker over each pixel, one place drawn in each of places^2 parts of it."""
    rng, k = np.random.default_rng(1), HEIGHT * places
    x = (np.arange(WIDTH * places)[None, :] + rng.random((k, WIDTH * places))) / places - WIDTH / 2
    y = HEIGHT / 2 - (np.arange(k)[:, None] + rng.random(x.shape)) / places
    tan = np.tan(np.radians(FOV / 2)) / (HEIGHT / 2)
    down, ahead = np.array([-0.4, -1]) / np.hypot(0.4, 1)  # the camera is 1 m above the plane and looks along -z
    dy, dz = y * tan * -ahead + down, y * tan * down + ahead
    t = np.where(dy < 0, -1 / np.minimum(dy, -1e-9), np.inf)
    px, pz = t * x * tan, -t * dz
    seen = (np.abs(px) < HALF) & (np.abs(pz) < HALF)
    with np.errstate(invalid="ignore"):
        even = (np.floor(px) + np.floor(pz)) % 2 == 0
    values = np.where(seen, np.where(even, 0.9, 0.1), 0)
    return values.reshape(HEIGHT, places, WIDTH, places).mean((1, 3))


def plane(texture: Doc) -> Doc:
    quad = {
        "type": "quad",
        "origin": [-HALF, -1, HALF],
        "u": [2 * HALF, 0, 0],
        "v": [0, 0, -2 * HALF],
        "material": "m",
    }
    camera = {"position": [0, 0, 0], "target": [0, -0.4, -1], "vfov": FOV}
    lit = {"type": "constant", "radiance": 1, "background": False}
    return document([quad], {"m": {"type": "diffuse", "albedo": {"texture": "t"}}}, camera=camera,
                    textures={"t": texture}, environment=lit)  # fmt: skip


@pytest.mark.parametrize("texture", CHECKERS)
def test_a_checker_up_to_the_horizon_errs_little_at_once(gpu: Renderer, texture: str) -> None:
    """Against the closed form of the checker itself: at 16 samples at most twice as much as at 256."""
    want = closed_form(96)
    few, many = (
        np.sqrt(((render(gpu, plane(CHECKERS[texture]), samples, assets=ASSETS, width=WIDTH, height=HEIGHT,
                         estimator="bsdf")[..., 0] - want) ** 2).mean())
        for samples in (16, 256)
    )  # fmt: skip
    assert many < 0.02 and few < 2 * many


def test_up_close_nothing_is_averaged(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the bit what lookups of points give, as long as a pixel is narrower than a texel."""
    image = RNG.integers(0, 256, (24, 32, 3)).astype(np.uint8)
    scene = document([QUAD], {"m": {"type": "diffuse", "albedo": {"texture": "t"}}}, textures={"t": {"asset": "i"}},
                     environment={"type": "constant", "radiance": 1})  # fmt: skip
    near = render(gpu, scene, 4, assets=Images(i=image), width=64, height=64)
    far = {**scene, "camera": {"position": [0, 0, 90], "target": [0, 0, 0]}}
    small = render(gpu, far, 4, assets=Images(i=image), width=64, height=64)
    monkeypatch.setattr(filters, "FOOTPRINT", dict.fromkeys(filters.FOOTPRINT, 0.0))
    assert np.array_equal(near, render(gpu, scene, 4, assets=Images(i=image), width=64, height=64))
    assert not np.array_equal(small, render(gpu, far, 4, assets=Images(i=image), width=64, height=64))


@pytest.mark.parametrize("size", [(64, 64), (7, 100), (300, 1), (33, 512)])
@pytest.mark.parametrize("wrap", ["clamp", "repeat"])
def test_every_level_is_found(gpu: Renderer, size: tuple[int, int], wrap: str) -> None:
    """A ramp, averaged over a footprint, is what it is in the middle, whatever the level."""
    height, width = size
    image = np.zeros((height, width, 3), np.float32)
    image[..., 0] = (np.arange(width) + 0.5) / width
    image[..., 1] = 1 - (np.arange(height)[:, None] + 0.5) / height
    scene = document([QUAD], {"m": {"type": "diffuse", "albedo": 0, "emission": {"texture": "t"}}},
                     textures={"t": {"asset": "i", "wrap": wrap}})  # fmt: skip
    loaded = gpu.load(pack(parse_scene(scene), Images(i=image)).arrays)
    kernels = KernelCache(gpu.context, (PROBES, SHADERS))
    kernel = kernels.get("footprint.comp", loaded.defines(RenderSettings(8, 8)))
    asks = np.empty((512, 4), np.float32)
    asks[:, :2] = 0.25 + 0.5 * RNG.random((512, 2))
    asks[:, 2:] = 2.0 ** RNG.uniform(-10, -1, (512, 2))
    ask, answer = gpu.context.buffer(asks.tobytes()), gpu.context.buffer(reserve=asks.nbytes)
    loaded.bind()
    ask.bind_to_storage_buffer(int(Slot.SUM))
    answer.bind_to_storage_buffer(int(Slot.OUTPUT))
    kernel["count"].value = len(asks)
    kernel.run(len(asks) // 64)
    got = np.frombuffer(answer.read(), np.float32).reshape(-1, 4)
    # A level's texel is as wide as half of the longer axis, but for the rounding of levels and of sides.
    sides = np.array([width, height])
    texel = 1 + (asks[:, 2:] * sides).max(axis=1, keepdims=True)
    assert (np.abs(got[:, :2] - asks[:, :2]) <= 0.5 * asks[:, 2:] + 0.75 * texel / sides).all()
    for thing in (ask, answer, loaded, kernels):
        thing.release()


def test_levels_are_means_of_light() -> None:
    image = RNG.integers(0, 256, (12, 20, 4)).astype(np.uint8)
    for kind, decoded in ((Texels.SRGB, srgb_of_bytes()), (Texels.LINEAR, np.arange(256) / 255)):
        levels = list(mip_levels(image, kind))
        assert [level.shape[1::-1] for level in levels] == texture_records.level_sizes(20, 12)
        mean = decoded[levels[-1][0, 0, :3]]
        np.testing.assert_allclose(mean, decoded[image[..., :3]].mean((0, 1)), atol=0.005)
        assert levels[-1][0, 0, 3] == pytest.approx(image[..., 3].mean(), abs=0.51)
    floats = list(mip_levels(image / np.float32(255), Texels.LINEAR))
    np.testing.assert_allclose(floats[-1][0, 0], (image / 255).mean((0, 1)), rtol=1e-5)


TILT = np.radians(8)


def test_roughness_takes_over_the_normals_that_a_level_loses(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Normals that lean by one angle to four sides lose a variance of 1 / cos - 1 along each axis [Toksvig 2005]."""
    lean = np.sin(TILT) * np.array([[[1, 0], [0, 1]], [[0, -1], [-1, 0]]])
    normals = np.concatenate([lean, np.full((2, 2, 1), np.cos(TILT))], -1)
    blocks = (0.5 + 0.5 * normals).astype(np.float32).repeat(8, 0).repeat(8, 1)
    image = np.tile(blocks, (4, 4, 1))
    (*_, top) = mip_levels(np.concatenate([image, np.ones((64, 64, 1), np.float32)], -1), Texels.NORMALS)
    lost = 1 / np.cos(TILT) - 1
    np.testing.assert_allclose(top[0, 0], [0.5, 0.5, 1, np.sqrt(lost)], atol=1e-4)

    def lit(material: Doc) -> np.ndarray:
        metal = {"type": "principled", "base_color": 1, "metallic": 1, **material}
        scene = document([QUAD], {"m": metal}, textures={"n": {"asset": "n", "scale": [40, 40]}},
                         camera={"position": [0, 0, 8], "target": [0, 0, 0], "vfov": 14},
                         lights=[{"type": "directional", "direction": [0.15, 0.1, -1], "irradiance": 3}])  # fmt: skip
        picture = render(gpu, scene, 64, assets=Images(n=image), width=16, height=16, filter="blackman_harris")
        return np.asarray(picture[2:-2, 2:-2, 0])

    mapped = lit({"roughness": 0.45, "normal_map": {"texture": "n"}})
    rougher = lit({"roughness": (0.45**4 + 2 * lost) ** 0.25})
    np.testing.assert_allclose(mapped, rougher, rtol=0.01)
    monkeypatch.setattr(filters, "FOOTPRINT", dict.fromkeys(filters.FOOTPRINT, 0.0))
    bumps = lit({"roughness": 0.45, "normal_map": {"texture": "n"}})
    flat = lit({"roughness": 0.45})
    assert abs(mapped.mean() - bumps.mean()) < 0.4 * abs(flat.mean() - bumps.mean()), "GGX is no Gaussian"


def test_cut_out_textures_keep_their_coverage_far_away(gpu: Renderer) -> None:
    leaf = np.full((64, 64, 4), 200, np.uint8)
    leaf[..., 3] = np.where(RNG.random((64, 64)) < 0.3, 255, 0)
    material = {"type": "diffuse", "albedo": {"texture": "t"}, "alpha": {"texture": "t", "channel": "a"}}
    scene = document([QUAD], {"m": {**material, "alpha_cutoff": 0.5}},
                     textures={"t": {"asset": "t", "scale": [9, 9]}},
                     camera={"position": [0, 0, 8], "target": [0, 0, 0], "vfov": 14},
                     environment={"type": "constant", "radiance": 1})  # fmt: skip
    near = {**scene, "camera": {"position": [0, 0, 0.5], "target": [0, 0, 0], "vfov": 14}}
    far, close = (
        render(gpu, s, 256, "alpha", assets=Images(t=leaf), max_bounces=0)[4:-4, 4:-4] for s in (scene, near)
    )
    assert far.mean() == pytest.approx(close.mean(), abs=0.03)


def test_levels_count_in_the_memory_of_a_scene() -> None:
    """A third of a square image; none for opacity alone, which is looked up at points."""
    image = Images(i=np.zeros((64, 64, 4), np.uint8))
    base = document([QUAD], {"m": {"type": "diffuse", "albedo": 0.5}})
    bare = scene_bytes(pack(parse_scene(base), image).arrays)
    for material, texels in (
        ({"albedo": {"texture": "t"}}, 64 * 64 * 4 // 3),
        ({"albedo": 0.5, "alpha": {"texture": "t", "channel": "a"}}, 64 * 64),
        ({"albedo": {"texture": "t"}, "alpha": {"texture": "t", "channel": "a"}}, 64 * 64 * 4 // 3),
    ):
        scene = document([QUAD], {"m": {"type": "diffuse", **material}}, textures={"t": {"asset": "i"}})
        arrays = pack(parse_scene(scene), image).arrays
        assert arrays.textures is not None and len(arrays.textures.texels) == texels
        assert scene_bytes(arrays) > bare + 4 * texels - 1
