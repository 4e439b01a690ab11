"""Image files -> texels, bytes or float32. Runs in the parsing child."""

import os
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.errors import LAYER, ParseError
from service.formats.images.metadata import exr_attributes
from service.formats.read.exr_cube import FORMAT as CUBE
from service.formats.read.exr_cube import TOLD, latitude_longitude
from service.formats.read.exr_layers import check_sampling, choose
from service.formats.read.hdr_lines import is_new, read_lines
from service.formats.read.png_chunks import END, opened, readable, remarks
from service.formats.types import AssetLimits, Floats, ImageData

PILLOW = {"png": "PNG", "jpeg": "JPEG", "webp": "WEBP"}
OIIO = {"exr": "openexr", "hdr": "hdr"}
SIGNATURES: dict[str, tuple[bytes, ...]] = {
    "png": (b"\x89PNG\r\n\x1a\n",),
    "jpeg": (b"\xff\xd8\xff",),
    "webp": (b"RIFF",),
    "exr": (b"\x76\x2f\x31\x01",),
    "hdr": (b"#?",),
}
HDR_LINE = re.compile(rb"(?m)^(EXPOSURE|COLORCORR|PRIMARIES)[ \t]*=(.*)$")
NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")
REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # x, y of red, green, blue and white
HDR_SIZE = re.compile(rb"\n([-+])([XY]) +(\d{1,9}) +([-+])(?!\2)[XY] +(\d{1,9})\n")
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of Rec.709's primaries
ORIENTATION = 0x0112  # the EXIF tag
SRGB_NAMES = (b"sRGB", "sRGB".encode("utf-16-be"))  # in the description of a profile
SRGB_GAMMA = 1 / 2.2


def parse_image(format: str, data: bytes, limits: AssetLimits, layer: str = "") -> ImageData:
    """The image in a file, of an EXR the layer of this name. Raises ParseError, or the libraries' exceptions."""
    if not data.startswith(SIGNATURES[format]):
        raise ParseError(f"not a {format.upper()} file: it begins with {data[:12]!r}")
    if layer and format != "exr":
        raise ParseError("belongs to EXR files; other images have no layers", LAYER)
    is_8bit = format in PILLOW and not (format == "png" and data[24:25] == b"\x10")
    if is_8bit:
        texels, warnings = _pillow(format, data, limits)
        return ImageData(np.ascontiguousarray(texels), tuple(warnings))
    read = _floats(format, data, limits, layer)
    pixels = read.pixels
    if not np.isfinite(pixels).all():
        y, x = (int(n) for n in np.argwhere(~np.isfinite(pixels).all(axis=2))[0])
        raise ParseError(f"the texel at x={x}, y={y} is not finite: {pixels[y, x].tolist()}")
    said = _unfollowed(_open(format, data, limits), data) if format in PILLOW else _header(format, data)
    told = (*said, *read.warnings)
    return ImageData(np.ascontiguousarray(pixels, np.float32), told, read.layers)


def _header(format: str, data: bytes) -> Iterator[str]:
    """Warnings about entries in the header of a file of floats that are not followed."""
    if format == "exr":
        given = exr_attributes(data).get("chromaticities", b"")
        if len(given) == 32 and np.abs(np.subtract(struct.unpack("<8f", given), REC_709)).max() > 0.01:
            yield "its chromaticities are not those of Rec.709, and are not followed"
    elif format == "hdr":
        size = HDR_SIZE.search(data[:65536])
        for name, value in HDR_LINE.findall(data[: size.start() if size else 0]):
            numbers = re.findall(rb"[-+.\de]+", value.lower())
            if not _neutral(name, [float(one) for one in numbers if NUMBER.fullmatch(one)]):
                yield f"its {name.decode()} ({value[:40].decode('latin-1').strip()}) is not followed"


def _neutral(name: bytes, values: list[float]) -> bool:
    if name == b"PRIMARIES":  # Radiance's own differ from Rec.709's in the white, and a little in green
        return len(values) == 8 and bool(np.abs(np.subtract(values[:6], REC_709[:6])).max() < 0.02)
    return bool(values) and all(value == 1 for value in values)


