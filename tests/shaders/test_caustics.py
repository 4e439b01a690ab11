"""Caustics that are traced from the lights: a light tracer in numpy, and the camera's paths where these find them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import Picture, Renderer, RenderSettings
from gpu.kernels.features import traces_caustics
from tests.families import EXACT
from tests.marks import seldom
from tests.rendering import document, picture

CENTER, RADIUS, INDEX, ALBEDO = np.array([0.0, 1.3, 0.0]), 1.0, 1.5, 0.5
GLASS = {"type": "principled", "transmission": 1, "ior": INDEX, "roughness": 0, "base_color": [1, 1, 1]}
# It looks under the ball, along its shadow.
POSITION, TARGET, HEIGHT = np.array([-6.0, 2.5, 3.0]), np.array([1.2, 0.3, 0.0]), 5.0
TOWARDS = np.array([1.0, -1.3, 0.2]) / np.linalg.norm([1.0, -1.3, 0.2])
SUN: dict[str, Any] = {"type": "directional", "direction": TOWARDS.tolist(), "irradiance": 3}
LAMPS: dict[str, dict[str, Any]] = {
    "sun of .53 degrees": SUN | {"angular_diameter": 0.53},
    "no extent": SUN,
    "point": {"type": "point", "position": [-2.5, 4.5, -0.5], "intensity": 60},
}


def scene(light: dict[str, Any], ball: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    camera = {"type": "orthographic", "height": HEIGHT, "position": POSITION.tolist(), "target": TARGET.tolist()}
    shapes = [
        {"type": "sphere", "center": CENTER.tolist(), "radius": RADIUS, "material": "ball"},
        {"type": "quad", "origin": [-8, 0, 8], "u": [16, 0, 0], "v": [0, 0, -16], "material": "floor"},
    ]
    materials = {"ball": ball or GLASS, "floor": {"type": "diffuse", "albedo": ALBEDO}}
    return document(shapes, materials, **{"camera": camera, "lights": [light], **more})


def caustic(made: Picture) -> np.ndarray:
    """(h, w, 3): what the paths of light brought."""
    settings = made.settings
    values = made._light.radiance(0, settings.width * settings.height)
    return values.reshape(settings.height, settings.width, 3).astype(float)


def _rays(light: dict[str, Any], count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays at the ball, from its light: origins, directions, and the flux of each."""
    u, angle = rng.random(count), rng.random(count) * 2 * np.pi
    if light["type"] == "point":
        o = np.broadcast_to(np.array(light["position"], float), (count, 3))
        axis = CENTER - o[0]
        away = np.linalg.norm(axis)
        cap = 1 - np.sqrt(1 - (RADIUS / away) ** 2)
        x, y = _across(axis / away)
        h = u * cap
        r = np.sqrt(h * (2 - h))
        d = (1 - h)[:, None] * axis / away + (r * np.cos(angle))[:, None] * x + (r * np.sin(angle))[:, None] * y
        return o, d, np.full(count, light["intensity"] * 2 * np.pi * cap / count)
    d = np.broadcast_to(TOWARDS, (count, 3))
    half = np.radians(light.get("angular_diameter", 0.0)) / 2
    if half > 0:
        x, y = _across(TOWARDS)
        s, turn = np.sin(half) * np.sqrt(rng.random(count)), rng.random(count) * 2 * np.pi
        d = (s * np.cos(turn))[:, None] * x + (s * np.sin(turn))[:, None] * y + np.sqrt(1 - s**2)[:, None] * TOWARDS
    first = np.cross(d, [0, 0, 1.0])
    first /= np.linalg.norm(first, axis=1)[:, None]
    second = np.cross(d, first)
    r = RADIUS * np.sqrt(u)
    o = CENTER - 10 * d + (r * np.cos(angle))[:, None] * first + (r * np.sin(angle))[:, None] * second
    return o, d, np.full(count, light["irradiance"] * np.pi * RADIUS**2 / count)


