"""The light of textured shapes: the mean emission by which lights are picked, and the greatest radiance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gpu.layout import LightKind, ShapeKind, texture_records
from service.document.texture import CheckerTexture, ImageTexture, is_projected
from service.pack.geometry.geometry import Geometry
from service.pack.textures.heights import wrapped
from service.pack.textures.images import PackedTexels
from service.pack.textures.recipes import listed
from service.pack.textures.uses import TextureReference
from service.pack.textures.words import record_of, values_of

# Barycentric places at which a triangle's emission is evaluated: the middles of the 16 quarters of its quarters.
_EDGE = np.arange(4)
PLACES = np.array(
    [((i + 1 / 3) / 4, (j + 1 / 3) / 4) for i in _EDGE for j in _EDGE if i + j < 4]
    + [((i + 2 / 3) / 4, (j + 2 / 3) / 4) for i in _EDGE for j in _EDGE if i + j < 3]
)
LEAST = 0.02  # share of the texture's mean that a triangle gets where all of its places are black


def dark(uses: Sequence[TextureReference], texels: PackedTexels) -> list[int]:
    """The materials whose emission is a black texture: without power they are no lamps."""
    return [
        use.material
        for use in uses
        if use.member == "emission" and not (values_of(use, _pixels(use, texels).max(axis=0).max(axis=0)) > 0).any()
    ]


def _pixels(use: TextureReference, texels: PackedTexels) -> np.ndarray:
    """(height, width, channels): the pixels of an image, or the colours of a texture that is computed."""
    colors = listed(use)
    return texels.places[use.key][1].pixels if colors is None else colors


def mean_emission(
    materials: np.ndarray, uses: Sequence[TextureReference], texels: PackedTexels, built: Geometry
) -> tuple[np.ndarray, float]:
    """(mean emission of each light of `built` (n, 3), the greatest radiance of any emission or ambient)."""
    emission, used = materials["emission"].astype(np.float64), built.lights["material"]
    peak = max(float(emission[used].max(initial=0.0)), float(materials["ambient"].max(initial=0.0)))
    for use in uses:
        if use.member == "ambient" or (use.member == "emission" and (used == use.material).any()):
            mean, greatest = _levels(use, texels)
            peak = max(peak, greatest)
            if use.member == "emission":
                emission[use.material] = mean
    shining = emission[used]
    for use in uses:
        if use.member == "emission":
            _triangles(use, texels, built, emission[use.material], shining)
    return shining, peak


def _levels(use: TextureReference, texels: PackedTexels) -> tuple[np.ndarray, float]:
    """(mean (3,), greatest channel) of the radiance that a texture gives."""
    pixels = _pixels(use, texels)
    low, high = texture_records.TEXTURABLE[use.member]
    total, greatest = np.zeros(3), 0.0
    for rows in np.array_split(pixels, max(1, pixels.shape[0] // 256)):  # floats of a part of it at a time
        values = np.clip(values_of(use, rows), low, high)
        total += values.sum(axis=0, dtype=np.float64).sum(axis=0)  # an axis at a time takes a tenth of the time
        greatest = max(greatest, float(values.max()))
    return total / (pixels.shape[0] * pixels.shape[1]), greatest


def _triangles(
    use: TextureReference, texels: PackedTexels, built: Geometry, mean: np.ndarray, shining: np.ndarray
) -> None:
    """Write each emitting triangle's own mean, as most of a textured mesh may be dark."""
    mine = np.flatnonzero((built.lights["kind"] == LightKind.TRIANGLE) & (built.lights["material"] == use.material))
    if use.ramp is not None or not isinstance(use.texture, ImageTexture | CheckerTexture):
        return  # they are alike all over, or vary with places that are not known here
    if is_projected(use.texture):
        return
    second = isinstance(use.texture, ImageTexture) and use.texture.uv == 1
    uvs = built.triangle_uvs_1 if second else built.triangle_uvs
    if not len(mine) or len(uvs) != len(built.shapes[ShapeKind.TRIANGLE]):
        return
    corners = uvs[built.lights["index"][mine]].astype(np.float64)
    total = np.zeros((len(mine), 3))
    low, high = texture_records.TEXTURABLE["emission"]
    for b1, b2 in PLACES:
        uv = (1 - b1 - b2) * corners[:, 0] + b1 * corners[:, 1] + b2 * corners[:, 2]
        total += np.clip(values_of(use, nearest(use, texels, uv)), low, high)
    shining[mine] = np.maximum(total / len(PLACES), LEAST * mean)


def nearest(use: TextureReference, texels: PackedTexels, uv: np.ndarray) -> np.ndarray:
    """(n, channels): the texels of an image or a checker nearest to (n, 2) coordinates."""
    record = record_of(use, texels)
    turn = record["turn"].astype(np.float64).reshape(2, 2)
    uv = uv @ turn.T + [float(record["offset_u"]), float(record["offset_v"])]
    if isinstance(use.texture, CheckerTexture):
        odd = np.floor(uv).sum(axis=1) % 2 != 0
        return np.where(odd[:, None], use.texture.b, use.texture.a).astype(np.float32)
    assert isinstance(use.texture, ImageTexture)
    pixels = texels.places[use.key][1].pixels
    uv = np.stack([wrapped(x, wrap) for x, wrap in zip(uv.T, use.texture.wraps, strict=True)], axis=1)
    size = np.array(pixels.shape[1::-1])
    x, y = np.clip((uv * size).astype(np.int64), 0, size - 1).T
    return np.asarray(pixels[size[1] - 1 - y, x])
