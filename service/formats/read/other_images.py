"""Images in formats of other programs, which models name for their textures, as PNG. Runs in the parsing child."""

from __future__ import annotations

import io

FORMATS = ("BMP", "DDS", "GIF", "PCX", "PSD", "TGA", "TIFF", "WEBP")
NAMED = "BMP, TGA, TIFF, GIF, DDS, PCX and PSD"
MODES = ("1", "L", "LA", "P", "PA", "RGB", "RGBA", "RGBX", "CMYK")  # of 8 bits; others would lose what they hold


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
            opened.convert("RGBA" if has_alpha else "RGB").save(made, "PNG", compress_level=1)
            return made.getvalue()
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, NotImplementedError):
        return None