def check_size(width: int, height: int, limits: AssetLimits) -> None:
    if width < 1 or height < 1 or width * height > limits.max_texels:
        raise ParseError(f"{width} x {height} texels; 1 to {limits.max_texels} are allowed")


def _open(format: str, data: bytes, limits: AssetLimits) -> Any:
    """An image of which only the header was decoded. Raises ParseError."""
    from PIL import UnidentifiedImageError

    try:
        image = opened(data, [PILLOW[format]])
    except UnidentifiedImageError:
        raise ParseError(f"it begins as {format.upper()} does, but can't be read") from None
    check_size(image.width, image.height, limits)
    return image


def _pillow(format: str, data: bytes, limits: AssetLimits) -> tuple[npt.NDArray[np.uint8], list[str]]:
    image = _open(format, data, limits)
    if format == "png" and END not in data:
        raise ParseError("the file is cut off: it has no IEND chunk")
    warnings = list(_unfollowed(image, data))
    image.load()
    grey = image.mode in ("1", "L")
    transparent = image.mode in ("LA", "PA", "La", "RGBa", "RGBA") or "transparency" in image.info
    converted = image.convert("RGBA" if transparent else "L" if grey else "RGB")
    return np.asarray(converted).reshape(converted.height, converted.width, -1), warnings


def _unfollowed(image: Any, data: bytes) -> Iterator[str]:
    """Warnings about metadata that are not followed: row 0 is always v = 1, and the texture says whether it is
    sRGB."""
    frames = getattr(image, "n_frames", 1)
    if image.format == "MPO":  # of phones: a picture with its depth, its other eye or a map of its highlights
        yield f"it holds {frames} pictures: the first one is shown"
    elif frames > 1:
        yield f"it moves: the first of its {frames} frames is shown"
    turned = image.getexif().get(ORIENTATION, 1)
    if turned in range(2, 9):
        yield f"its EXIF orientation ({turned}) is not followed: texels are used as they are stored"
    profile = image.info.get("icc_profile", b"")
    if profile and not any(name in profile for name in SRGB_NAMES):
        yield "its colour profile is not sRGB, and is not followed"
    elif not profile and "srgb" not in image.info and abs(image.info.get("gamma", SRGB_GAMMA) - SRGB_GAMMA) > 0.01:
        yield f"its gamma ({image.info['gamma']:g}) is not followed: set the texture's color_space"
    if image.format == "PNG":
        yield from remarks(data)


def _floats(format: str, data: bytes, limits: AssetLimits, layer: str) -> ImageData:
    """EXR and Radiance as stored; a PNG of 16 bits with straight alpha, which Pillow would round to 8."""
    _check_header(format, data, limits)
    if format == "hdr" and (old := _old_lines(data)) is not None:
        return ImageData(_upright(old, data))
    with _path(readable(data)) as path, _opened(format, path) as file:
        choice = choose(file, layer)
        spec = file.spec()
        if spec.depth > 1:
            raise ParseError("images with depth are not supported")
        check_size(spec.width, spec.height, limits)
        check_size(spec.full_width, spec.full_height, limits)
        names = choice.layer.channels
        first, last = min(names), max(names) + 1
        pixels = file.read_image(choice.layer.part, 0, first, last, "float")
        if pixels is None:
            raise ParseError(_said(file.geterror(), path))
        is_cube = spec.get_string_attribute("textureformat") == CUBE
        picked = np.asarray(pixels).reshape(spec.height, spec.width, -1)[:, :, [k - first for k in names]]
    picked = _rgb(picked) if choice.layer.is_chroma else picked
    if is_cube:
        return ImageData(latitude_longitude(picked, limits), (*choice.warnings, TOLD), choice.names)
    framed = _framed(picked, spec)
    return ImageData(_upright(framed, data) if format == "hdr" else framed, choice.warnings, choice.names)


def _old_lines(data: bytes) -> Floats | None:
    """The texels of a Radiance file with flat lines or the older run lengths; None for one with the newer."""
    size = HDR_SIZE.search(data[:65536])
    if size is None or is_new(data, size.end(), int(size[5])):
        return None
    return read_lines(data, size.end(), int(size[3]), int(size[5]))


