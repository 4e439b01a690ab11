"""Dispersion: where a prism sends each colour, white furnaces, calm pictures, and no change without such glass."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.kernels.features import flags
from gpu.kernels.source import SHADERS
from service import colorimetry
from service.document import parse_scene
from service.pack import pack
from tests.marks import seldom
from tests.rendering import Images, assert_estimators_agree, document, picture, render

GLASS = {"type": "principled", "transmission": 1, "base_color": 1, "roughness": 0, "ior": 1.5}
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}
WHITE = {"type": "constant", "radiance": 1}
LINES = {"d": 587.56, "F": 486.13, "C": 656.27}  # nm
LAMP = {"type": "diffuse", "albedo": 0, "emission": 10}
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

WAVELENGTHS = np.arange(380, 780, 0.5)


def _weights() -> np.ndarray:
    """What each wavelength gives to red, green and blue (n, 3); each sums to 1."""
    nm, observer, white = colorimetry._NANOMETRES, colorimetry._OBSERVER, colorimetry._D65
    xyz = np.stack([np.interp(WAVELENGTHS, nm, column) for column in (observer * white[:, None]).T], -1)
    rgb: np.ndarray = np.maximum(xyz @ colorimetry._REC709_OF_XYZ.T, 0)
    return rgb / rgb.sum(0)


def _places(nm: np.ndarray) -> np.ndarray:
    """Where wavelengths lie on Cauchy's scale: 1 apart between the lines F and C, 0 at d."""
    d, f, c = (LINES[k] ** -2 for k in "dFC")
    out: np.ndarray = (nm**-2.0 - d) / (f - c)
    return out


def test_the_wavelengths_are_those_that_make_each_channel() -> None:
    text = (SHADERS / "path" / "hues.glsl").read_text()
    rows = re.findall(r"vec3\(([^()]+)\)", text[text.index("HUES_PLACES[64] =") :])
    table = np.array([[float(x) for x in row.split(",")] for row in rows[:64]])
    for k in range(3):
        order = np.argsort(WAVELENGTHS)
        places, share = _places(WAVELENGTHS)[order], np.cumsum(_weights()[order, k])
        exact = np.interp((np.arange(4096) + 0.5) / 4096, share, places)
        given = np.repeat(table[:, k], 64)
        assert abs(given.mean() - exact.mean()) < 0.004
        assert given.std() == pytest.approx(exact.std(), rel=0.01)
        assert abs(given - exact).mean() < 0.02  # of the width between the lines F and C


@pytest.mark.parametrize("roughness", [0, 0.3, 0.8])
def test_dispersive_glass_neither_gains_nor_loses(gpu: Renderer, roughness: float) -> None:
    material = {**GLASS, "roughness": roughness, "abbe": 20}
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 24}
    scene = document([BALL], {"m": material}, environment=WHITE, camera=camera)
    channels = render(gpu, scene, 512, max_bounces=128)[..., :3].mean((0, 1))
    assert (channels > 0.99).all() and (channels < 1.003).all()


@pytest.mark.llvmpipe
def test_an_abbe_number_that_no_path_meets_changes_no_bit(gpu: Renderer) -> None:
    behind = {**BALL, "center": [0, 0, 40], "material": "glass"}
    floor = {"type": "quad", "origin": [-3, -1, 3], "u": [6, 0, 0], "v": [0, 0, -6], "material": "floor"}
    wall = {"type": "quad", "origin": [-30, -30, 20], "u": [60, 0, 0], "v": [0, 60, 0], "material": "floor"}
    seen = []
    for abbe in ({}, {"abbe": 20}):
        mats = {"m": GLASS, "glass": {**GLASS, "roughness": 0.2, **abbe}, "floor": {"type": "principled"}}
        scene = document([BALL, floor, behind, wall], mats, environment=WHITE)
        assert ("HAS_DISPERSION" in flags(pack(parse_scene(scene), Images()).arrays)) == bool(abbe)
        seen.append(render(gpu, scene, 16, max_bounces=6))
    assert np.array_equal(*seen)