def _across(d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x = np.cross(d, [1.0, 0, 0] if abs(d[0]) < 0.5 else [0, 1.0, 0])
    x /= np.linalg.norm(x)
    return x, np.cross(d, x)


def _fresnel(cosine: np.ndarray, eta: float) -> np.ndarray:
    sin2 = (1 - cosine**2) / eta**2
    below = np.sqrt(np.maximum(0, 1 - sin2))
    s, p = (cosine - eta * below) / (cosine + eta * below), (below - eta * cosine) / (below + eta * cosine)
    return np.where(sin2 >= 1, 1.0, 0.5 * (s**2 + p**2))


def _hit(o: np.ndarray, d: np.ndarray, far: bool) -> np.ndarray:
    """The distance to the ball; inf where the ray misses it."""
    f = o - CENTER
    b = (f * d).sum(axis=1)
    disc = b**2 - (f * f).sum(axis=1) + RADIUS**2
    return np.where(disc > 0, -b + (1 if far else -1) * np.sqrt(np.maximum(disc, 0)), np.inf)


def _floor(o: np.ndarray, d: np.ndarray, flux: np.ndarray) -> float:
    """The sum of the pixels' radiance that rays bring which leave the ball, on the floor where the camera sees it."""
    t = np.where(d[:, 1] < 0, -o[:, 1] / np.minimum(d[:, 1], -1e-12), 0.0)
    p = o + t[:, None] * d
    forward = (TARGET - POSITION) / np.linalg.norm(TARGET - POSITION)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    seen = (d[:, 1] < 0) & (np.abs(p[:, [0, 2]]) < 8).all(axis=1)
    seen &= (np.abs((p - POSITION) @ np.stack([right, up], axis=1)) < HEIGHT / 2).all(axis=1)
    back = np.broadcast_to(-forward, p.shape)
    seen &= ~((_hit(p, back, far=False) > 1e-6) & np.isfinite(_hit(p, back, far=False)))
    return float((flux * seen).sum() * ALBEDO / np.pi * abs(forward[1]))


def light_tracer(light: dict[str, Any], bounces: int, count: int = 400_000) -> float:
    """The mean over the picture of the radiance that the floor sends on of light which comes by way of the ball
    after at most that many events, that on the floor included."""
    rng = np.random.default_rng(1)
    o, d, flux = _rays(light, count, rng)
    t = _hit(o, d, far=False)
    hits = np.isfinite(t)
    o, d, flux = (o + t[:, None] * d)[hits], d[hits], flux[hits]
    n = (o - CENTER) / RADIUS
    c = -(d * n).sum(axis=1)
    share = _fresnel(c, INDEX)
    total = _floor(o, d + 2 * c[:, None] * n, flux * share) if bounces >= 2 else 0.0
    below = np.sqrt(1 - (1 - c**2) / INDEX**2)
    d = d / INDEX + (c / INDEX - below)[:, None] * n
    flux = flux * (1 - share)
    for _ in range(3, bounces + 1):
        o = o + _hit(o, d, far=True)[:, None] * d
        n = (CENTER - o) / RADIUS
        c = -(d * n).sum(axis=1)
        share = _fresnel(c, 1 / INDEX)
        below = np.sqrt(np.maximum(0, 1 - (1 - c**2) * INDEX**2))
        out = d * INDEX + (c * INDEX - below)[:, None] * n
        total += _floor(o, out, flux * (1 - share))
        d, flux = d + 2 * c[:, None] * n, flux * share
    return total / HEIGHT**2


@pytest.mark.parametrize("name", LAMPS)
@pytest.mark.parametrize("bounces", [3, 8])
def test_totals_are_those_of_a_light_tracer(gpu: Renderer, name: str, bounces: int) -> None:
    """Within 2 %. With three bounces no light comes to the floor that was mirrored inside of the ball."""
    made = picture(gpu, scene(LAMPS[name]), 64, caustics="light", width=48, height=48, max_bounces=bounces)
    expected = light_tracer(LAMPS[name], bounces)
    assert expected > 0.01
    assert caustic(made).mean() == pytest.approx(expected, rel=0.02)


@pytest.mark.slow
def test_a_spot_and_the_sun_of_a_sky_bring_what_a_point_and_a_sun_bring(gpu: Renderer) -> None:
    """Where the cone holds all of the ball; and in proportion to what a sun brings to the bare floor, within 2 %."""
    point = LAMPS["point"]
    aimed = (CENTER - point["position"]).tolist()
    spot = point | {"type": "spot", "direction": aimed, "inner_angle": 40, "outer_angle": 50}
    small: dict[str, Any] = {"width": 48, "height": 48}
    by_point, by_spot = (
        caustic(picture(gpu, scene(light), 64, caustics="light", **small)).mean() for light in (point, spot)
    )
    assert by_spot == pytest.approx(by_point, rel=0.02)
    elevation = np.degrees(np.arcsin(-TOWARDS[1]))
    sky = {"type": "sky", "sun_elevation": elevation, "sun_azimuth": np.degrees(np.arctan2(-TOWARDS[0], TOWARDS[2]))}
    shares = []
    for environment, lights in ((sky, []), (None, [LAMPS["sun of .53 degrees"]])):
        surroundings = {"environment": environment} if environment else {}
        shone = scene(SUN, lights=lights, **surroundings)
        brought = caustic(picture(gpu, shone, 64, caustics="light", **small)).mean(axis=(0, 1))
        bare = shone | {"shapes": shone["shapes"][1:]}
        direct = picture(gpu, bare, 64, max_bounces=1, **small).read()[..., :3].mean(axis=(0, 1))
        if environment:
            dome = bare | {"environment": environment | {"sun": False}}
            direct = direct - picture(gpu, dome, 64, max_bounces=1, **small).read()[..., :3].mean(axis=(0, 1))
        shares.append(brought / direct)
    np.testing.assert_allclose(*shares, rtol=0.02)


def test_paths_of_light_are_traced_where_the_setting_says_so() -> None:
    raised = {"HAS_CAUSTICS", "HAS_SHARP_CAUSTICS"}
    traced = {way: traces_caustics(raised, RenderSettings(8, 8, caustics=way)) for way in ("auto", "light", "paths")}
    assert traced == {"auto": True, "light": True, "paths": False}
    assert not traces_caustics({"HAS_CAUSTICS"}, RenderSettings(8, 8, caustics="auto"))


WIDE_SUN = SUN | {"angular_diameter": 20}
PERSPECTIVE = {"position": [-3, 2.5, 5], "target": [0.5, 0.3, 0], "vfov": 45}
SHINES = {"type": "diffuse", "albedo": 0, "emission": 6}
QUAD_LAMP = {"type": "quad", "origin": [-2, 3, -0.5], "u": [0.8, 0, 0], "v": [0, 0, 0.8], "material": "lamp"}
ROUND_LAMP = {"type": "disk", "center": [-1.6, 3.2, 0.5], "normal": [0.5, -0.7, 0], "radius": 0.5, "material": "lamp"}
BALL_LAMP = {"type": "sphere", "center": [-1.6, 3.2, 0.5], "radius": 0.4, "material": "lamp"}
HAZE = {"absorption": [0.02, 0.1, 0.2], "scattering": [0.1, 0.1, 0.02], "g": 0.5}
GEM: dict[str, Any] = {
    "type": "mesh",
    "vertices": [[0, 1, 0], [1, 0, 0], [0, 0, 1], [-1, 0, 0], [0, 0, -1], [0, -1, 0]],
    "faces": [[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [5, 1, 2], [5, 2, 3], [5, 3, 4], [5, 4, 1]],
    "material": "ball",
    "transform": {"translate": CENTER.tolist(), "rotate": [20, 30, 0]},
}
# Bodies by priority: a core that reaches out of the ball, and water around it.
CORE = {"type": "box", "min": [-0.3, 0.8, -0.3], "max": [0.3, 2.6, 0.3], "material": "core", "priority": 1}
HELD = {"type": "sphere", "center": [0.3, 1.4, 0.4], "radius": 0.5, "material": "core", "priority": -1}
WATER = {"type": "box", "min": [-7, -1, -7], "max": [7, 2.0, 7], "material": "water", "priority": -2}
AGREE: dict[str, dict[str, Any]] = {
    "a lens": {"camera": PERSPECTIVE | {"aperture_radius": 0.3, "focus_distance": 4}},
    "a panorama": {"camera": {"type": "panorama", "position": [-2, 1.5, 2], "target": [0, 0.3, 0]}},
    "gold": {"ball": {"type": "principled", "metallic": 1, "roughness": 0, "base_color": [1, 0.8, 0.3]}},
    "tinted": {"ball": GLASS | {"attenuation_color": [0.3, 0.7, 0.9], "attenuation_distance": 0.7}},
    "a quad and a disk": {"lamps": [QUAD_LAMP, ROUND_LAMP]},
    "a ball": {"lamps": [BALL_LAMP]},
    "a filled ball": {"medium": HAZE},
    "a ball with a core": {"lamps": [CORE, HELD, BALL_LAMP]},
    "under water": {"lamps": [WATER, HELD, BALL_LAMP], "camera": PERSPECTIVE | {"position": [-2, 1.0, 3]}},
    "a box": {"lamps": [{"type": "box", "min": [-2, 3, 0], "max": [-1.6, 3.4, 0.6], "material": "lamp"}]},
    "dispersion": {"ball": GLASS | {"abbe": 15}},
    "a glossy receiver": {"floor": {"type": "principled", "base_color": 0.4, "roughness": 0.3}},
    "a mesh that is turned": {"body": GEM},
    "fog": {"lamps": [BALL_LAMP], "environment": {"type": "constant", "radiance": 0, "medium": HAZE}},
}


OFTEN = {"gold", "a ball with a core"}


@pytest.mark.parametrize("name", seldom(AGREE, AGREE.keys() - OFTEN))
def test_both_ways_agree(gpu: Renderer, name: str) -> None:
    """The mean of the picture, within four deviations, which are a small part of the caustic's light."""
    how = {"camera": PERSPECTIVE, **AGREE[name]}
    lamps, medium = how.pop("lamps", []), how.pop("medium", None)
    floor, body = how.pop("floor", None), how.pop("body", None)
    seen = scene(WIDE_SUN, **how)
    if floor:
        seen["materials"]["floor"] = floor
    if body:
        seen["shapes"][0] = body
    if medium:
        seen["shapes"][0]["medium"] = medium
    if lamps:
        seen["lights"] = []
        seen["materials"] |= {"lamp": SHINES, "core": GLASS | {"ior": 1.3}, "water": GLASS | {"ior": 1.2}}
        seen["shapes"] += lamps
    settings: dict[str, Any] = {"width": 24, "height": 24, "max_bounces": 6, "roulette_depth": 99}
    means, errors, brought = [], [], 0.0
    for caustics in ("paths", "light"):
        made = picture(gpu, seen, 8192 if EXACT or name == "fog" else 2048, caustics=caustics, **settings)
        means.append(made.read()[..., :3].mean(dtype=float))
        errors.append(made.read("variance").mean(axis=2).sum(dtype=float) / 24**4)
        if caustics == "light":
            brought = caustic(made).mean()
        made.release()
    deviation = np.sqrt(sum(errors))
    assert abs(means[0] - means[1]) < 4 * deviation and brought > 4 * deviation


@pytest.mark.parametrize("coat", [{"clearcoat": 1, "clearcoat_roughness": 0.4}, {"clearcoat": 0.5}])
def test_light_leaves_a_coat_towards_the_ball_as_it_is_seen_there(gpu: Renderer, coat: dict[str, Any]) -> None:
    """A small lamp far off sends its light at 75 degrees: what its coat leaves of that reaches the floor."""
    away = np.array([-1.6, 1.7, -0.1]) / np.linalg.norm([-1.6, 1.7, -0.1])
    cosine = np.cos(np.radians(75))
    n = -cosine * away + np.sin(np.radians(75)) * _across(away)[0]
    u, v = (0.1 * each for each in _across(n))
    panel = {"type": "quad", "origin": (CENTER + 30 * away - (u + v) / 2).tolist(), "u": u.tolist(), "v": v.tolist(),
             "material": "lamp"}  # fmt: skip
    seen = scene(SUN, lights=[])
    seen["shapes"].append(panel)
    brought = []
    for layers in ({}, coat):
        lamp = {"type": "principled", "base_color": 0, "emission": 1e6, **layers}
        shone = seen | {"materials": seen["materials"] | {"lamp": lamp}}
        made = picture(gpu, shone, 64, caustics="light", width=24, height=24, max_bounces=4)
        brought.append(caustic(made).mean())
    taken = float(coat["clearcoat"] * _fresnel(np.array(cosine), 1.5))
    assert brought[1] / brought[0] == pytest.approx(1 - taken, abs=0.02 * coat["clearcoat"]) and taken > 0.1


def test_filter_glossy_blurs_what_no_path_finds(gpu: Renderer) -> None:
    """The camera's paths then find about as much light of a lamp without extent as a light tracer does, elsewhere."""
    settings: dict[str, Any] = {"width": 48, "height": 48, "max_bounces": 8}
    seen = scene(LAMPS["point"])
    means = [
        picture(gpu, seen, 64, filter_glossy=least, **settings).read()[..., :3].mean(dtype=float)
        for least in (0.0, 0.3)
    ]
    brought = light_tracer(LAMPS["point"], 8)
    assert 0.5 * brought < means[1] - means[0] < 1.5 * brought
