"""Reflection models beside each other: one object in seven lights, their time, their energy, their highlights."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, TypeVar

import numpy as np

from gpu import SceneArrays, Steps
from service.document import parse_scene, presets
from service.pack import pack_material
from service.problems import InvalidDocument
from tests.bench.seeds.stage import Document, Stage, sheet, shown

ROUGHNESS = 0.35
ALPHA = ROUGHNESS**2
# The exponent whose highlight is as wide as that of a microfacet distribution of this alpha [Walter et al. 2007,
# section 5.2]. The angle to the mirrored direction is twice that to the half vector: Phong's exponent is a quarter.
SHININESS = 2 / ALPHA**2 - 2
COLOR = [0.55, 0.05, 0.03]
PLASTIC: dict[str, Document] = {
    "blinn_phong": {"type": "blinn_phong", "diffuse": COLOR, "specular": 0.5, "shininess": SHININESS},
    "phong": {"type": "phong", "diffuse": COLOR, "specular": 0.5, "shininess": SHININESS / 4},
    "microfacet": {"type": "microfacet", "distribution": "ggx", "alpha": ALPHA, "f0": 0.04, "diffuse": COLOR},
    "disney": {"type": "disney", "base_color": COLOR, "roughness": ROUGHNESS},
    "principled": {"type": "principled", "base_color": COLOR, "roughness": ROUGHNESS},
}
# The same without the light from under the surface, and a white metal.
GLOSS = {
    name: {key: 0 if key in ("diffuse", "base_color") else value for key, value in document.items()}
    for name, document in PLASTIC.items()
}
METAL: dict[str, Document] = {
    "blinn_phong": {"type": "blinn_phong", "diffuse": 0, "specular": 1, "shininess": SHININESS},
    "phong": {"type": "phong", "diffuse": 0, "specular": 1, "shininess": SHININESS / 4},
    "microfacet": {"type": "microfacet", "distribution": "ggx", "alpha": ALPHA, "f0": 1},
    "disney": {"type": "disney", "base_color": 1, "metallic": 1, "roughness": ROUGHNESS},
    "principled": {"type": "principled", "base_color": 1, "metallic": 1, "roughness": ROUGHNESS},
}
ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 89.0)
LIT_FROM = 45.0  # degrees of incidence at which highlights are compared
SIZE, SAMPLES, TIMED = 120, 96, 320
T = TypeVar("T")


def known() -> list[str]:
    """The models that the scene document supports."""
    return [name for name, document in PLASTIC.items() if _parsed(document) is not None]


def measure(stage: Stage) -> dict[str, Any]:
    """Times of a sample of every pixel; directional albedos over angles; f around the mirrored direction."""
    names = known()
    lights = [entry["name"] for entry in presets.names("environments")][: stage.either(None, 1)]
    side = stage.either(SIZE, 16)
    seen = []
    for name in names:
        stage.told(f"{name} in {len(lights)} lights")
        row = []
        for light in lights:
            pixels = stage.image(scene(PLASTIC[name], light), side, side, stage.either(SAMPLES, 4), max_bounces=4)
            row.append(shown(pixels, -0.6))
        seen.append(row)
    stage.pictures["reflection"] = sheet(seen)
    stage.told("time, energy and highlights of the models")
    timed = stage.either(TIMED, 16)
    pictures = {
        name: stage.picture(stage.packed(scene(PLASTIC[name], "studio")), timed, timed, max_bounces=4)
        for name in names
    }
    taken = stage.rates(pictures)
    return {
        "models": names,
        "lights": lights,
        "ms": {name: 1e3 * taken[name] for name in names},
        "size": timed,
        "angles": list(ANGLES),
        "metal": {name: _albedo(stage, METAL[name]) for name in names},
        "gloss": {name: _albedo(stage, GLOSS[name]) for name in names},
        "highlight": {name: _highlight(stage, METAL[name]) for name in names},
        "highlight_angles": _around().tolist(),
    }


def scene(material: Document, light: str) -> Document:
    """The knot of the presets, on its floor."""
    document = presets.get("scenes", "generated-mesh")
    document["materials"][presets.subject(document)] = material
    document["environment"] = presets.get("environments", light)
    return document


def _albedo(stage: Stage, material: Document) -> list[float]:
    """The share of the light from an angle that is reflected, as the mean of the channels."""
    samples = stage.either(1 << 16, 256)
    found = _done(stage.renderer.bsdf.albedo(_packed(material), _directions(np.array(ANGLES)), samples))
    return [float(x) for x in found.albedo.mean(axis=1)]


def _highlight(stage: Stage, material: Document) -> list[float]:
    """f over the angle of the light, in the plane of incidence, where the eye is at LIT_FROM."""
    wo = _directions(np.array([-LIT_FROM]))
    return [
        float(x) for x in _done(stage.renderer.bsdf.values(_packed(material), wo, _directions(_around()))).f[0, :, 0]
    ]


def _around() -> np.ndarray:
    return np.arange(-80.0, 89.5, 0.5)


def _directions(degrees: np.ndarray) -> np.ndarray:
    angle = np.radians(degrees)
    return np.stack([np.sin(angle), np.zeros_like(angle), np.cos(angle)], axis=1)


def _packed(material: Document) -> SceneArrays:
    parsed = _parsed(material)
    assert parsed is not None
    return pack_material(parsed)


def _parsed(material: Document) -> Any:
    camera = {"position": [0, 0, 1], "target": [0, 0, 0]}
    try:
        return parse_scene({"version": 1, "camera": camera, "materials": {"m": material}, "shapes": []}).materials[
            "m"
        ]
    except InvalidDocument:
        return None


def _done(work: Generator[None, None, T]) -> T:
    return Steps(work).finish()