@pytest.mark.parametrize("more", [{"transmission": 0}, {"thin_walled": True}, {"metallic": 1}])
def test_what_does_not_refract_does_not_disperse(more: dict[str, Any]) -> None:
    scene = document([BALL], {"m": {**GLASS, "abbe": 20, **more}})
    assert "HAS_DISPERSION" not in flags(pack(parse_scene(scene), Images()).arrays)


def test_estimators_agree_on_dispersive_glass(gpu: Renderer) -> None:
    lamp = {"type": "sphere", "center": [1.5, 2, 2], "radius": 0.6, "material": "lamp"}
    coated = {**GLASS, "roughness": 0.5, "abbe": 10, "ior": 1.8, "clearcoat": 0.5, "clearcoat_roughness": 0}
    assert_estimators_agree(gpu, document([BALL, lamp], {"m": coated, "lamp": LAMP}, environment=WHITE))


# A prism of 60 degrees stands upright on the axis of the camera, turned so that yellow light passes it at the least
# deviation; a thin lamp stands where that light comes from.
INDEX, ABBE, FAR = 1.6, 20.0, 30.0
APEX = np.radians(60)
SIZE, FOV = 96, 4.0


def _refracted(d: np.ndarray, n: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Directions (k, 2) into which a plane of normal n (2,), against d, turns d (k, 2), by indices eta (k,)."""
    c = -(d @ n)
    return eta[:, None] * d + (eta * c - np.sqrt(1 - eta**2 * (1 - c**2)))[:, None] * n


def _prism() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (3, 2) in x and z, and the outward normals of the faces that a camera's ray enters and leaves."""
    entry = np.arcsin(INDEX * np.sin(APEX / 2))  # the angle at each face at the least deviation
    normal_in = np.array([np.sin(entry), np.cos(entry)])
    turn = np.pi - APEX  # from one outward normal to the other
    c, s = np.cos(turn), np.sin(turn)
    normal_out = np.array([c * normal_in[0] + s * normal_in[1], -s * normal_in[0] + c * normal_in[1]])
    side = np.array([[0, -1], [1, 0]])
    along_in, along_out = side @ normal_in, -(side @ normal_out)
    apex = -4 * along_in
    return np.array([apex, apex + 8 * along_in, apex + 8 * along_out]), normal_in, normal_out


def _landing(x: np.ndarray, nm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where (k, 2), and in which direction (k, 2), light of wavelengths (k,) leaves the prism, that the camera at
    (0, FAR) sees at the tangents x (k,)."""
    corners, n_in, n_out = _prism()
    d = np.stack([x, -np.ones_like(x)], -1) / np.hypot(x, 1)[:, None]
    o = np.broadcast_to([0.0, FAR], d.shape)
    index = INDEX + (INDEX - 1) / ABBE * _places(nm)
    for normal, corner, eta in ((n_in, corners[0], 1 / index), (-n_out, corners[0], index)):
        o = o + (((corner - o) @ normal) / (d @ normal))[:, None] * d
        d = _refracted(d, normal if (d @ normal < 0).all() else -normal, eta)
    return o, d


def test_a_prism_sends_each_colour_where_snell_says(gpu: Renderer) -> None:
    corners = _prism()[0]
    o, d = _landing(np.zeros(1), np.array([LINES["d"]]))
    deviation = np.degrees(np.arccos(-d[0, 1]))
    least = np.degrees(2 * np.arcsin(INDEX * np.sin(APEX / 2)) - APEX)
    assert deviation == pytest.approx(least, abs=1e-6)
    lamp_at, across = o[0] + FAR * d[0], np.array([d[0, 1], -d[0, 0]])
    half = 0.05
    low, high = -1.5, 1.5
    vertices = [[x, y, z] for y in (low, high) for x, z in corners]
    faces = [
        [0, 1, 2],
        [3, 5, 4],
        *(f for i in range(3) for j in [(i + 1) % 3] for f in ([i, i + 3, j], [j, i + 3, j + 3])),
    ]
    prism = {"type": "mesh", "vertices": vertices, "faces": faces, "smooth": False, "material": "m"}
    end = lamp_at - half * across
    lamp = {
        "type": "quad",
        "origin": [end[0], -9, end[1]],
        "u": [2 * half * across[0], 0, 2 * half * across[1]],
        "v": [0, 18, 0],
        "material": "lamp",
    }
    scene = document(
        [prism, lamp], {"m": {**GLASS, "ior": INDEX, "abbe": ABBE}, "lamp": {**LAMP, "emission_sides": "both"}},
        camera={"position": [0, 0, FAR], "target": [0, 0, 0], "vfov": FOV},
    )  # fmt: skip
    scene = json.loads(json.dumps(scene))  # its numbers are plain ones
    seen = render(gpu, scene, 256, width=SIZE, height=SIZE, max_bounces=2)[..., :3].mean(0)
    # The same by Snell's law, wavelength by wavelength.
    edge = np.tan(np.radians(FOV / 2))
    x = ((np.arange(SIZE * 8) + 0.5) / (SIZE * 8) * 2 - 1) * edge
    weights = _weights()
    expected = np.zeros((SIZE, 3))
    for nm, w in zip(WAVELENGTHS, weights, strict=True):
        o, d = _landing(x, np.full(len(x), nm))
        t = ((lamp_at - o) @ d[len(d) // 2]) / (d @ d[len(d) // 2])
        off = (o + t[:, None] * d - lamp_at) @ across
        expected += ((abs(off) < half).reshape(SIZE, 8).mean(1))[:, None] * w
    columns = np.arange(SIZE)[:, None]
    middle, wanted = ((columns * a).sum(0) / a.sum(0) for a in (seen, expected))
    np.testing.assert_allclose(middle, wanted, atol=1)


def _checkers(material: dict[str, Any]) -> dict[str, Any]:
    floor = {"type": "quad", "origin": [-6, -1, 6], "u": [12, 0, 0], "v": [0, 0, -12], "material": "floor"}
    lamp = {"type": "quad", "origin": [-2, 3, 1], "u": [2, 0, 0], "v": [0, 0, -2], "material": "lamp"}
    return document(
        [BALL, floor, lamp],
        {"m": material, "floor": {"type": "diffuse", "albedo": {"texture": "c"}}, "lamp": LAMP},
        textures={"c": {"type": "checker", "a": 0.9, "b": 0.1, "scale": [16, 16]}},
        environment={"type": "constant", "radiance": 0.5},
        camera={"position": [0, 0.6, 4], "target": [0, 0, 0], "vfov": 24},
    )


@pytest.mark.parametrize("roughness", seldom([0, 0.2], [0.2]))
def test_colours_are_calmer_than_twice_the_light(gpu: Renderer, roughness: float) -> None:
    """Between pictures of 64 samples: the noise of the channels about the luminance, and the luminance's without."""

    def noise(material: dict[str, Any]) -> tuple[float, float]:
        runs = []
        for seed in range(6):
            made = picture(gpu, _checkers(material), 64, max_bounces=12, seed=seed)
            runs.append(made.read()[..., :3].astype(float))
            made.release()
        off = np.array(runs) - np.mean(runs, 0)
        light = off @ LUMINANCE
        return float(np.sqrt((light**2).mean())), float(np.sqrt(((off - light[..., None]) ** 2).mean()))

    plain, _ = noise({**GLASS, "roughness": roughness})
    _, chroma = noise({**GLASS, "roughness": roughness, "abbe": 20})
    assert 0.02 * plain < chroma < 1.2 * plain
