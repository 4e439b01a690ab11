"""Which kernels answer for a material: as few as there can be, so that a slider seldom waits for a compiler."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gpu import layout
from gpu.arrays import CameraArrays, SceneArrays
from gpu.kernels import features
from gpu.layout import MaterialModel

VALUES, ALBEDO = "bsdf_values.comp", "bsdf_albedo.comp"
ENTRIES = (VALUES, ALBEDO)

_NOWHERE = CameraArrays((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), 1.0, 0.0, 1.0)
# What a material has besides its BSDF.
_REST = {"emission": 0.0, "ambient": 0.0, "opacity": 1.0, "attenuation_distance": layout.ABSENT}


def bare(material: np.ndarray) -> np.ndarray:
    """A copy of one `layout.Material` record that has a BSDF and nothing else."""
    out = np.array(material).reshape(1)
    for member, value in _REST.items():
        out[member] = value
    return out


def defines(material: np.ndarray, entry: str) -> dict[str, object]:
    """What the kernel `entry` is compiled with for one `layout.Material` record; many materials have it in common.

    The numbers of `bsdf_albedo.comp` are independent: the scatter of its samples tells their error.
    """
    arrays = SceneArrays(_NOWHERE, bare(material))
    out = features.defines(features.grown(frozenset(), arrays), shapes=features.counts(arrays))
    return out | {"SAMPLER": 1} if entry == ALBEDO else out


def all_defines() -> Iterator[tuple[str, dict[str, object]]]:
    """(entry, defines) of every kernel that some material needs, without repetitions."""
    found = set[tuple[object, ...]]()
    for entry in ENTRIES:
        for material in _samples():
            made = defines(material, entry)
            key = (entry, *made.items())
            if key not in found:
                found.add(key)
                yield entry, made


def _samples() -> Iterator[np.ndarray]:
    """A material of each model, and of those that can transmit or stretch one for each combination."""
    for model in MaterialModel:
        for transmission in (0.0, 1.0):
            for anisotropic in (0.0, 1.0):
                material = np.zeros(1, layout.Material.dtype)
                material["model"] = model
                material["transmission"], material["anisotropic"] = transmission, anisotropic
                yield material
