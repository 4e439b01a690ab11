"""The sampler's numbers, drawn on the device."""

from __future__ import annotations

import numpy as np

from gpu import layout
from tests.probing import Prober

N = 1 << 16


def draw(
    prober: Prober, what: int, count: int = N, sampler: int = 0, pair: int = 2, seed: int = 0, replicate: int = 0,
    pixel: tuple[int, int] = (3, 7), filter_name: str = "box", doublings: int = 0, adaptive: int = 0,
) -> np.ndarray:  # fmt: skip
    frame = np.zeros((), layout.Uniforms.dtype)
    frame["seed"], frame["replicate"] = seed, replicate
    defines = {"WHAT": what, "SAMPLER": sampler, "ADAPTIVE": adaptive}
    out = prober.run("numbers.comp", count, {}, defines=defines, frame=frame, filter_name=filter_name,
                     pixel=pixel, pair=pair, doublings=doublings)  # fmt: skip
    return out[0].astype(float)
