"""The metadata of PNG, WebP and EXR files, read from the bytes alone: no library opens the file."""

import base64
import html
import json
import re
import struct
import zlib
from collections.abc import Iterator
from typing import Any

KEY = "sunbox"
PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
EXR_MAGIC = b"\x76\x2f\x31\x01"
LONG_TEXT = 4096  # characters: the longest text that stays uncompressed, as image viewers show it whole
TEXT_BYTES = 256 << 20  # most bytes of one inflated text chunk: a few kilobytes can claim gigabytes


def read_metadata(data: bytes) -> dict[str, Any] | None:
    """The JSON object that Sunbox wrote into a PNG, WebP or EXR; None without one. The caller validates it."""
    text = metadata_text(data)
    try:
        found = json.loads(text) if text is not None else None
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def metadata_text(data: bytes) -> bytes | None:
    """The text of that object; None without one."""
    if data.startswith(PNG_MAGIC):
        return next((text for key, text in _png_texts(data) if key == KEY.encode()), None)
    return _webp_text(data) if is_webp(data) else exr_attributes(data).get(KEY)


def is_webp(data: bytes) -> bool:
    """True for the bytes of a WebP."""
    return data[:4] == b"RIFF" and data[8:12] == b"WEBP"


def exr_attributes(data: bytes) -> dict[str, bytes]:
    """The attributes of an EXR's first header, as far as the bytes go; empty for another file."""
    attributes: dict[str, bytes] = {}
    if not data.startswith(EXR_MAGIC):
        return attributes
    at = 8
    while data[at : at + 1] not in (b"\0", b""):
        name_end = data.find(b"\0", at, at + 257)
        type_end = data.find(b"\0", name_end + 1, name_end + 258)
        value = type_end + 5
        if name_end < 0 or type_end < 0 or value > len(data):
            break
        (size,) = struct.unpack_from("<I", data, type_end + 1)
        attributes[data[at:name_end].decode("latin-1")] = data[value : value + size]
        at = value + size
    return attributes


def png_with_text(png: bytes, text: str) -> bytes:
    """The PNG with a text chunk after its header, deflated where it is long; the text must be ASCII."""
    data = text.encode("ascii")
    long = len(data) > LONG_TEXT
    key = KEY.encode() + b"\0"
    chunk = png_chunk(b"zTXt", key + b"\0" + zlib.compress(data)) if long else png_chunk(b"tEXt", key + data)
    header = len(PNG_MAGIC) + 25  # IHDR is always 25 bytes long
    return png[:header] + chunk + png[header:]


def png_with_encoding(png: bytes, codes: tuple[int, int] | None, profile: bytes | None) -> bytes:
    """The PNG with these codes of primaries and transfer (ITU-T H.273) and this ICC profile, and nothing else about
    its colours."""
    chunks = b""
    if codes is not None:
        chunks += png_chunk(b"cICP", bytes([*codes, 0, 1]))  # RGB, full range
    if profile is not None:
        chunks += png_chunk(b"iCCP", b"ICC\0\0" + zlib.compress(profile))
    header = len(PNG_MAGIC) + 25
    at, parts = header, [png[:header], chunks]
    while at + 12 <= len(png):
        size, kind = struct.unpack_from(">I4s", png, at)
        if kind not in (b"sRGB", b"gAMA", b"cHRM", b"iCCP", b"cICP"):
            parts.append(png[at : at + 12 + size])
        at += 12 + size
    return b"".join(parts)


def xmp(text: str) -> bytes:
    """An XMP packet with a text, for a WebP; deflated where it is long. The text must be ASCII."""
    name, value = "recipe", html.escape(text)
    if len(text) > LONG_TEXT:
        name, value = "deflated", base64.b64encode(zlib.compress(text.encode("ascii"))).decode()
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        f'<rdf:Description rdf:about="" xmlns:{KEY}="urn:{KEY}:recipe" {KEY}:{name}="{value}"/></rdf:RDF></x:xmpmeta>'
    ).encode("ascii")


def _webp_text(data: bytes) -> bytes | None:
    at = 12
    while at + 8 <= len(data):
        kind, size = struct.unpack_from("<4sI", data, at)
        if kind == b"XMP " and (found := _XMP.search(data, at + 8, at + 8 + size)) is not None:
            if found[1] == b"recipe":
                return html.unescape(found[2].decode("utf-8", "replace")).encode()
            return _inflated(base64.b64decode(found[2] + b"==="))
        at += 8 + size + size % 2
    return None


_XMP = re.compile(rb'\bsunbox:(recipe|deflated)="([^"]*)"')


def png_chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _png_texts(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Key and text of every text chunk; zTXt and iTXt are inflated where they are compressed."""
    at = len(PNG_MAGIC)
    while at + 12 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        key, _, rest = data[at + 8 : at + 8 + size].partition(b"\0") if kind in _TEXTS else (b"", b"", b"")
        if kind == b"tEXt":
            yield key, rest
        elif kind == b"zTXt":
            yield key, _inflated(rest[1:])
        elif kind == b"iTXt":
            text = rest[2:].split(b"\0", 2)[-1]  # after the language and the translated key
            yield key, _inflated(text) if rest[:1] == b"\1" else text
        at += 12 + size


_TEXTS = (b"tEXt", b"zTXt", b"iTXt")


def _inflated(data: bytes) -> bytes:
    try:
        return zlib.decompressobj().decompress(data, TEXT_BYTES)
    except zlib.error:
        return b""
