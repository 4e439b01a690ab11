"""Defines by which a kernel shows one lobe of a material alone."""

from __future__ import annotations

from gpu.layout.models import Lobe

EVERY = len(Lobe)  # stands for all lobes together


def defines() -> dict[str, object]:
    """The defines by which shaders/bsdf/lobe.glsl lets single lobes through."""
    numbers = {f"LOBE_{lobe.name}": f"{lobe.value}u" for lobe in Lobe}
    return {"LOBE_CHOICE": 1, "LOBE_EVERY": f"{EVERY}u", **numbers}
