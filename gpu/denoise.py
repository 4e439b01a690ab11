"""Open Image Denoise over pixels that were read back. Runs without GL, off the render loop: on the processor, or by
`oidn.GpuFilter` on the GPU.

Attila Afra, "Intel Open Image Denoise" 2.5; a network trained on noisy renderings. It is biased: `sunbox bench
tradeoff` says by how much. It gives the same bits for the same pixels on the same processor; no GPU promises that.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import metadata, util

import numpy as np

from gpu.layout import LUMINANCE

GUIDE_SAMPLES = 16  # of the first hit's albedo and normal; 256 give the same error to three digits
SMALLEST = 16  # pixels a side; smaller pictures are mostly the network's padding: 1 x 1 came out 6 times too dark
# In units of the picture's typical radiance: brighter pixels stay as they were rendered. The network's curve ends at
# 65504, and beyond that it invents values (1e20 came out as 3.5e20).
BRIGHTEST = 1e4
PROCESSOR = "the processor"
_LUMINANCE = np.array(LUMINANCE)

# Colour, albedo and normal, and whether it is to err less, as `denoise` passes them on; what comes back is colour.
Filter = Callable[[np.ndarray, np.ndarray | None, np.ndarray | None, bool], np.ndarray]


def version(place: str = "") -> str | None:
    """The library's version, read without loading it, and the place where it runs; None where it is not installed."""
    if util.find_spec("pyoidn") is None:
        return None
    return f"Open Image Denoise (pyoidn {metadata.version('pyoidn')})" + (place and f" on {place}")


@cache
def missing() -> str | None:
    """Why nothing can be denoised here; None where it can. Loads the library."""
    try:
        import pyoidn

        pyoidn.denoise(np.ones((SMALLEST, SMALLEST, 3), np.float32), hdr=True)
    except (ImportError, OSError, RuntimeError) as error:
        return f"Open Image Denoise (pyoidn) cannot be loaded: {error}"
    return None


def on_processor(color: np.ndarray, albedo: np.ndarray | None, normal: np.ndarray | None, fine: bool) -> np.ndarray:
    """The denoised picture, (height, width, 3) float32. Raises RuntimeError where the library fails."""
    import pyoidn

    smooth: np.ndarray = pyoidn.denoise(color, albedo, normal, hdr=True, quality="high" if fine else "fast")
    return smooth


def denoise(
    color: np.ndarray,
    albedo: np.ndarray | None,
    normal: np.ndarray | None,
    fine: bool = True,
    by: Filter = on_processor,
) -> np.ndarray:
    """The picture without its noise: `color` (height, width, 4) linear float32, premultiplied; alpha stays as it is.

    `albedo` 0..1 and `normal` -1..1, (height, width, 3), are averages over the first hits, or both None. `fine` takes
    twice as long and errs less. Finite and non-negative where `color` is; black and tiny pictures come back as they
    are. `by`: what the library's filter runs on. Raises RuntimeError where that fails.
    """
    height, width = color.shape[:2]
    alpha = color[..., 3:]
    seen = np.divide(color[..., :3], alpha, out=np.zeros_like(color[..., :3]), where=alpha > 0)
    typical = _typical(seen)
    if typical == 0 or min(height, width) < SMALLEST:
        return color
    with np.errstate(over="ignore"):  # pixels that become infinite are left as they were rendered
        relative = (seen / np.float64(typical)).astype(np.float32)  # the library's own exposure fails below 1e-10
    smooth = by(
        np.minimum(relative, np.float32(BRIGHTEST)),
        None if albedo is None else np.clip(albedo, 0, 1).astype(np.float32),
        None if normal is None else np.clip(normal, -1, 1).astype(np.float32),
        fine,
    )
    keep = (relative.max(axis=2, keepdims=True) >= BRIGHTEST) | ~np.isfinite(smooth).all(axis=2, keepdims=True)
    out = color.copy()
    out[..., :3] = np.where(keep, color[..., :3], (np.maximum(smooth, 0) * typical).astype(np.float32) * alpha)
    return out


def _typical(radiance: np.ndarray) -> float:
    """Geometric mean of the luminances that are not 0; 0 for a black picture."""
    luminance = radiance.astype(np.float64) @ _LUMINANCE
    lit = luminance[luminance > 0]
    return float(np.exp(np.log(lit).mean())) if lit.size else 0.0
