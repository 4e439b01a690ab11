"""Kernels that evaluate a material: as few as possible, so that a slider seldom waits for the compiler.

A material comes as a scene that holds it and nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gpu import layout
from gpu.arrays import SceneArrays
from gpu.bsdf import lobes
from gpu.kernels import features
from gpu.layout.models import MODELS

VALUES, ALBEDO, TERMS = "bsdf_values.comp", "bsdf_albedo.comp", "bsdf_terms.comp"
ENTRIES = {"values": VALUES, "albedo": ALBEDO, "terms": TERMS}  # the kernel for each question about a material

NOWHERE: np.void = np.zeros(1, layout.Camera.dtype)[0]  # a camera where there is no scene to look at
# What a material has besides its BSDF.
_REST = {"emission": 0.0, "ambient": 0.0, "opacity": 1.0, "attenuation_distance": layout.ABSENT}


def bare(arrays: SceneArrays) -> SceneArrays:
    """The same with a material that has a BSDF and nothing else."""
    materials = arrays.materials.copy()
    for member, value in _REST.items():
        materials[member] = value
    return replace(arrays, materials=materials)


def defines(arrays: SceneArrays, raised: frozenset[str], entry: str) -> dict[str, object]:
    """The defines of the kernel `entry` for a bare material; many materials have it in common.

    `bsdf_albedo.comp` takes the independent sampler, so that the scatter of its samples gives their error.
    """
    specific: dict[str, dict[str, object]] = {ALBEDO: {"SAMPLER": 1}, VALUES: lobes.defines(), TERMS: {}}
    return features.defines(raised, shapes=features.counts(arrays)) | specific[entry]


def samples() -> Iterator[tuple[SceneArrays, frozenset[str]]]:
    """A bare material of each model with the flags of each kernel that evaluates one of that model."""
    for model in MODELS:
        material = np.zeros(1, layout.Material.dtype)
        material["model"] = model.number
        arrays = SceneArrays(NOWHERE, material)
        if model.record:
            setattr(arrays, model.records, np.zeros((model.record.words // 4, 4), np.uint32))
        arrays = bare(arrays)
        raised = features.evaluating(arrays)
        yield from ((arrays, flags) for flags in (raised, *features.touched(raised, anywhere=False)))
