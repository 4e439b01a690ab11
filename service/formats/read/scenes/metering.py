"""The exposure that suits a file whose lights are far brighter or darker than an exposure of 0 shows well.

Blender writes a lamp of 1 000 W as 54 351 cd, and a sun in lux: true values, which leave a picture white. A camera
meters: it brings the logarithmic mean of the luminance in the picture to the reflectance of middle grey, 18 %
[Reinhard et al. 2002, "Photographic tone reproduction for digital images", eq. 1]. Here a grid of rays goes through
the file's camera. What they hit is lit by the file's lights, with shadows, by light that is reflected once (a ray for
each) and by further reflections (a geometric series). Every material counts as diffuse, and rays go through glass.
The result is rounded to half a stop, which is about as exact as the method.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.colorimetry import LUMINANCE
from service.formats.read.scenes import looks
from service.formats.read.scenes.rays import Hit, Placed, Scene
from service.formats.types import Doubles

GRID = 12  # rays along each side of the picture
MIDDLE_GREY = 0.18
FAR = 4.0  # stops from middle grey up to which a picture stays as its author lit it: means from 0.011 to 2.9
FEWEST = 6  # rays that must hit something lit: fewer say nothing about the picture
SHADOWED = 4  # lights, the brightest ones at a place, for which shadow rays are traced


def exposure(document: dict[str, Any], placed: list[Placed], aspect: float | None) -> float | None:
    """Stops, to half a stop, or None where the picture is well exposed at 0 or too little of it is lit to tell.

    `document` is a scene's: its camera, lights and materials are used. `aspect`: the picture's width over its height.
    """
    materials = document["materials"]
    solid = [one for one in placed if not looks.is_clear(materials[one.material])]
    scene, found = Scene(solid or placed), _Metered(document)
    camera = document["camera"]
    for origin, direction in zip(*_rays(camera, aspect or 1.0), strict=True):
        hit = scene.nearest(origin, direction)
        if hit is not None:
            found.add(scene, origin + hit.distance * direction, hit)
    luminances = found.luminances()
    lit = luminances[luminances > 0]
    if len(lit) < FEWEST:
        return None
    stops = math.log2(MIDDLE_GREY) - float(np.log2(lit).mean())
    return round(2 * stops) / 2 if abs(stops) > FAR else None


class _Metered:
    """The light at the points that the picture shows."""

    def __init__(self, document: dict[str, Any]) -> None:
        self._materials, self._lights = document["materials"], document["lights"]
        self._albedo: list[float] = []
        self._emitted: list[float] = []
        self._direct: list[float] = []  # irradiance by the lights
        self._reflected: list[float] = []  # irradiance by light that was reflected once
        self._closed = 0  # rays from these points that meet something

    def add(self, scene: Scene, point: Doubles, hit: Hit) -> None:
        material = self._materials[hit.placed.material]
        if material["type"] == "diffuse":  # unlit: as bright in any light
            return
        self._albedo.append(looks.albedo(material))
        self._emitted.append(looks.emission(material))
        self._direct.append(self._irradiance(scene, point, hit.normal))
        direction = _scattered(len(self._albedo), hit.normal)
        second, reflected = scene.nearest(point, direction), 0.0
        if second is not None:
            self._closed += 1
            other = self._materials[second.placed.material]
            irradiance = self._irradiance(scene, point + second.distance * direction, second.normal)
            reflected = looks.albedo(other) * irradiance + math.pi * looks.emission(other)
        self._reflected.append(reflected)

    def luminances(self) -> Doubles:
        """The luminances of the points. For reflected light all get the mean, as one ray each is very noisy."""
        if not self._albedo:
            return np.empty(0)
        albedo, direct, emitted = (np.array(rows) for rows in (self._albedo, self._direct, self._emitted))
        again = float(albedo.mean()) * self._closed / len(albedo)
        ambient = float(np.mean(self._reflected)) / (1 - again)
        found: Doubles = emitted + albedo / math.pi * (direct + ambient)
        return found

    def _irradiance(self, scene: Scene, point: Doubles, normal: Doubles) -> float:
        """The irradiance by the lights, as luminance. Lights beyond the brightest SHADOWED ones get the mean shadow
        of those."""
        arriving = sorted((_arriving(light, point, normal) for light in self._lights), key=lambda one: -one[0])
        tested, rest = arriving[:SHADOWED], sum(amount for amount, _ in arriving[SHADOWED:])
        whole = sum(amount for amount, _ in tested)
        if not whole:
            return 0.0
        seen = sum(amount for amount, way in tested if amount and scene.nearest(point, way, 1.0) is None)
        return seen + rest * seen / whole


def _arriving(light: dict[str, Any], point: Doubles, normal: Doubles) -> tuple[float, Doubles]:
    """The irradiance by a light without shadows, and the way to it, of which length 1 ends at the light."""
    if light["type"] == "directional":
        to_light = -np.array(light["direction"], np.float64)
        cosine = float(normal @ to_light) / (float(np.linalg.norm(to_light)) or 1.0)
        return max(cosine, 0.0) * float(LUMINANCE @ light["irradiance"]), to_light * 1e12  # beyond everything
    way = np.array(light["position"], np.float64) - point
    distance = float(np.linalg.norm(way)) or 1.0
    cosine = max(float(normal @ way) / distance, 0.0)
    amount = cosine * float(LUMINANCE @ light["intensity"]) / distance**2
    if light["type"] == "spot" and amount:
        axis = np.array(light["direction"], np.float64)
        inner, outer = (math.cos(math.radians(light[name])) for name in ("inner_angle", "outer_angle"))
        within = -float(axis @ way) / (float(np.linalg.norm(axis)) * distance or 1.0)
        share = min(max((within - outer) / (inner - outer), 0.0), 1.0) if inner > outer else float(within >= outer)
        amount *= share * share * (3 - 2 * share)
    return amount, way


def _rays(camera: dict[str, Any], aspect: float) -> tuple[Doubles, Doubles]:
    """(GRID^2, 3) twice: where the rays through the middles of a grid of cells begin, and where they go. The grid
    fills the picture."""
    forward = np.subtract(camera["target"], camera["position"])
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.get("up", (0.0, 1.0, 0.0)))
    right = right / np.linalg.norm(right)
    is_parallel = camera.get("type") == "orthographic"
    half = camera["height"] / 2 if is_parallel else math.tan(math.radians(camera["vfov"] / 2))
    y, x = np.meshgrid(*[(np.arange(GRID) + 0.5) / GRID * 2 - 1] * 2, indexing="ij")
    across = half * (aspect * x[..., None] * right + y[..., None] * np.cross(right, forward)).reshape(-1, 3)
    position, straight = np.array(camera["position"], np.float64), np.zeros_like(across)
    if is_parallel:
        return position + across, forward + straight
    return position + straight, forward + across


def _scattered(number: int, normal: Doubles) -> Doubles:
    """The direction of a diffuse reflection, the `number`-th of a sequence that fills the hemisphere by the cosine: a
    point on the unit sphere [R2 sequence, Roberts 2018], added to the normal."""
    u, v = (number * 0.7548776662466927) % 1, (number * 0.5698402909980532) % 1
    z, turn = 1 - 2 * u, 2 * math.pi * v
    radius = math.sqrt(max(1 - z * z, 0.0))
    return np.asarray(normal + 0.999 * np.array([radius * math.cos(turn), radius * math.sin(turn), z]))
