"""Material libraries (.mtl) as statements: numbers and maps by keyword, in lower case, as exporters differ in case.

The statements are those of Wavefront's Advanced Visualizer, and Pr, Pm, Ps, Pc, Pcr, aniso, anisor and norm, which
Exocortex added and Blender writes.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace

from service.formats.errors import ParseError
from service.formats.formats import decoded, text
from service.formats.read.obj.libraries import without_comment
from service.formats.read.scenes.warnings import Warnings

MAX_BYTES = 16 << 20  # bytes of a library; a thousand materials take 0.3 MiB
COLORS = {"ka", "kd", "ks", "ke", "tf"}
SCALARS = {"ns", "ni", "d", "tr", "illum", "pr", "pm", "ps", "pc", "pcr", "aniso", "anisor"}
MAPS = {"map_kd", "map_ks", "map_ke", "map_d", "map_pr", "map_pm", "map_ps", "map_pc", "map_pcr", "norm", "map_bump",
        "disp"}  # fmt: skip
ALIASES = {"bump": "map_bump", "map_disp": "disp", "map_norm": "norm", "map_kn": "norm", "map_opacity": "map_d"}
# Ambient light: nearly every library has it, and as light is traced it has no place in the picture. Their places are
# recorded for materials that have nothing else.
AMBIENT = {"ka", "map_ka"}
IGNORED = {
    "map_ns": "exponents in a texture (map_Ns) are not supported; Ns is used alone",
    "map_tr": "map_Tr is not supported; map_d is",
    "map_tf": "map_Tf is not supported; Tf is used alone",
    "decal": "decals are not supported",
    "map_decal": "decals are not supported",
    "refl": "reflection maps (refl) are not used: reflections are traced",
    "map_refl": "reflection maps (refl) are not used: reflections are traced",
    "map_ao": "occlusion maps are not used: occlusion is traced",
    "map_rma": "maps of several quantities at once (map_RMA) are not supported",
    "map_orm": "maps of several quantities at once (map_ORM) are not supported",
    "sharpness": "sharpness is not used: reflections are traced",
    "map_aat": "map_aat is not used: every edge is antialiased",
}
# The number of words that follow an option of a map; `-o`, `-s` and `-t` are followed by one to three numbers.
OPTIONS = {"-blendu": 1, "-blendv": 1, "-bm": 1, "-boost": 1, "-cc": 1, "-clamp": 1, "-imfchan": 1, "-mm": 2,
           "-texres": 1, "-type": 1}  # fmt: skip
MOST_READINGS = 16  # of one line
VECTORS = {"-o": 0.0, "-s": 1.0, "-t": 0.0}  # the value of a number that is not given
WORD = re.compile(r"\S+")
COMMENT = re.compile(r"(?<!1\.)#.*")  # after numbers; `1.#QNAN` is what a C library prints for one that is none


@dataclass(frozen=True)
class Map:
    """A reference to an image, with the words of its options; of `-o`, `-s` and `-t` the first two numbers."""

    place: str  # FILE:LINE
    source: str  # the path of the library
    reference: str
    options: dict[str, tuple[str, ...]] = field(default_factory=dict)
    vectors: dict[str, tuple[float, float]] = field(default_factory=dict)
    others: tuple[Map, ...] = ()  # other ways to read the line, where there is no file of this name


@dataclass
class MtlMaterial:
    """One material of a library. `numbers` are finite: one for SCALARS, three for COLORS."""

    name: str
    place: str
    numbers: dict[str, tuple[float, ...]] = field(default_factory=dict)
    maps: dict[str, Map] = field(default_factory=dict)
    places: dict[str, str] = field(default_factory=dict)  # FILE:LINE of each statement; of Ka where it is not black

    def number(self, keyword: str, default: float) -> float:
        return self.numbers.get(keyword, (default,))[0]

    def color(self, keyword: str, default: float) -> tuple[float, ...]:
        return self.numbers.get(keyword, (default,) * 3)


def read_mtl(path: str, data: bytes, notes: Warnings) -> dict[str, MtlMaterial]:
    """The materials of a library by name. There are warnings about unknown and unused statements. Raises
    ParseError."""
    file = path.rpartition("/")[2]
    if len(data) > MAX_BYTES:
        raise ParseError(f"it has {len(data)} bytes; {MAX_BYTES} are allowed of a material library", file)
    found: dict[str, MtlMaterial] = {}
    current: MtlMaterial | None = None
    lines = text(data).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    for number, line in enumerate(map(decoded, lines), 1):
        keyword, rest = _statement(line)
        place = f"{file}:{number}"
        if not keyword:
            continue
        if keyword == "newmtl":
            current = MtlMaterial(rest, place)
            if rest in found:
                notes.add(place, "a material of this name is defined twice; the first definition is used")
            found.setdefault(rest, current)
        elif current is not None:
            _add(current, keyword, rest, place, path, notes)
        else:
            notes.add(place, f"{keyword[:40]} stands before the first newmtl and is ignored")
    for name in list(found):
        found.setdefault(without_comment(name), found[name])
    return found


def _statement(line: str) -> tuple[str, str]:
    """The keyword in lower case, and the rest of the line; of a comment, whose first letter is #, nothing."""
    words = line.split(None, 1)
    if not words or words[0].startswith("#"):
        return "", ""
    keyword = words[0].lower()
    return ALIASES.get(keyword, keyword), "".join(words[1:]).strip()


