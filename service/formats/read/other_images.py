"""The images that models and materials name: in a format that textures have, or in one of other programs, which
becomes a PNG. Runs in the parsing child."""

from __future__ import annotations

import io

from service.formats.formats import KINDS, sniff

READ = "PNG, JPEG, WebP, EXR, Radiance HDR"
FORMATS = ("BMP", "DDS", "GIF", "PCX", "PSD", "TGA", "TIFF", "WEBP")
ENDINGS = (".bmp", ".dds", ".gif", ".pcx", ".psd", ".tga", ".tif", ".tiff")
NAMED = f"{READ}, BMP, TGA, TIFF, GIF, DDS, PCX and PSD, the last seven of 8 bits"
GREY = ("1", "L", "LA")
MODES = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "RGBX", "CMYK")  # of 8 bits; others would lose what they hold


def readable(data: bytes, max_texels: int, filename: str = "") -> bytes | None:
    """An image, or a PNG of one in a format of other programs; None for what is neither."""
    format = sniff(data, filename=filename) if data else None
    if format is not None:
        return data if KINDS[format] == "image" else None
    return as_png(data, max_texels)


def as_png(data: bytes, max_texels: int) -> bytes | None:
    """A PNG of the image's first picture; None for what is no such image, or is larger."""
    from PIL import Image, UnidentifiedImageError

    Image.MAX_IMAGE_PIXELS = None  # opening decodes nothing
    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as opened:
            if opened.width * opened.height > max_texels or opened.mode not in MODES:
                return None
            has_alpha = "A" in opened.getbands() or "transparency" in opened.info
            made = io.BytesIO()
            mode = "RGBA" if has_alpha else "RGB"
            if opened.mode in GREY:
                mode = "LA" if has_alpha else "L"
            opened.convert(mode).save(made, "PNG", compress_level=1)
            return made.getvalue()
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, NotImplementedError):
        return None
