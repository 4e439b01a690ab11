"""The directions of KHR_materials_anisotropy's texture as angles, which `anisotropic_rotation` reads."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.texture_bake import pixels, png
from service.formats.read.gltf.textures import Textures

BINS = 36  # bins of 5 degrees: angles begin at the one into which the fewest texels point
EVEN = 1.0  # degrees; an image whose directions differ by less counts as one direction


def rotation(textures: Textures, info: JsonView | None, name: str | None, turn: float) -> Any:
    """The rotation in degrees, or the texture that gives it. `info` is the file's texture, `name` the document's name
    for it; `turn` (radians) is added.
    """
    if info is None or name is None:
        return math.degrees(turn)
    key = f"brushed {turn!r}", info.pointer
    if key not in textures.made:
        textures.made[key] = _made(np.asarray(pixels(textures, info)), math.degrees(turn))
        if isinstance(textures.made[key][0], bytes):
            textures.made[key][0] = textures.store(textures.made[key][0], info.pointer)
    found, *factor = textures.made[key]
    if not factor:
        return found
    settings = {key: value for key, value in textures.documents[name].items() if key != "asset"}
    made = textures.add(found, settings, textures.file.follow(info, "index", "textures"))
    return {"texture": made, "factor": factor[0]}


def _made(texels: np.ndarray, turn: float) -> list[Any]:
    """From (h, w, 4) bytes an angle, or a PNG and the factor that makes its bytes angles, all in degrees.

    Anisotropy has an axis but no sense, so angles are 0..180 degrees above the one at which the fewest texels lie:
    there a filter that blends the last angle with the first goes astray. A step of 8 bits is at most 1.4 degrees.
    """
    used = texels[..., 2] > 0  # where the strength is 0 the direction has no meaning
    pair = texels[..., 0].astype(np.uint16) * 256 + texels[..., 1]
    counts = np.bincount(pair[used], minlength=1 << 16)
    x, y = np.divmod(np.arange(1 << 16), 256)
    angles = (np.degrees(np.arctan2(2 * y - 255, 2 * x - 255)) + turn) % 180
    found = np.flatnonzero(counts)
    if not len(found):
        return [turn]
    width = 180 / BINS
    crowd = np.bincount((angles / width).astype(int) % BINS, counts, BINS)
    start = (int(crowd.argmin()) + 0.5) * width
    above = (angles - start) % 180 + start
    if np.ptp(above[found]) < EVEN:
        return [float(np.average(above[found], weights=counts[found]))]
    values = np.rint(above / (start + 180) * 255).astype(np.uint8)
    return [png(values[pair]), start + 180]