def _add(material: MtlMaterial, keyword: str, rest: str, place: str, path: str, notes: Warnings) -> None:
    if keyword in AMBIENT:
        if keyword == "ka" and not any(_numbers(keyword, rest) or ()):
            return
        if keyword == "map_ka":
            material.maps[keyword] = _map(rest, place, path)
    elif keyword in COLORS or keyword in SCALARS:
        values = _numbers(keyword, rest)
        if values is None:
            notes.add(place, f"{keyword} is not followed by the numbers that it needs and is ignored")
            return
        material.numbers[keyword] = values
    elif keyword in MAPS:
        found = _map(rest, place, path)
        if not found.reference:
            notes.add(place, f"{keyword} names no file and is ignored")
            return
        material.maps[keyword] = found
    else:
        if "map" in keyword or keyword in ("refl", "decal"):
            material.maps[keyword] = _map(rest, place, path)  # it is not shown, but belongs to the model
        notes.add(place, IGNORED.get(keyword, f"the statement {keyword[:40]!r} is not supported and is ignored"))
        return
    material.places[keyword] = place


def _numbers(keyword: str, rest: str) -> tuple[float, ...] | None:
    """One number, or the three of a colour; a single one is grey. None where they are missing or not finite."""
    words = COMMENT.sub("", rest).split()
    if keyword == "d" and words[:1] == ["-halo"]:
        words = words[1:]
    try:
        values = tuple(float(word) for word in words[: 3 if keyword in COLORS else 1])
    except ValueError:  # `spectral FILE` and `xyz X Y Z` as well
        return None
    if not values or not all(map(math.isfinite, values)):
        return None
    if keyword in COLORS:
        return values if len(values) == 3 else (values[0],) * 3
    return values


def _map(rest: str, place: str, path: str) -> Map:
    """The map as the format says: options come first; the rest of the line is the file's name, blanks included. Other
    ways to read it, `others`, end the name before options that follow it, or before a comment."""
    words = list(WORD.finditer(rest))
    found = Map(place, path, "", {}, {})
    begin = _options(words, found)
    if begin == len(words):
        return found
    start, others = words[begin].start(), []
    for k in range(len(words) - 1, begin, -1):
        word = words[k][0]
        after = Map(place, path, "", dict(found.options), dict(found.vectors))
        if word.startswith("#"):
            words = words[:k]
        elif not _is_option(word) or _options(words[k:], after) < len(words) - k:
            continue
        others.append(replace(after, reference=rest[start : words[k - 1].end()].strip('"')))
    return replace(found, reference=rest[start:].strip('"'), others=tuple(others[:MOST_READINGS]))


def _is_option(word: str) -> bool:
    return word.lower() in OPTIONS or word.lower() in VECTORS


def _options(words: list[re.Match[str]], found: Map) -> int:
    """Read the options with which these words begin into a map; the number of words that they take."""
    k = 0
    while k < len(words) and _is_option(words[k][0]):
        option = words[k][0].lower()
        if option in VECTORS:
            numbers: list[float] = []
            while len(numbers) < 3 and k + 1 < len(words) and (value := _finite(words[k + 1][0])) is not None:
                numbers.append(value)
                k += 1
            first, second = (*numbers[:2], VECTORS[option], VECTORS[option])[:2]
            found.vectors[option] = first, second
        else:
            count = OPTIONS[option]
            found.options[option] = tuple(word[0] for word in words[k + 1 : k + 1 + count])
            k += count
        k += 1
    return min(k, len(words))


def _finite(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
