"""One function for each format, which writes pixels to a file with a descriptor.

`pixels` is (height, width, channels), row 0 at the top. PNG, JPEG, WebP and AVIF take display-encoded values
with straight alpha, uint8 or float 0..1; the others linear float32, colour premultiplied.
"""

from __future__ import annotations

import io
import json
import os
import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from service.displays import SRGB, Encoding
from service.formats.images.metadata import KEY, PNG_MAGIC, png_chunk, png_with_encoding, png_with_text, xmp

QUALITY = 80
FULL_COLOUR = 90  # from this JPEG quality on colour is kept at full resolution: 4:4:4
SUB = 1  # the number of the filter of a PNG's row
COLOR_TYPES = (0, 4, 2, 6)  # of a PNG with one to four channels
PNG_LEVEL = 1  # zlib's level: higher ones take several times as long to save some percent
AVIF_SPEED = 7  # 0 to 10; lower ones take several times as long to save some percent
BAND = 128  # rows of all layers that are interleaved at a time; a multiple of the 16 that EXR compresses at once
CHANNELS = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}

Array = npt.NDArray[Any]
Metadata = dict[str, Any] | str  # or the JSON of one, in ASCII

# ICC profiles and CICP codes: what the numbers of a picture stand for, as files say it.
# Chromaticities x and y of red, green and blue [ITU-R BT.709, SMPTE EG 432-1, ITU-R BT.2020]; the white is D65.
PRIMARIES = {
    "rec709": ((0.64, 0.33), (0.3, 0.6), (0.15, 0.06)),
    "p3": ((0.68, 0.32), (0.265, 0.69), (0.15, 0.06)),
    "rec2020": ((0.708, 0.292), (0.17, 0.797), (0.131, 0.046)),
}
WHITE = (0.3127, 0.329)
D50 = np.array([0.9642, 1.0, 0.8249])  # the white of a profile's connection space [ICC.1:2022, 7.2.16]
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_SRGB_CURVE = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)  # of type 3: (a x + b)^g, below d c x
_CODES = {"rec709": 1, "rec2020": 9, "p3": 12}, {"srgb": 13, "pq": 16, 2.2: 4}  # ITU-T H.273, tables 2 and 3


@dataclass(frozen=True)
class Choices:
    """Options of all formats; each format ignores the ones that it lacks."""

    bits: int = 8
    quality: int | None = None
    metadata: Metadata | None = None
    encoding: Encoding = SRGB  # what the values of a displayed format stand for

    @property
    def profile(self) -> dict[str, Any]:
        """Pillow's option for the ICC profile; sRGB is what a picture without one is taken for."""
        made = None if self.encoding == SRGB else profile(self.encoding)
        return {} if made is None else {"icc_profile": made}


