"""The lobes that each material model adds up, and their numbers in a kernel that can show one alone."""

from __future__ import annotations

from enum import IntEnum

from gpu.layout import MaterialModel


class Lobe(IntEnum):
    """Numbers of shaders/bsdf/lobe.glsl. `MULTISCATTER` is light that leaves the microfacets after several of them,
    on either side; `TRANSMISSION` is refracted light."""

    DIFFUSE = 0
    SPECULAR = 1
    MULTISCATTER = 2
    SHEEN = 3
    CLEARCOAT = 4
    TRANSMISSION = 5


EVERY = len(Lobe)  # stands for all lobes together

_PLAIN = (Lobe.DIFFUSE, Lobe.SPECULAR)
OF_MODEL: dict[MaterialModel, tuple[Lobe, ...]] = {
    MaterialModel.DIFFUSE: (Lobe.DIFFUSE,),
    MaterialModel.DISNEY: (Lobe.DIFFUSE, Lobe.SPECULAR, Lobe.SHEEN, Lobe.CLEARCOAT),
    MaterialModel.METAL_ROUGH: _PLAIN,
    MaterialModel.BLINN_PHONG: _PLAIN,
    MaterialModel.PHONG: _PLAIN,
    MaterialModel.MICROFACET: _PLAIN,
    MaterialModel.PRINCIPLED: tuple(Lobe),
}


def defines() -> dict[str, object]:
    """What shaders/bsdf/lobe.glsl needs defined to let single lobes through."""
    numbers = {f"LOBE_{lobe.name}": f"{lobe.value}u" for lobe in Lobe}
    return {"LOBE_CHOICE": 1, "LOBE_EVERY": f"{EVERY}u", **numbers}
