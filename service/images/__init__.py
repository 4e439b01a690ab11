"""Pixels -> PNG, JPEG, WebP, EXR, Radiance HDR and npy, with what they were made from in PNG's and EXR's metadata.

metadata  what PNG and EXR files carry beside their pixels
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from service.images.metadata import KEY, png_with_text, read_metadata

__all__ = ["LAYERS", "MIME", "encode", "encode_layers", "read_metadata", "write", "write_layers"]

MIME = {
    "png": "image/png",
    "jpeg": "image/jpeg",
    "webp": "image/webp",
    "exr": "image/x-exr",
    "hdr": "image/vnd.radiance",
    "npy": "application/octet-stream",
}
QUALITY = 80
FULL_COLOUR = 90  # from this JPEG quality on colour is kept at full resolution: 4:4:4
PNG_LEVEL = 1  # zlib's: higher ones take several times as long for some percent
BAND = 128  # rows of all layers that are put together at a time; a multiple of the 16 that EXR compresses at once
CHANNELS = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}
LAYERS = {
    "color": ("R", "G", "B", "A"),
    "albedo": ("albedo.R", "albedo.G", "albedo.B"),
    "normal": ("normal.X", "normal.Y", "normal.Z"),
    "depth": ("depth.Z",),
    "variance": ("variance.R", "variance.G", "variance.B"),
    "shape_id": ("shape_id.I",),
    "material_id": ("material_id.I",),
}

Array = npt.NDArray[Any]
Metadata = dict[str, Any] | str  # or the JSON of one, in ASCII


def encode(
    pixels: Array, format: str, *, bits: int = 8, quality: int | None = None, metadata: Metadata | None = None
) -> bytes:
    """A file of one of the formats in MIME; `pixels` is (height, width, channels), row 0 at the top.

    PNG, JPEG and WebP take display-encoded values with straight alpha, uint8 or float 0..1; JPEG is laid over black.
    EXR, HDR and npy take linear float32, colour premultiplied; HDR drops alpha. `bits`, 8 or 16, is for PNG alone.
    """
    if format in ("npy", "exr", "hdr"):
        return _in_memory(lambda file: write(file, pixels, format, metadata=metadata))
    pixels = pixels.reshape(*pixels.shape[:2], -1)
    if format == "png":
        png = _pillow(_bytes(pixels), "PNG", compress_level=PNG_LEVEL) if bits == 8 else _png16(pixels)
        return png_with_text(png, _text(metadata)) if metadata is not None else png
    if format == "jpeg":
        quality = QUALITY if quality is None else quality
        sampling = "4:4:4" if quality >= FULL_COLOUR else "4:2:0"
        return _pillow(_over_black(_bytes(pixels)), "JPEG", quality=quality, subsampling=sampling)
    if format == "webp":
        return _pillow(_bytes(pixels), "WEBP", quality=QUALITY if quality is None else quality, method=2)
    raise ValueError(f"unknown image format {format!r}; known are {', '.join(MIME)}")


def write(file: BinaryIO, pixels: Array, format: str, *, bits: int = 8, metadata: Metadata | None = None) -> None:
    """Writes what `encode` gives to an empty file of the system, large formats without a copy in memory."""
    flat = pixels.reshape(*pixels.shape[:2], -1)
    if format == "npy":
        np.save(file, np.ascontiguousarray(flat, np.float32), allow_pickle=False)
    elif format == "exr":
        _write_exr(file, [flat], CHANNELS[flat.shape[2]], metadata)
    elif format == "hdr":
        _write(file, "hdr", [_three(flat)], "float", {})
    else:
        file.write(encode(pixels, format, bits=bits, metadata=metadata))


def encode_layers(layers: dict[str, Array], metadata: Metadata | None = None) -> bytes:
    """An EXR with every AOV as a layer: R G B A, albedo.R, normal.X, depth.Z ... in the order of LAYERS."""
    return _in_memory(lambda file: write_layers(file, layers, metadata))


def write_layers(file: BinaryIO, layers: dict[str, Array], metadata: Metadata | None = None) -> None:
    """Writes what `encode_layers` gives, as `write` does."""
    names = [name for name in LAYERS if name in layers]
    flat = [layers[name].reshape(*layers[name].shape[:2], -1) for name in names]
    _write_exr(file, flat, tuple(c for name in names for c in LAYERS[name]), metadata)


def _write_exr(file: BinaryIO, layers: Sequence[Array], channels: tuple[str, ...], metadata: Metadata | None) -> None:
    attributes = {"compression": "zip", "DateTime": ""}  # or the hour of writing: the same picture is the same file
    if metadata is not None:
        attributes[KEY] = _text(metadata)
    _write(file, "openexr", layers, "float", attributes, channels)


def _png16(pixels: Array) -> bytes:
    """Pillow knows no colour of 16 bits."""
    whole = pixels if pixels.dtype == np.uint16 else np.rint(_unit(pixels) * 65535).astype(np.uint16)
    attributes = {"oiio:UnassociatedAlpha": 1, "png:compressionLevel": PNG_LEVEL}
    return _in_memory(lambda file: _write(file, "png", [whole], "uint16", attributes))


def _in_memory(write: Callable[[BinaryIO], None]) -> bytes:
    with os.fdopen(os.memfd_create("sunbox-image", os.MFD_CLOEXEC), "w+b") as file:
        write(file)
        file.flush()
        return os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0)


def _write(
    file: BinaryIO,
    format: str,
    layers: Sequence[Array],
    kind: str,
    attributes: Mapping[str, str | int],
    channels: tuple[str, ...] = (),
) -> None:
    """By OpenImageIO. `layers` are (height, width, channels) each, and stand beside each other in the file."""
    import OpenImageIO as oiio

    height, width = layers[0].shape[:2]
    depth = sum(layer.shape[2] for layer in layers)
    spec = oiio.ImageSpec(width, height, depth, kind)
    if channels:
        spec.channelnames = channels
        spec.alpha_channel = channels.index("A") if "A" in channels else -1
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(format)
    assert output is not None, f"this OpenImageIO writes no {format}"
    # The library knows files by name only, and each open one has this one.
    fine = output.open(f"/proc/self/fd/{file.fileno()}", spec)
    for top in range(0, height, BAND):
        rows = [layer[top : top + BAND] for layer in layers]
        band = rows[0] if len(rows) == 1 else np.concatenate(rows, axis=2)
        data = np.ascontiguousarray(band, np.uint16 if kind == "uint16" else np.float32)
        fine = fine and output.write_scanlines(top, top + len(band), 0, data)
    if not (fine and output.close()):
        raise OSError(f"{format} could not be written: {output.geterror()}")


def _pillow(pixels: npt.NDArray[np.uint8], format: str, **options: Any) -> bytes:
    from PIL import Image

    stream = io.BytesIO()
    picture = pixels[:, :, 0] if pixels.shape[2] == 1 else pixels
    Image.fromarray(np.ascontiguousarray(picture)).save(stream, format, **options)
    return stream.getvalue()


def _bytes(pixels: Array) -> npt.NDArray[np.uint8]:
    if pixels.dtype == np.uint8:
        same: npt.NDArray[np.uint8] = pixels
        return same
    return np.rint(_unit(pixels) * 255).astype(np.uint8)


def _unit(pixels: Array) -> npt.NDArray[np.float32]:
    if pixels.dtype == np.uint8:
        return pixels.astype(np.float32) / np.float32(255)
    return np.clip(pixels, 0, 1).astype(np.float32)


def _over_black(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    if pixels.shape[2] != 4:
        return pixels
    alpha = pixels[:, :, 3:]
    if (alpha == 255).all():
        return pixels[:, :, :3]
    return ((pixels[:, :, :3].astype(np.uint16) * alpha + 127) // 255).astype(np.uint8)


def _three(pixels: Array) -> Array:
    return np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels[:, :, :3]


def _text(metadata: Metadata) -> str:
    """ASCII, so that the plainest text chunk carries any name."""
    return metadata if isinstance(metadata, str) else json.dumps(metadata, separators=(",", ":"))
