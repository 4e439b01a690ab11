"""Image files -> texels, bytes or float32. Runs in the parsing child."""

import io
import os
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import numpy.typing as npt

from service.formats.errors import ParseError
from service.formats.images.metadata import exr_attributes
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
PNG_END = b"IEND\xaeB`\x82"
HDR_SIZE = re.compile(rb"\n([-+])([XY]) +(\d{1,9}) +([-+])(?!\2)[XY] +(\d{1,9})\n")
COLOUR = (("r", "g", "b"), ("red", "green", "blue"))  # names of channels, in lower case
ALPHA = ("a", "alpha")
ORIENTATION = 0x0112  # the EXIF tag
SRGB_NAMES = (b"sRGB", "sRGB".encode("utf-16-be"))  # in the description of a profile
SRGB_GAMMA = 1 / 2.2


def parse_image(format: str, data: bytes, limits: AssetLimits) -> ImageData:
    """Raises ParseError, or the libraries' exceptions."""
    if not data.startswith(SIGNATURES[format]):
        raise ParseError(f"not a {format.upper()} file: it begins with {data[:12]!r}")
    is_8bit = format in PILLOW and not (format == "png" and data[24:25] == b"\x10")
    if is_8bit:
        texels, warnings = _pillow(format, data, limits)
        return ImageData(np.ascontiguousarray(texels), tuple(warnings))
    pixels = _openimageio(format, data, limits)
    ignored = tuple(_header(format, data))
    if not np.isfinite(pixels).all():
        y, x = (int(n) for n in np.argwhere(~np.isfinite(pixels).all(axis=2))[0])
        raise ParseError(f"the texel at x={x}, y={y} is not finite: {pixels[y, x].tolist()}")
    return ImageData(np.ascontiguousarray(pixels, np.float32), ignored)


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


def _pillow(format: str, data: bytes, limits: AssetLimits) -> tuple[npt.NDArray[np.uint8], list[str]]:
    from PIL import Image, UnidentifiedImageError

    Image.MAX_IMAGE_PIXELS = None  # ours is checked below: opening decodes nothing
    try:
        image = Image.open(io.BytesIO(data), formats=[PILLOW[format]])
    except UnidentifiedImageError:
        raise ParseError(f"it begins as {format.upper()} does, but can't be read") from None
    check_size(*image.size, limits)
    if format == "png" and PNG_END not in data:
        raise ParseError("the file is cut off: it has no IEND chunk")
    warnings = list(_unfollowed(image))
    image.load()
    grey = image.mode in ("1", "L")
    transparent = image.mode in ("LA", "PA", "La", "RGBa", "RGBA") or "transparency" in image.info
    converted = image.convert("RGBA" if transparent else "L" if grey else "RGB")
    return np.asarray(converted).reshape(converted.height, converted.width, -1), warnings


def _unfollowed(image: Any) -> Iterator[str]:
    """Warnings about metadata that are not followed: row 0 is always v = 1, and the texture says whether it is
    sRGB."""
    frames = getattr(image, "n_frames", 1)
    if frames > 1:
        yield f"it moves: the first of its {frames} frames is shown"
    turned = image.getexif().get(ORIENTATION, 1)
    if turned in range(2, 9):
        yield f"its EXIF orientation ({turned}) is not followed: texels are used as they are stored"
    profile = image.info.get("icc_profile", b"")
    if profile and not any(name in profile for name in SRGB_NAMES):
        yield "its colour profile is not sRGB, and is not followed"
    elif not profile and "srgb" not in image.info and abs(image.info.get("gamma", SRGB_GAMMA) - SRGB_GAMMA) > 0.01:
        yield f"its gamma ({image.info['gamma']:g}) is not followed: set the texture's color_space"


def _openimageio(format: str, data: bytes, limits: AssetLimits) -> Floats:
    """EXR and Radiance as stored; a PNG of 16 bits with straight alpha, which Pillow would round to 8."""
    _check_header(format, data, limits)
    with _path(data) as path, _opened(format, path) as file:
        part, names = _part(file)
        spec = file.spec()
        check_size(spec.width, spec.height, limits)
        check_size(spec.full_width, spec.full_height, limits)
        first, last = min(names), max(names) + 1
        pixels = file.read_image(part, 0, first, last, "float")
        if pixels is None:
            raise ParseError(_said(file.geterror(), path))
        picked = np.asarray(pixels).reshape(spec.height, spec.width, -1)[:, :, [k - first for k in names]]
        return _upright(_framed(picked, spec), data) if format == "hdr" else _framed(picked, spec)


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
        for window in (attributes.get("dataWindow", b""), attributes.get("displayWindow", b"")):
            if len(window) == 16:
                left, top, right, bottom = struct.unpack("<iiii", window)
                check_size(right - left + 1, bottom - top + 1, limits)


def _part(file: Any) -> tuple[int, list[int]]:
    """The first part with a colour image, or else a grey one, and the places of its channels: RGB, RGBA or one."""
    seen: list[str] = []
    grey: tuple[int, list[int]] | None = None
    part = 0
    while file.seek_subimage(part, 0):
        names = list(file.spec().channelnames)
        found = _colored(names)
        if found:
            return _plain(file.spec(), part, found)
        if grey is None and (len(names) == 1 or names == ["Y", "A"]):
            grey = part, [0] if len(names) == 1 else [0, 0, 0, 1]
        seen += names
        part += 1
    if grey is not None and file.seek_subimage(grey[0], 0):
        return _plain(file.spec(), *grey)
    raise ParseError(f"it has no channels R, G and B; it has {', '.join(seen[:20])}")


def _colored(names: list[str]) -> list[int]:
    """The places of red, green, blue and perhaps alpha, of the first layer that has them; [] without any."""
    places = {name.lower(): k for k, name in reversed(list(enumerate(names)))}
    for layer in dict.fromkeys(["", *(name.rpartition(".")[0].lower() + "." for name in names if "." in name)]):
        for colour in COLOUR:
            wanted = [layer + name for name in colour]
            if all(name in places for name in wanted):
                alpha = [layer + name for name in ALPHA if layer + name in places][:1]
                return [places[name] for name in wanted + alpha]
    return []


def _plain(spec: Any, part: int, channels: list[int]) -> tuple[int, list[int]]:
    if spec.deep:
        raise ParseError("deep images are not supported")
    if spec.depth > 1:
        raise ParseError("images with depth are not supported")
    return part, channels


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