def write_png(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    png = _png16(pixels) if choices.bits == 16 else _pillow(_bytes(pixels), "PNG", compress_level=PNG_LEVEL)
    if choices.encoding != SRGB:
        png = png_with_encoding(png, cicp(choices.encoding), profile(choices.encoding))
    file.write(png if choices.metadata is None else png_with_text(png, _text(choices.metadata)))


def write_jpeg(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    """Write a JPEG, over black, as it has no alpha."""
    quality = QUALITY if choices.quality is None else choices.quality
    sampling = "4:4:4" if quality >= FULL_COLOUR else "4:2:0"
    file.write(_pillow(over_black(_bytes(pixels)), "JPEG", quality=quality, subsampling=sampling, **choices.profile))


def write_webp(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    quality = QUALITY if choices.quality is None else choices.quality
    made_from = {} if choices.metadata is None else {"xmp": xmp(_text(choices.metadata))}
    file.write(_pillow(_bytes(pixels), "WEBP", quality=quality, method=2, **made_from, **choices.profile))


def write_avif(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    """8 bits, colour at full resolution."""
    quality = FULL_COLOUR if choices.quality is None else choices.quality
    options = {"quality": quality, "subsampling": "4:4:4", "speed": AVIF_SPEED}
    file.write(_pillow(_bytes(pixels), "AVIF", **options, **choices.profile))


def write_exr(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    write_exr_layers(file, [pixels], CHANNELS[pixels.shape[2]], choices.metadata)


def write_hdr(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    """Write a Radiance HDR, which has no alpha."""
    _write(file, "hdr", [_three(pixels)], "float", {})


def write_npy(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    np.save(file, np.ascontiguousarray(pixels, np.float32), allow_pickle=False)


def write_rgba32f(file: BinaryIO, pixels: Array, choices: Choices) -> None:
    """Four floats for each pixel, without a header: other AOVs become opaque, a single channel grey."""
    if pixels.shape[2] != 4:
        pixels = np.concatenate([_three(pixels), np.ones((*pixels.shape[:2], 1), np.float32)], axis=2)
    file.write(np.ascontiguousarray(pixels, np.float32).data)


def write_exr_layers(
    file: BinaryIO,
    layers: Sequence[Array],
    channels: tuple[str, ...],
    metadata: Metadata | None,
    more: Mapping[str, str] | None = None,
) -> None:
    """Write an EXR; `more` are further attributes."""
    attributes = {
        **(more or {}),
        "compression": "zip",
        "DateTime": "",
    }  # else the time of writing: equal pictures give equal files
    if metadata is not None:
        attributes[KEY] = _text(metadata)
    _write(file, "openexr", layers, "float", attributes, channels)


def in_memory(write: Callable[[BinaryIO], None]) -> bytes:
    """The bytes that `write` writes to a file with a descriptor, without which OpenImageIO cannot write."""
    with os.fdopen(os.memfd_create("sunbox-image", os.MFD_CLOEXEC), "w+b") as file:
        write(file)
        file.flush()
        return os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0)


def _png16(pixels: Array) -> bytes:
    """A PNG of 16 bits, whose rows are differences from the texel before. Pillow has no such colour images, and
    OpenImageIO writes to files only, which a process that reads uploads may not open."""
    whole = pixels if pixels.dtype == np.uint16 else np.rint(_unit(pixels) * 65535).astype(np.uint16)
    height, width, channels = whole.shape
    squeezer, parts = zlib.compressobj(PNG_LEVEL), []
    for top in range(0, height, BAND):
        band = np.ascontiguousarray(whole[top : top + BAND], ">u2")
        rows = band.view(np.uint8).reshape(len(band), width, 2 * channels)
        filtered = np.full((len(band), 1 + rows[0].size), SUB, np.uint8)
        filtered[:, 1:] = np.concatenate([rows[:, :1], rows[:, 1:] - rows[:, :-1]], axis=1).reshape(len(band), -1)
        parts.append(squeezer.compress(filtered.data))
    header = struct.pack(">IIBBBBB", width, height, 16, COLOR_TYPES[channels - 1], 0, 0, 0)
    body = png_chunk(b"IDAT", b"".join(parts) + squeezer.flush())
    return PNG_MAGIC + png_chunk(b"IHDR", header) + body + png_chunk(b"IEND", b"")


def _write(
    file: BinaryIO,
    format: str,
    layers: Sequence[Array],
    kind: str,
    attributes: Mapping[str, str | int],
    channels: tuple[str, ...] = (),
) -> None:
    """An EXR, by OpenImageIO. `layers` are (height, width, channels) each, and are interleaved in the file."""
    import OpenImageIO as oiio

    height, width = layers[0].shape[:2]
    depth = sum(layer.shape[2] for layer in layers)
    spec = oiio.ImageSpec(width, height, depth, kind)
    if channels:
        spec.channelnames = channels
        spec.alpha_channel = channels.index("A") if "A" in channels else -1
    for name, value in attributes.items():
        spec.attribute(name, value)
    if format == "openexr":
        places = [coordinate for xy in (*PRIMARIES["rec709"], WHITE) for coordinate in xy]
        spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), places)
        spec.attribute("colorInteropID", "lin_rec709_scene")  # by the Color Interop Forum's recommendation
    output = oiio.ImageOutput.create(format)
    assert output is not None, f"this OpenImageIO writes no {format}"
    # OpenImageIO takes a name and no descriptor; this is the name of an open file.
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


def over_black(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    if pixels.shape[2] != 4:
        return pixels
    alpha = pixels[:, :, 3:]
    if (alpha == 255).all():
        return pixels[:, :, :3]
    return ((pixels[:, :, :3].astype(np.uint16) * alpha + 127) // 255).astype(np.uint8)


def _three(pixels: Array) -> Array:
    return np.repeat(pixels, 3, axis=2) if pixels.shape[2] == 1 else pixels[:, :, :3]


def _text(metadata: Metadata) -> str:
    """JSON in ASCII, so that the plainest text chunk can store any name."""
    return metadata if isinstance(metadata, str) else json.dumps(metadata, separators=(",", ":"))


def cicp(encoding: Encoding) -> tuple[int, int] | None:
    """The codes of primaries and transfer of ITU-T H.273; None where it has none."""
    primaries, transfers = _CODES
    transfer = transfers.get(encoding.transfer)
    return None if transfer is None else (primaries[encoding.primaries], transfer)


def xyz_matrix(primaries: tuple[tuple[float, float], ...]) -> np.ndarray:
    """XYZ from linear values of these primaries, white having Y = 1."""
    columns = np.array([_xyz(*xy) for xy in primaries]).T
    return np.asarray(columns * np.linalg.solve(columns, _xyz(*WHITE)))


@cache
def profile(encoding: Encoding) -> bytes | None:
    """A display profile of version 4 [ICC.1:2022]; None for PQ, whose white has no place in one."""
    if encoding.transfer == "pq":
        return None
    scale = np.diag((BRADFORD @ D50) / (BRADFORD @ _xyz(*WHITE)))
    adapted = np.linalg.inv(BRADFORD) @ scale @ BRADFORD
    columns = (adapted @ xyz_matrix(PRIMARIES[encoding.primaries])).T
    srgb = encoding.transfer == "srgb"
    values = _SRGB_CURVE if srgb else (float(encoding.transfer),)
    curve = b"para" + struct.pack(">IHH", 0, 3 if srgb else 0, 0) + _fixed(values)
    name = f"{encoding.primaries} {encoding.transfer}" if encoding != Encoding("p3") else "Display P3"
    tags = [("desc", _icc_text(name)), ("cprt", _icc_text("CC0")), ("wtpt", _place(D50))]
    tags += [("chad", b"sf32\0\0\0\0" + _fixed(adapted.ravel()))]
    tags += [(f"{channel}XYZ", _place(column)) for channel, column in zip("rgb", columns, strict=True)]
    tags += [(f"{channel}TRC", curve) for channel in "rgb"]
    table, data = struct.pack(">I", len(tags)), b""
    start = 128 + 4 + 12 * len(tags)
    for tag, body in tags:
        table += tag.encode() + struct.pack(">II", start + len(data), len(body))
        data += body + b"\0" * (-len(body) % 4)
    size = start + len(data)
    made = struct.pack(">6H", 2026, 1, 1, 0, 0, 0)  # one date for all, so that equal pictures give equal files
    head = struct.pack(">I4sI4s4s4s", size, b"\0" * 4, 0x04400000, b"mntr", b"RGB ", b"XYZ ") + made + b"acsp"
    head = (head.ljust(68, b"\0") + _fixed(D50)).ljust(128, b"\0")
    return head + table + data


def _xyz(x: float, y: float) -> np.ndarray:
    return np.array([x / y, 1.0, (1 - x - y) / y])


def _fixed(values: object) -> bytes:
    """Numbers with 16 bits after the point."""
    return bytes(np.rint(np.asarray(values, float) * 65536).astype(">i4").data)


def _place(xyz: np.ndarray) -> bytes:
    return b"XYZ \0\0\0\0" + _fixed(xyz)


def _icc_text(text: str) -> bytes:
    body = text.encode("utf-16-be")
    return b"mluc" + struct.pack(">3I2s2sII", 0, 1, 12, b"en", b"US", len(body), 28) + body
