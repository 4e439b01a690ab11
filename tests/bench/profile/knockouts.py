"""The time of a path without some of its work. What a part costs is the difference; parts that hide each other's cost
do not add up to the whole."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

from gpu import Picture, Renderer, RenderSettings
from gpu.analysis.metering import noise_meter_off
from tests.bench.profile.counts import Counter, Counts
from tests.bench.profile.scenes import MAX_BOUNCES, Document, Subject

WHOLE = "as it is"
LEAST_S = 0.25  # processor seconds of a turn: below, beginning and ending it would count
COUNTED_SAMPLES = 4


@dataclass(frozen=True)
class Options:
    """`size` pixels a side, a multiple of 8; the median of `turns` counts."""

    size: int = 128
    turns: int = 5
    turn_s: float = LEAST_S


@dataclass(frozen=True)
class Variant:
    """A scene with some of its work left out."""

    name: str
    document: Document
    settings: RenderSettings


@dataclass(frozen=True)
class Part:
    """Nanoseconds of one core, on average, and what was counted."""

    name: str
    path_ns: float
    counts: Counts


def variants(subject: Subject, size: int) -> list[Variant]:
    """The scene as it is, and each of these without one thing that it has."""
    settings = RenderSettings(size, size, MAX_BOUNCES, filter="box", seed=1)
    found = [Variant(WHOLE, subject.document, settings)]
    found += [
        Variant(f"{bounces} bounce{'s' * (bounces != 1)}", subject.document, replace(settings, max_bounces=bounces))
        for bounces in (0, 1, 2)
    ]
    found.append(Variant("no samples of lights", subject.document, replace(settings, estimator="bsdf")))
    for name, change in CHANGES.items():
        document = changed(subject.document, change)
        if document != subject.document:
            found.append(Variant(name, document, settings))
    return found


def measure(subject: Subject, options: Options, counter: Counter, told: Callable[[str], None]) -> list[Part]:
    """Processor time in turns, so that all variants run under the same load."""
    pictures: dict[str, Picture] = {}
    counted: dict[str, Counts] = {}
    with Renderer() as renderer, noise_meter_off():
        for variant in variants(subject, options.size):
            told(f"{subject.name}: {variant.name}")
            arrays = subject.packed(variant.document)
            counted[variant.name] = counter.count(arrays, variant.settings, COUNTED_SAMPLES)
            pictures[variant.name] = renderer.picture(renderer.load(arrays), variant.settings)
        told(f"{subject.name}: time")
        samples = {name: _samples(picture, options.turn_s) for name, picture in pictures.items()}
        taken: dict[str, list[float]] = {name: [] for name in pictures}
        for _ in range(options.turns):
            for name, picture in pictures.items():
                taken[name].append(_seconds(picture, samples[name]) / samples[name])
        for picture in pictures.values():
            picture.release()
            picture.scene.release()
    scale = 1e9 / options.size**2
    return [Part(name, scale * statistics.median(taken[name]), counted[name]) for name in pictures]


def _samples(picture: Picture, turn_s: float) -> int:
    """How many samples take about that many processor seconds."""
    _seconds(picture, 1)  # compiles, and finds the size of its slices
    samples = 1
    while (took := _seconds(picture, samples)) < turn_s / 2:
        samples *= 2
    return max(1, round(samples * turn_s / took))


def _seconds(picture: Picture, samples: int) -> float:
    picture.reset()
    began = time.process_time()
    while picture.samples < samples:
        picture.trace(60.0, samples)
    return time.process_time() - began


def changed(document: Document, change: Callable[[Document], Document]) -> Document:
    """The document with other materials."""
    out = deepcopy(document)
    out["materials"] = {name: change(material) for name, material in out["materials"].items()}
    return out


def _diffuse(material: Document) -> Document:
    if material.get("emission"):
        return material
    color = material.get("base_color", material.get("albedo", 0.5))
    kept = {key: value for key, value in material.items() if key in ("alpha", "alpha_cutoff", "normal_map")}
    return {"type": "diffuse", "albedo": color, **kept}


def _untextured(material: Document) -> Document:
    return {key: value for key, value in material.items() if not _is_texture(value)}


def _is_texture(value: Any) -> bool:
    return isinstance(value, dict) and "texture" in value


def _opaque(material: Document) -> Document:
    return {key: value for key, value in material.items() if key not in ("alpha", "alpha_cutoff")}


def _untransmitting(material: Document) -> Document:
    return {key: value for key, value in material.items() if key != "transmission"}


def _even(material: Document) -> Document:
    return {key: value for key, value in material.items() if key != "normal_map"}


CHANGES: dict[str, Callable[[Document], Document]] = {
    "diffuse materials": _diffuse,
    "no textures": _untextured,
    "no normal maps": _even,
    "no transmission": _untransmitting,
    "opaque": _opaque,
}
