"""Computed images that take the place of a file's own: texels in, a PNG out."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from service.formats.errors import ParseError
from service.formats.read.gltf.json_view import JsonView
from service.formats.read.gltf.textures import Textures
from service.formats.read.png_chunks import opened


def pixels(textures: Textures, info: JsonView | None) -> Any:
    """The RGBA pixels of a texture's image; None where it has no image."""
    from service.formats.read.image import check_size

    source = textures.source(textures.file.follow(info, "index", "textures")) if info else None
    if source is None:
        return None
    try:
        image = opened(textures.data(source), ["PNG", "JPEG", "WEBP"])
        check_size(image.width, image.height, textures.file.limits)
        return image.convert("RGBA")
    except (OSError, SyntaxError, ValueError):
        raise ParseError("is a broken image", source.pointer) from None


def png(texels: np.ndarray) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(texels)).save(out, "PNG", compress_level=1)
    return out.getvalue()
