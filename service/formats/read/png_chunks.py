"""The chunks of a PNG [W3C, Portable Network Graphics, third edition]: a file without those that Pillow stumbles
over, and what they say of the colours."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from service.formats.images.metadata import PNG_MAGIC as MAGIC
from service.formats.images.metadata import png_chunk

END = b"IEND\xaeB`\x82"
MOST_TEXT = 64 << 20  # bytes of texts when they are inflated: a picture of ours has its whole scene in one
FRAMES = (b"fcTL", b"fdAT")  # of an animation; after the first picture they are not needed
SRGB_PRIMARIES, SRGB_TRANSFERS = 1, (1, 6, 13, 14, 15)  # codes of ITU-T H.273 that mean sRGB or nearly so
SRGB_CORNERS = (0.3127, 0.329, 0.64, 0.33, 0.3, 0.6, 0.15, 0.06)  # x, y of white, red, green and blue


def opened(data: bytes, formats: Sequence[str]) -> Any:
    """An image of which Pillow has decoded nothing but the header. Raises OSError, SyntaxError, ValueError."""
    from PIL import Image, PngImagePlugin

    Image.MAX_IMAGE_PIXELS = None  # `check_size` bounds the size
    PngImagePlugin.MAX_TEXT_CHUNK = PngImagePlugin.MAX_TEXT_MEMORY = MOST_TEXT
    return Image.open(io.BytesIO(readable(data)), formats=list(formats))


def readable(data: bytes) -> bytes:
    """An image file; a PNG without what would refuse a sound picture: damaged chunks of remarks, and the frames of an
    animation. Of few greys, the transparent one is widened to 8 bits, as Pillow widens only the texels."""
    if not data.startswith(MAGIC):
        return data
    bits, kind = data[24:25], data[25:26]
    kept, begun = [MAGIC], False
    for name, body, whole in _chunks(data):
        begun |= name == b"IDAT"
        is_remark = name[:1].islower()
        if is_remark and (not _is_sound(whole) or (begun and name in FRAMES)):
            continue
        if name == b"tRNS" and kind == b"\0" and bits in (b"\2", b"\4") and len(body) == 2:
            most = (1 << bits[0]) - 1
            whole = png_chunk(name, struct.pack(">H", (struct.unpack(">H", body)[0] & most) * (255 // most)))
        kept.append(whole)
    return b"".join(kept)


def remarks(data: bytes) -> Iterator[str]:
    """Warnings about texels that may be damaged, and about primaries and codes of colours that are not followed."""
    found = {name: body for name, body, whole in _chunks(data) if _is_sound(whole)}
    if any(name == b"IDAT" and not _is_sound(whole) for name, _, whole in _chunks(data)):
        yield "a checksum of its texels is wrong: they may be damaged"
    if (codes := found.get(b"cICP")) is not None and len(codes) == 4:
        if codes[0] != SRGB_PRIMARIES or codes[1] not in SRGB_TRANSFERS:
            yield f"its colours are not sRGB (cICP {codes[0]}, {codes[1]}), and are not followed"
        return
    corners = found.get(b"cHRM", b"")
    if len(corners) == 32 and b"sRGB" not in found and b"iCCP" not in found:
        given = np.array(struct.unpack(">8I", corners)) / 100_000
        if np.abs(given - SRGB_CORNERS).max() > 0.01:
            yield "its primaries (cHRM) are not those of sRGB, and are not followed"


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes, bytes]]:
    """Name, body and all bytes of each chunk; of a file that is cut off, the last is what there is."""
    at = len(MAGIC)
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4].ljust(4, b"\0"))
        whole = data[at : at + size + 12]
        yield whole[4:8], whole[8 : 8 + size], whole
        at += size + 12
        if whole[4:8] == b"IEND":
            return


def _is_sound(whole: bytes) -> bool:
    return struct.pack(">I", zlib.crc32(whole[4:-4])) == whole[-4:]
