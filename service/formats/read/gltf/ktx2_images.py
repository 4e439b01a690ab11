"""KHR_texture_basisu: images of ETC1S and UASTC texels in KTX2, decoded through Binomial's transcoder, as PNG files.

Only the largest level is read: Sunbox makes its own levels.
"""

from __future__ import annotations

import io

from service.formats.errors import MissingExtra, ParseError
from service.formats.formats import PACKAGES
from service.formats.read.image import check_size
from service.formats.types import AssetLimits

NAME = "KHR_texture_basisu"
START = b"\xabKTX 20\xbb\r\n\x1a\n"


def as_png(data: bytes, limits: AssetLimits, pointer: str) -> bytes:
    """The image as RGB, or as RGBA where it has alpha. Raises ParseError, MissingExtra."""
    try:
        import opengl_basisu
    except ImportError:
        raise MissingExtra(f"KTX2 textures need {PACKAGES['ktx2'][0]} on the server", pointer) from None
    from PIL import Image

    try:
        texture = opengl_basisu.open(data)
        if texture.faces != 1 or texture.layers > 1:
            raise ParseError(f"has {texture.faces} faces and {texture.layers} layers; an image has one", pointer)
        check_size(texture.width, texture.height, limits)
        texels = texture.transcode(opengl_basisu.Target.RGBA8).data
    except ValueError as error:  # the root of the library's own
        raise ParseError(f"is a KTX2 image that cannot be decoded ({str(error)[:150]})", pointer) from None
    out = io.BytesIO()
    image = Image.fromarray(texels if texture.has_alpha else texels[..., :3].copy())
    image.save(out, "PNG", compress_level=1)
    return out.getvalue()
