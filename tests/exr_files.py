"""EXR files by OpenImageIO: what the tests' own writer of them has not."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenImageIO as oiio


def written(pixels: np.ndarray, names: Sequence[str], dtype: str = "float", tile: int = 0) -> bytes:
    """An EXR of one part."""
    return written_parts([("", pixels, names)], dtype, tile)


def written_parts(parts: list[tuple[str, np.ndarray, Sequence[str]]], dtype: str = "float", tile: int = 0) -> bytes:
    specs = []
    for name, pixels, channels in parts:
        height, width, count = pixels.shape
        spec = oiio.ImageSpec(width, height, count, dtype)
        spec.channelnames = list(channels)
        spec.tile_width = spec.tile_height = tile
        if name:
            spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    return saved(specs, [pixels for _, pixels, _ in parts])


def saved(specs: list[oiio.ImageSpec], parts: list[np.ndarray]) -> bytes:
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        output = oiio.ImageOutput.create(file.name)
        assert output.open(file.name, specs), output.geterror()
        for k, pixels in enumerate(parts):
            assert not k or output.open(file.name, specs[k], "AppendSubimage"), output.geterror()
            assert output.write_image(np.ascontiguousarray(pixels)), output.geterror()
        output.close()
        return Path(file.name).read_bytes()
