"""How a picture may be looked at: the names that the API, the stream, the command line and metadata share.

Nothing heavy is imported here, as the command line's help needs the names. AOVs and curves are those of
gpu/settings.py, which the server's process does not import, and formats those of `images`; tests compare them.
"""

from __future__ import annotations

from typing import Final, Literal, get_args

from service.displays import SHORT

Aov = Literal["color", "albedo", "normal", "depth", "variance", "shape_id", "material_id", "incidence"]
AovOrAll = Literal[Aov, "all"]  # "all" is every AOV as a layer of one file
Curve = Literal["linear", "exponential", "reinhard", "aces", "agx", "pbr_neutral"]
ColorSpace = Literal["srgb", "display_p3"]  # of a displayed picture
Bits = Literal[8, 16]  # of a PNG's channels
LossyFormat = Literal["jpeg", "webp"]
LinearFormat = Literal["exr", "hdr", "npy"]
LosslessFormat = Literal["png", LinearFormat]  # what the command line writes
FileFormat = Literal["png", LossyFormat, "avif", LinearFormat]
StreamFormat = Literal[LossyFormat, "png", "rgba32f"]
BsdfKind = Literal["polar", "distribution", "geometry", "fresnel", "albedo", "slice"]  # of a material, to look at
MapKind = Literal["p", "difference", "flip", "heat"]  # of where two pictures differ
Encoding = Literal["u1", "f4", "linear"]  # display-encoded 8 bits or floats; or the picture itself

AOVS: tuple[Aov, ...] = get_args(Aov)
COLOR_SPACES: tuple[ColorSpace, ...] = get_args(ColorSpace)
CURVES: tuple[Curve, ...] = get_args(Curve)
TONE_MAPS = (*CURVES, *SHORT)  # those of short names; `displays.names` has the others
BSDF_KINDS: tuple[BsdfKind, ...] = get_args(BsdfKind)
MAPS: tuple[MapKind, ...] = get_args(MapKind)
LOSSLESS_FORMATS: tuple[LosslessFormat, ...] = get_args(LosslessFormat)
DEFAULT_TONE_MAP: Final = "pbr_neutral"
LEAST_EXPOSURE, MOST_EXPOSURE = -60, 60  # stops