@contextmanager
def exr_file(data: bytes, limits: AssetLimits) -> Iterator[Any]:
    """OpenImageIO's reader of an EXR file, whose header has been checked. Raises ParseError."""
    _check_header("exr", data, limits)
    with _path(data) as path, _opened("exr", path) as file:
        yield file


@contextmanager
def _opened(format: str, path: str) -> Iterator[Any]:
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(path, config)
    if file is None or file.format_name() != OIIO.get(format, format):
        oiio.geterror()  # says only that no reader took it
        raise ParseError(f"it begins as {format.upper()} does, but its header can't be read or is cut off")
    try:
        yield file
    finally:
        file.close()


@contextmanager
def _path(data: bytes) -> Iterator[str]:
    """A path to a file in memory: OpenImageIO reads by path only, and this process may open no file that can be
    uploaded."""
    with open(os.memfd_create("sunbox-image", os.MFD_CLOEXEC), "wb") as file:
        file.write(data)
        file.flush()
        yield f"/proc/self/fd/{file.fileno()}"


def _check_header(format: str, data: bytes, limits: AssetLimits) -> None:
    """Check the size in the header before a library reads the file: the library's error would not name the size."""
    if format == "hdr":
        header = HDR_SIZE.search(data[:65536])
        if header is None:
            raise ParseError("the header is cut off: it gives no size such as `-Y 512 +X 1024`")
        if b"xyze" in data[: header.start()]:
            raise ParseError("its texels are XYZ (32-bit_rle_xyze); 32-bit_rle_rgbe is supported")
        check_size(int(header[5]), int(header[3]), limits)
    elif format == "exr":
        attributes = exr_attributes(data)
        check_sampling(attributes)
        for window in (attributes.get("dataWindow", b""), attributes.get("displayWindow", b"")):
            if len(window) == 16:
                left, top, right, bottom = struct.unpack("<iiii", window)
                check_size(right - left + 1, bottom - top + 1, limits)


def _rgb(pixels: Floats) -> Floats:
    """Red, green and blue, and alpha where there is one, from luminance and chroma: RY is R / Y - 1, BY B / Y - 1."""
    y = pixels[..., :1]
    red, blue = (pixels[..., 1:2] + 1) * y, (pixels[..., 2:3] + 1) * y
    green = (y - LUMINANCE[0] * red - LUMINANCE[2] * blue) / LUMINANCE[1]
    return np.concatenate([red, green, blue, pixels[..., 3:]], axis=2).astype(np.float32)


def _framed(pixels: npt.NDArray[Any], spec: Any) -> Floats:
    """The data window put into the display window, black around it."""
    left, top = spec.x - spec.full_x, spec.y - spec.full_y
    if (left, top, spec.width, spec.height) == (0, 0, spec.full_width, spec.full_height):
        return pixels
    framed = np.zeros((spec.full_height, spec.full_width, pixels.shape[2]), np.float32)
    x, y = max(left, 0), max(top, 0)
    if x >= spec.full_width or y >= spec.full_height or min(spec.width + left, spec.height + top) <= 0:
        raise ParseError("its data window lies outside of its display window: none of it is visible")
    inside = pixels[y - top : spec.full_height - top, x - left : spec.full_width - left]
    framed[y : y + inside.shape[0], x : x + inside.shape[1]] = inside
    return framed


def _upright(pixels: Floats, data: bytes) -> Floats:
    """A Radiance file with its rows from the top and its columns from the left.

    Y grows upwards and X to the right; the axis named first goes from one scan line to the next.
    """
    header = HDR_SIZE.search(data[:65536])
    if header is None:
        return pixels
    rows, columns = header[1], header[4]
    if header[2] == b"X":
        pixels, rows, columns = pixels.transpose(1, 0, 2), columns, rows
    return pixels[:: 1 if rows == b"-" else -1, :: 1 if columns == b"+" else -1]


def _said(message: str, path: str) -> str:
    return message.replace(f'"{path}"', "the file").replace(path, "the file").strip()[:300] or "it can't be read"
