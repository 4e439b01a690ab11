"""The cubemap and the analytic sky, against float64: where light comes from, how much, and how often it is picked."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.layout import LightKind, Uniforms
from gpu.layout.bindings import Slot
from gpu.tables import alias_table, sky
from service.document import parse_scene
from service.pack import pack
from service.pack.cache import PackCache
from service.problems import InvalidDocument
from tests import stats
from tests.marks import BY_ESTIMATOR
from tests.probing import Prober, prober_of
from tests.rendering import Images, document, render

FACES = ("px", "nx", "py", "ny", "pz", "nz")
CUBE = {"type": "cubemap", "assets": {name: name for name in FACES}}
SKY = {"type": "sky", "sun_elevation": 40, "sun_azimuth": 0}
UP = {"type": "quad", "origin": [-1, 0, 1], "u": [2, 0, 0], "v": [0, 0, -2], "material": "m"}  # faces +Y
FROM_ABOVE = {"position": [0, 4, 0], "target": [0, 0, 0], "up": [0, 0, -1], "vfov": 0.02}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def place(face: int, s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The contract's table: the direction, not of unit length, that a place on a face shows."""
    one, a, b = np.ones_like(s), 2 * s - 1, 2 * t - 1
    rows = [(one, -b, -a), (-one, -b, a), (a, one, b), (a, -one, -b), (a, -b, one), (-a, -b, -one)]
    return np.stack(rows[face], -1)


