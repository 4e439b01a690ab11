"""Pixels -> PNG, JPEG, WebP, AVIF, EXR, Radiance HDR and npy; PNG, WebP and EXR have the picture's recipe.

encoders        how each format is written, with the colour space that it says
metadata        the metadata of PNG, WebP and EXR files
recipe          the scene and settings that a picture was made from, in that metadata
cryptomatte     which things cover how much of each pixel, as EXR files say it
contact_sheet   many pictures on one, each with its name
animation       pictures one after the other, written by a process of their own
animation_main  the process that writes them
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import BinaryIO

from service import displays
from service.formats.images.cryptomatte import Cryptomatte
from service.formats.images.encoders import (
    Array,
    Choices,
    Metadata,
    in_memory,
    over_black,
    write_avif,
    write_exr,
    write_exr_layers,
    write_hdr,
    write_jpeg,
    write_npy,
    write_png,
    write_rgba32f,
    write_webp,
)
from service.formats.images.metadata import read_metadata
from service.views import Aov, Encoding, FileFormat, StreamFormat

__all__ = [
    "FORMATS",
    "LAYERS",
    "encode",
    "encode_layers",
    "over_black",
    "read_metadata",
    "write",
    "write_layers",
]


@dataclass(frozen=True)
class Format:
    """`bits`: the numbers of bits that a channel may have. `is_displayed`: values are display-encoded, not linear.
    `by_openimageio`: the format can only be written to a file with a descriptor."""

    mime: str
    write: Callable[[BinaryIO, Array, Choices], None]
    bits: tuple[int, ...]
    is_displayed: bool
    has_metadata: bool = False
    by_openimageio: bool = False

    def encoding(self, bits: int) -> Encoding:
        """The encoding to request from the renderer; a number of bits that the format lacks is ignored."""
        if not self.is_displayed:
            return "linear"
        return "f4" if bits == 16 and 16 in self.bits else "u1"


FORMATS: dict[FileFormat | StreamFormat, Format] = {
    "png": Format("image/png", write_png, (8, 16), is_displayed=True, has_metadata=True),
    "jpeg": Format("image/jpeg", write_jpeg, (8,), is_displayed=True),
    "webp": Format("image/webp", write_webp, (8,), is_displayed=True, has_metadata=True),
    "avif": Format("image/avif", write_avif, (8,), is_displayed=True),
    "exr": Format("image/x-exr", write_exr, (32,), is_displayed=False, has_metadata=True, by_openimageio=True),
    "hdr": Format("image/vnd.radiance", write_hdr, (32,), is_displayed=False, by_openimageio=True),
    "npy": Format("application/octet-stream", write_npy, (32,), is_displayed=False),
    "rgba32f": Format("application/octet-stream", write_rgba32f, (32,), is_displayed=False),
}
LAYERS: dict[Aov, tuple[str, ...]] = {
    "color": ("R", "G", "B", "A"),
    "albedo": ("albedo.R", "albedo.G", "albedo.B"),
    "normal": ("normal.X", "normal.Y", "normal.Z"),
    "depth": ("depth.Z",),
    "variance": ("variance.R", "variance.G", "variance.B"),
    "shape_id": ("shape_id.I",),
    "material_id": ("material_id.I",),
    "incidence": ("incidence.I",),
}


def encode(
    pixels: Array,
    format: FileFormat | StreamFormat,
    *,
    bits: int = 8,
    quality: int | None = None,
    metadata: Metadata | None = None,
    encoding: displays.Encoding = displays.SRGB,
) -> bytes:
    """A file of one of FORMATS; `pixels` is (height, width, channels), row 0 at the top.

    Displayed formats take display-encoded values with straight alpha, uint8 or float 0..1; JPEG is composited over
    black. The others take linear float32, colour premultiplied; HDR drops alpha. `bits`, 8 or 16, is for PNG alone.
    `encoding` is what displayed values stand for, which their files say.
    """
    row, choices = _row(format), Choices(bits, quality, metadata, encoding)
    if row.by_openimageio:
        return in_memory(lambda file: row.write(file, _three_axes(pixels), choices))
    file = io.BytesIO()  # in_memory takes 40 times as long for rgba32f
    row.write(file, _three_axes(pixels), choices)
    return file.getvalue()


def write(
    file: BinaryIO,
    pixels: Array,
    format: FileFormat | StreamFormat,
    *,
    bits: int = 8,
    metadata: Metadata | None = None,
    encoding: displays.Encoding = displays.SRGB,
) -> None:
    """Write the bytes of `encode` to an empty file with a descriptor, large formats without a copy in memory."""
    _row(format).write(file, _three_axes(pixels), Choices(bits, metadata=metadata, encoding=encoding))


def encode_layers(
    layers: dict[str, Array], metadata: Metadata | None = None, cryptomatte: Cryptomatte | None = None
) -> bytes:
    """An EXR with every AOV as a layer: R G B A, albedo.R, normal.X, depth.Z ... in the order of LAYERS."""
    return in_memory(lambda file: write_layers(file, layers, metadata, cryptomatte))


def write_layers(
    file: BinaryIO, layers: dict[str, Array], metadata: Metadata | None = None, cryptomatte: Cryptomatte | None = None
) -> None:
    """Write the bytes of `encode_layers`, as `write` does."""
    names = [name for name in LAYERS if name in layers]
    flat = [_three_axes(layers[name]) for name in names]
    channels, more = tuple(c for name in names for c in LAYERS[name]), None
    if cryptomatte is not None:
        flat, channels, more = flat + cryptomatte.pixels, channels + cryptomatte.channels, cryptomatte.metadata
    write_exr_layers(file, flat, channels, metadata, more)


def _row(format: FileFormat | StreamFormat) -> Format:
    if format not in FORMATS:
        raise ValueError(f"unknown image format {format!r}; known are {', '.join(FORMATS)}")
    return FORMATS[format]


def _three_axes(pixels: Array) -> Array:
    return pixels.reshape(*pixels.shape[:2], -1)
