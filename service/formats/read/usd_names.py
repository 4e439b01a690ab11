"""The files that a layer of USD names, and whether it shows anything, found without the library that reads it: the
command line looks for files beside the layer before any of it is parsed, and the library may not be installed.

A text has them between `@`. A binary layer has every path among its tokens, a list of words that LZ4 compressed
[OpenUSD, pxr/usd/sdf/crateFile.h].
"""

from __future__ import annotations

import re
import struct

from service.formats.formats import CRATE, USD_TEXT, decoded, text

# What stands in a text beside its syntax: strings, which asset paths may be as well, asset paths and comments.
WORDS = rb"""
    \"{3} (?:\\.|[^\\])*? \"{3} | \" (?P<double> (?:\\.|[^\"\\\n])* ) \"
    | '{3} (?:\\.|[^\\])*? '{3} | ' (?P<single> (?:\\.|[^'\\\n])* ) '
    | @@@ (?P<long> .*? ) @@@ | @ (?P<short> [^@\n]* ) @ | \# [^\n]*
    """
WORD = re.compile(WORDS, re.DOTALL | re.VERBOSE)
FILE = re.compile(rb"[^\0]*\.[A-Za-z0-9]{1,8}", re.DOTALL)  # a word that may be the path of a file
# Kinds of prims that are shown, and paths of other layers, which may have some.
SHOWN = re.compile(
    rb"\b(?:Mesh|Sphere|Cube|Cylinder|Cone|Capsule|Plane|PointInstancer|\w+Curves)(?:_1)?\b|\.usd[acz]?\b"
)
SECTIONS = 64  # of a binary layer; six are known
LIST_ENTRY = struct.Struct("<16sqq")  # a section's name, where it begins, and its bytes
MOST_TOKENS = 16 << 20  # bytes of all tokens; a second of work for each 4 MiB


def names_in_layer(data: bytes) -> list[str]:
    """What may be paths of files in a layer, text or binary; [] for any other file, and for one that is broken."""
    if data.startswith(CRATE):
        try:
            found = _tokens(data).split(b"\0")
        except (struct.error, IndexError, ValueError):
            return []  # the importer says what is wrong
    elif (words := text(data)).startswith(USD_TEXT):
        found = [each[each.lastgroup] for each in WORD.finditer(words) if each.lastgroup is not None]
    else:
        return []
    return [decoded(name) for name in dict.fromkeys(found) if FILE.fullmatch(name)]


def may_show(data: bytes) -> bool:
    """False for a layer of materials alone, text or binary; True for any that may show a thing."""
    try:
        return SHOWN.search(_tokens(data) if data.startswith(CRATE) else text(data)) is not None
    except (struct.error, IndexError, ValueError):
        return True


def _tokens(data: bytes) -> bytes:
    """The tokens of a binary layer, a zero after each. Raises ValueError, IndexError, struct.error."""
    version, (contents,) = tuple(data[8:11]), struct.unpack_from("<q", data, 16)
    (count,) = struct.unpack_from("<Q", data, contents)
    for k in range(min(count, SECTIONS)):
        name, start, _ = LIST_ENTRY.unpack_from(data, contents + 8 + k * LIST_ENTRY.size)
        if name.rstrip(b"\0") == b"TOKENS":
            break
    else:
        raise ValueError("it has no tokens")
    _, size = struct.unpack_from("<QQ", data, start)
    if size > MOST_TOKENS:
        raise ValueError("its tokens are too long")
    if version < (0, 4, 0):
        return data[start + 16 : start + 16 + size]
    (packed,) = struct.unpack_from("<Q", data, start + 16)
    return _unpacked(data[start + 24 : start + 24 + packed], size)


def _unpacked(data: bytes, size: int) -> bytes:
    """`size` bytes that USD compressed: a number of blocks of LZ4, or 0 and a single one."""
    if not data[0]:
        return _lz4(data[1:], size)
    out, at = b"", 1
    for _ in range(data[0]):
        (length,) = struct.unpack_from("<i", data, at)
        out += _lz4(data[at + 4 : at + 4 + length], size - len(out))
        at += 4 + length
    return out


def _lz4(block: bytes, size: int) -> bytes:
    """The content of a block, `size` bytes at most. Raises IndexError, ValueError."""
    out, at = bytearray(), 0

    def length(short: int) -> int:
        """A length, which goes on in further bytes where its four bits are full."""
        nonlocal at
        total = short
        while short in (15, 255):
            short, at = block[at], at + 1
            total += short
        return total

    while at < len(block):
        token, at = block[at], at + 1
        literals = length(token >> 4)
        out += block[at : at + literals]
        at += literals
        if at >= len(block):
            break
        back, at = block[at] | block[at + 1] << 8, at + 2
        copied = length(token & 15) + 4
        if not 0 < back <= len(out) or len(out) + copied > size:
            raise ValueError("a block is broken")
        start = len(out) - back
        run = out[start : start + copied]
        out += (run * (copied // len(run) + 1))[:copied]
    return bytes(out)