def cube(rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    return {name: (rng.random((n, n, 3)) ** 4).astype(np.float32) for name in FACES}


def packed(environment: dict[str, Any], images: dict[str, np.ndarray] | None = None, *shapes: dict[str, Any]) -> Any:
    return pack(parse_scene(document([*shapes], environment=environment)), Images(**images or {})).arrays


@pytest.fixture(scope="module")
def prober(gpu: Renderer) -> Prober:
    return prober_of(gpu)


class Probe:
    """environment_radiance and environment_light_sample of a document's environment, as they are in the kernel."""

    def __init__(self, gpu: Renderer, prober: Prober, environment: dict[str, Any], images: Any = None) -> None:
        self._scene = gpu.load(packed(environment, images))
        self._prober = prober
        self._frame = np.zeros((), Uniforms.dtype)
        self._scene.write_uniforms(self._frame)
        self._scene.bind()

    def _run(self, asks: np.ndarray, sample: int) -> list[np.ndarray]:
        inputs = {Slot.SUM: asks, Slot.ENVIRONMENT_CELLS: self._scene.arrays.environment.cells}
        outputs = (Slot.MOMENTS, Slot.OUTPUT)
        flags = self._scene.flags
        return self._prober.run(
            "environment.comp", len(asks), inputs, outputs, {"SAMPLE": sample}, flags, frame=self._frame
        )

    def look(self, d: np.ndarray) -> np.ndarray:
        """(n, 4): radiance and density towards directions (n, 3)."""
        return self._run(np.column_stack([d, np.zeros(len(d))]).astype(np.float32), 0)[0].astype(float)

    def sample(self, bits: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radiance with density (n, 4), and directions (n, 3), for two words of random bits each (n, 2)."""
        asks = np.column_stack([bits, np.zeros_like(bits)]).astype(np.uint32).view(np.float32)
        light, direction = self._run(asks, 1)
        return light.astype(float), direction[:, :3].astype(float)

    def close(self) -> None:
        self._scene.release()


def sphere(rng: np.random.Generator, n: int) -> np.ndarray:
    d = rng.normal(size=(n, 3))
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def turned(d: np.ndarray, degrees: float) -> np.ndarray:
    """R_y(degrees) d."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.stack([c * d[:, 0] + s * d[:, 2], d[:, 1], -s * d[:, 0] + c * d[:, 2]], 1)


def test_cube_texels_are_where_the_table_puts_them(gpu: Renderer, prober: Prober) -> None:
    n = 5
    images = cube(np.random.default_rng(1), n)
    rng = np.random.default_rng(2)
    probe = Probe(gpu, prober, {**CUBE, "rotation": 37, "scale": 2}, images)
    for face, name in enumerate(FACES):
        s, t = rng.random((2, 500))
        x, y = np.clip(s * n - 0.5, 0, n - 1), np.clip(t * n - 0.5, 0, n - 1)  # bilinear, within the face
        x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
        x1, y1 = np.minimum(x0 + 1, n - 1), np.minimum(y0 + 1, n - 1)
        fx, fy, im = (x - x0)[:, None], (y - y0)[:, None], images[name].astype(float)
        want = (im[y0, x0] * (1 - fx) + im[y0, x1] * fx) * (1 - fy) + (im[y1, x0] * (1 - fx) + im[y1, x1] * fx) * fy
        d = place(face, s, t)
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        np.testing.assert_allclose(probe.look(turned(d, 37))[:, :3], 2 * want, rtol=2e-4, atol=2e-6)
    probe.close()


@pytest.mark.parametrize("n", [1, 2, 7, 1024])
def test_solid_angles_of_a_face_are_a_sixth_of_the_sphere(n: int) -> None:
    solid = alias_table.cube_solid_angles(n)
    assert solid.sum() == pytest.approx(4 * np.pi / 6, rel=1e-9)
    assert solid.min() > 0
    middle = (np.arange(n) + 0.5) / n * 2 - 1
    r2 = 1 + middle[:, None] ** 2 + middle**2
    if n == 1024:
        np.testing.assert_allclose(solid, (2 / n) ** 2 / r2**1.5, rtol=3e-6)


def test_cube_tables_draw_by_footprint_and_every_lit_neighbour() -> None:
    n = 4
    texels = np.zeros((2 * n, 3 * n, 3), np.float32)
    texels[n + 1, n] = 1  # left column of pz: bilinear lookup does not reach py
    density, table = alias_table.cube_tables(texels)
    lit = np.zeros((2 * n, 3 * n), bool)
    lit[n : n + 3, n : n + 2] = True
    assert np.array_equal(density > 0, lit)
    assert density.sum() * (2 / n) ** 2 == pytest.approx(1, rel=1e-6)
    corners = {(int(c) & 0xFFFF, int(c) >> 16) for c in table["corner"]}
    assert corners == {(x, y) for y, x in np.argwhere(lit)}
    black, _ = alias_table.cube_tables(np.zeros_like(texels))
    solid = np.tile(alias_table.cube_solid_angles(n), (2, 3))
    np.testing.assert_allclose(black * (2 / n) ** 2, solid / (4 * np.pi), rtol=0.01)  # in whole cells


LIGHTS = {
    "cubemap": (CUBE, cube(np.random.default_rng(5), 3)),
    "cubemap of one texel": (CUBE, {name: np.full((1, 1, 3), k + 1, np.float32) for k, name in enumerate(FACES)}),
    "sky": ({**SKY, "rotation": 70}, None),
    "hazy sky, low sun": ({**SKY, "sun_elevation": 0.1, "turbidity": 9.5}, None),
    "sky without sun": ({**SKY, "sun": False}, None),
}


@pytest.mark.parametrize("name", LIGHTS)
def test_samples_follow_their_density_and_carry_the_light(gpu: Renderer, prober: Prober, name: str) -> None:
    """Chi-square over cells of latitude and longitude, the sun apart; and the irradiance of the whole sphere."""
    environment, images = LIGHTS[name]
    probe = Probe(gpu, prober, environment, images)
    rng = np.random.default_rng(7)
    n = 200_000
    light, d = probe.sample(rng.integers(0, 2**32, (n, 2), np.uint64).astype(np.uint32))
    assert (light[:, 3] > 0).all() and np.isfinite(light).all()
    np.testing.assert_allclose(np.linalg.norm(d, axis=1), 1, atol=1e-6)
    sun = packed(environment, images).environment.sun
    near = np.zeros(n, bool)
    share = 0.0
    if sun is not None:
        to_sun = turned(np.array(sun.direction)[None], environment.get("rotation", 0))
        near = ((d - to_sun) ** 2).sum(1) < 2 * sun.cap * 1.0001
        share = packed(environment, images).environment.sun_share
    fine = 40
    rows, columns = 16, 24
    y = 1 - (np.arange(rows * fine) + 0.5) * 2 / (rows * fine)
    phi = (np.arange(columns * fine) + 0.5) * 2 * np.pi / (columns * fine)
    r = np.sqrt(1 - y * y)[:, None]
    grid = np.stack(np.broadcast_arrays(r * np.sin(phi), y[:, None], r * np.cos(phi)), 2).reshape(-1, 3)
    density = probe.look(grid)[:, 3]
    if sun is not None:  # a grid this coarse cannot hold the disk
        density[((grid - to_sun) ** 2).sum(1) < 2 * sun.cap * 1.0001] = np.nan
        density = np.where(np.isnan(density), np.nanmedian(density), density)
    solid = 4 * np.pi / len(grid)
    expected = (density * solid).reshape(rows, fine, columns, fine).sum((1, 3)) * n
    assert expected.sum() / n == pytest.approx(1 - share, abs=3e-3)
    at = d[~near]
    azimuth = np.arctan2(at[:, 0], at[:, 2]) % (2 * np.pi)
    edges = np.linspace(-1, 1, rows + 1)
    observed = np.histogram2d(-at[:, 1], azimuth, [edges, np.linspace(0, 2 * np.pi, columns + 1)])[0]
    if sun is not None:
        assert near.mean() == pytest.approx(share, abs=5 * math.sqrt(share * (1 - share) / n) + 1e-4)
    expected *= observed.sum() / expected.sum()
    # Quadrature knows each cell to about .3 %: where a cell expects 1e4 samples that is a third of their noise.
    statistic = ((observed - expected) ** 2 / (expected + (0.004 * expected) ** 2 + 1e-9))[expected > 5].sum()
    assert statistic < 1.3 * (expected > 5).sum()
    assert stats.chi_square(observed, expected) > 1e-12
    got = (light[:, :3] / light[:, 3:]) @ LUMINANCE
    whole = probe.look(grid)[:, :3] @ LUMINANCE
    if sun is not None:
        whole[((grid - to_sun) ** 2).sum(1) < 2 * sun.cap * 1.0001] = np.median(whole)
    total = whole.sum() * solid
    if sun is None or sun.direction[1] > 0.01:  # of a lower one the horizon takes a part
        total += 0 if sun is None else float(sun.irradiance @ LUMINANCE)
        assert got.mean() == pytest.approx(total, rel=0.01)
    probe.close()


def test_faces_are_refused_by_name() -> None:
    def refused(**images: np.ndarray) -> list[str]:
        good = cube(np.random.default_rng(0), 4)
        with pytest.raises(InvalidDocument) as caught:
            packed(CUBE, {**good, **images})
        return [error.pointer for error in caught.value.errors]

    assert refused(nx=np.ones((4, 8, 3), np.float32)) == ["/environment/assets/nx"]
    assert refused(py=np.ones((8, 8, 3), np.float32)) == ["/environment/assets/py"]
    assert refused(px=np.ones((2, 2, 3), np.float32)) == ["/environment/assets/px"]
    with pytest.raises(InvalidDocument) as caught:
        parse_scene(document([], environment={"type": "cubemap", "assets": {"px": "a"}}))
    assert {e.pointer for e in caught.value.errors} == {f"/environment/assets/{name}" for name in FACES[1:]}


def test_negative_texels_of_a_face_are_told() -> None:
    images = cube(np.random.default_rng(0), 4)
    images["ny"][1, 2, 0] = -1
    result = pack(parse_scene(document([], environment=CUBE)), Images(**images))
    assert result.warnings == ["/environment/assets/ny: 1 negative texels raised to 0"]
    assert result.arrays.environment is not None and result.arrays.environment.texels.min() == 0


@pytest.mark.parametrize("estimator", BY_ESTIMATOR)
def test_a_cube_of_one_radiance_is_a_furnace(gpu: Renderer, estimator: str) -> None:
    images = {name: np.full((3, 3, 3), (2, 1, 0.5), np.float32) for name in FACES}
    ball = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}
    scene = document([ball], environment={**CUBE, "rotation": 20}, camera=camera)
    image = render(gpu, scene, 1024, assets=Images(**images), estimator=estimator, width=16, height=16)
    np.testing.assert_allclose(image[..., :3].mean((0, 1)), [1, 0.5, 0.25], rtol=0.01)


# ---- the sky


def test_the_sun_stands_where_azimuth_and_rotation_say(gpu: Renderer, prober: Prober) -> None:
    for azimuth, rotation, want in ((0, 0, (0, -1)), (90, 0, (1, 0)), (90, 90, (0, -1)), (0, 90, (-1, 0))):
        probe = Probe(gpu, prober, {**SKY, "sun_azimuth": azimuth, "rotation": rotation})
        e = math.radians(40)
        towards = np.array([[want[0] * math.cos(e), math.sin(e), want[1] * math.cos(e)]])
        aside = towards + np.array([[0, 0.01, 0]])
        looked = probe.look(np.concatenate([towards, aside / np.linalg.norm(aside)]))
        assert looked[0, 1] > 1e6 and looked[1, 1] < 1e3
        probe.close()


def test_the_map_is_the_model(gpu: Renderer, prober: Prober) -> None:
    probe = Probe(gpu, prober, {**SKY, "turbidity": 2.5, "ground_albedo": 0.6})
    d = sphere(np.random.default_rng(3), 20_000)
    e = math.radians(40)
    d = d[(d[:, 1] > math.sin(math.radians(1))) & (d @ sky.sun_direction(e) < math.cos(math.radians(2)))]
    want = sky.dome_radiance(d, e, 2.5, 0.6)
    np.testing.assert_allclose(probe.look(d)[:, :3], want, rtol=3e-3)
    probe.close()


@pytest.mark.parametrize("sun", [True, False])
@pytest.mark.parametrize("elevation", [0, 0.2, 12, 90])
def test_ground_is_lambertian_and_lit_by_dome_and_sun(elevation: float, sun: bool) -> None:
    """Against quadrature of the analytic dome and of a disk cut by the horizon."""
    e = math.radians(elevation)
    ground = sky.bake(e, 3.0, 0.4, sun)[-1, 0].astype(float)
    n = 1500
    cos2 = (np.arange(n) + 0.5) / n  # equal steps of cos^2 are equal steps of irradiance
    phi = (np.arange(n) + 0.5) / n * 2 * np.pi
    y, r = np.sqrt(cos2)[:, None], np.sqrt(1 - cos2)[:, None]
    d = np.stack(np.broadcast_arrays(r * np.sin(phi), y, -r * np.cos(phi)), 2).reshape(-1, 3)
    irradiance = np.pi * sky.dome_radiance(d, e, 3.0, 0.4).mean(0)
    if sun:
        rng = np.random.default_rng(0)
        t = np.sqrt(rng.random(400_000)) * sky.SUN_RADIUS
        height = np.sin(e) * np.cos(t) + np.cos(e) * np.sin(t) * np.cos(rng.random(400_000) * 2 * np.pi)
        irradiance = irradiance + sky.sun_irradiance(e, 3.0) * np.maximum(height, 0).mean()
    np.testing.assert_allclose(ground, 0.4 / np.pi * irradiance, rtol=4e-3)


@pytest.mark.parametrize("estimator", ["mis", "light"])
def test_the_sun_lights_with_the_model_s_irradiance(gpu: Renderer, estimator: str) -> None:
    """A horizontal white surface, with and without the sun."""
    images = [
        render(
            gpu, document([UP], {"m": {"type": "diffuse", "albedo": 1}}, camera=FROM_ABOVE,
                          environment={**SKY, "sun": sun, "sun_azimuth": 130, "ground_albedo": 0}),
            64, estimator=estimator, width=16, height=16,
        )[..., :3].mean((0, 1)) for sun in (True, False)
    ]  # fmt: skip
    want = sky.sun_irradiance(math.radians(40), 3.0) * math.sin(math.radians(40)) / math.pi
    np.testing.assert_allclose(images[0] - images[1], want, rtol=0.01)


def test_every_sky_is_finite_and_not_negative() -> None:
    rng = np.random.default_rng(9)
    corners = [(e, t, a) for e in (0, 1e-6, 1, 90) for t in (1, 10) for a in (0, 1)]
    drawn = [(rng.uniform(0, 90), rng.uniform(1, 10), rng.random()) for _ in range(40)]
    for elevation, turbidity, albedo in corners + drawn:
        texels = sky.bake(math.radians(elevation), turbidity, albedo, True, 64, 32)
        sun = sky.sun_irradiance(math.radians(elevation), turbidity)
        assert np.isfinite(texels).all() and texels.min() >= 0 and np.isfinite(sun).all() and sun.min() >= 0


def test_noon_is_as_bright_as_noon() -> None:
    """Illuminance through clear air is about 100 klx from a high sun, 10 to 25 klx from the dome."""
    e = math.radians(60)
    assert 683 * sky.sun_irradiance(e, 3.0) @ LUMINANCE == pytest.approx(98e3, rel=0.08)
    dome = sky.bake(e, 3.0, 0.2, False)[-1, 0] * np.pi / 0.2
    assert 10e3 < 683 * dome @ LUMINANCE < 25e3
    low = sky.sun_irradiance(math.radians(3), 3.0)
    assert low[0] > 2 * low[1] > 4 * low[2], "a low sun is red"


def test_turning_a_sky_repacks_nothing() -> None:
    cache = PackCache()
    arrays = [
        pack(parse_scene(document([], environment={**SKY, **turn})), Images(), cache).arrays.environment
        for turn in ({}, {"sun_azimuth": 20, "rotation": 5, "scale": 3})
    ]
    assert arrays[0].texels is arrays[1].texels and arrays[0].sun is arrays[1].sun
    assert arrays[1].rotation == pytest.approx(math.radians(-15))
    lights = packed(SKY).lights
    assert lights["kind"].tolist() == [LightKind.ENVIRONMENT]


@pytest.mark.parametrize(
    ("field", "value"), [("sun_elevation", 91), ("sun_elevation", -1), ("turbidity", 0.9), ("turbidity", 10.5),
                         ("ground_albedo", 1.1), ("sun", 1), ("sun_azimuth", float("nan"))]
)  # fmt: skip
def test_a_sky_out_of_range_is_refused(field: str, value: Any) -> None:
    with pytest.raises(InvalidDocument) as caught:
        parse_scene(document([], environment={**SKY, field: value}))
    assert [e.pointer for e in caught.value.errors] == [f"/environment/{field}"]
