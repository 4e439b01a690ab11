"""EXR files that Sunbox wrote with every layer -> colour, its variance and its samples. Runs in the parsing child."""

from __future__ import annotations

from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.images.metadata import read_metadata
from service.formats.read.image import check_size, exr_file
from service.formats.types import AssetLimits, Floats, RenderedPicture

COLOUR = ("R", "G", "B")
VARIANCE = ("variance.R", "variance.G", "variance.B")
MOST_SAMPLES = 2**24


def parse_rendered(data: bytes, limits: AssetLimits) -> RenderedPicture:
    """Raises ParseError, or the libraries' exceptions."""
    with exr_file(data, limits) as file:
        spec = file.spec()
        check_size(spec.width, spec.height, limits)
        names = list(spec.channelnames)
        missing = [name for name in (*COLOUR, *VARIANCE) if name not in names]
        if missing or spec.deep:
            raise ParseError("it has no layer `variance`: write it with every layer (aov=all)")
        layers = np.concatenate([_layer(file, names, COLOUR), _layer(file, names, VARIANCE)], axis=2)
    if not np.isfinite(layers).all() or (layers[..., 3:] < 0).any():
        raise ParseError("its layers hold values that no render has")
    made = read_metadata(data) or {}
    settings = made.get("settings")
    settings = settings if isinstance(settings, dict) else {}
    samples = _whole(made.get("samples"), MOST_SAMPLES)
    if samples < 1:
        raise ParseError("its metadata do not say how many samples it has: Sunbox did not write it")
    seed, depth = (_whole(settings.get(name), 2**32 - 1) for name in ("seed", "roulette_depth"))
    ways = str(settings.get("estimator"))[:20], str(settings.get("sampler"))[:20], depth
    return RenderedPicture(layers, samples, seed, settings.get("denoise") is True, ways)


def _layer(file: Any, names: list[str], wanted: tuple[str, ...]) -> Floats:
    """(height, width, 3) of three channels."""
    places = [names.index(name) for name in wanted]
    first, last = min(places), max(places) + 1
    spec = file.spec()
    pixels = file.read_image(0, 0, first, last, "float")
    if pixels is None:
        raise ParseError("its pixels can't be read")
    whole = np.asarray(pixels, np.float32).reshape(spec.height, spec.width, -1)
    return np.ascontiguousarray(whole[:, :, [place - first for place in places]])


def _whole(value: Any, most: int) -> int:
    """A number of the metadata; 0 for what is none."""
    return value if type(value) is int and 0 <= value <= most else 0
