"""The models and materials in a zip, by the names and the first bytes of its files, and which one is meant."""

from __future__ import annotations

import posixpath
from dataclasses import dataclass, field

from service.formats import formats
from service.formats.errors import ParseError
from service.formats.formats import KINDS, MAGIC, OTHER_MODELS, SUFFIXES, UNREAD, UNREAD_IMAGES, USD_LAYERS
from service.formats.read.archive import Archive, listed
from service.formats.read.other_images import ENDINGS, NAMED
from service.formats.read.references import Finder

MODELS = ("gltf", "glb", "obj", "ply", "stl", "usd", *formats.MODELS, "3mf")
MOST_NAMED = 20  # models in a message
MOST_CHOICES = 500  # models to choose from
PACKAGE, ZIP, MATERIALX = ".usdz", ".zip", "mtlx"
START_OF_ZIP = b"PK\x03\x04"
READ = "glTF, OBJ, PLY, STL, USD, FBX, COLLADA, 3DS, X3D, 3MF or MaterialX"
STEP = (".step", ".stp")


@dataclass
class Contents:
    """The models of a zip by path, with their formats; its MaterialX files; and zips in it, which stay closed."""

    models: dict[str, str] = field(default_factory=dict)
    materials: list[str] = field(default_factory=list)
    zips: list[str] = field(default_factory=list)


def contents_of(archive: Archive) -> Contents:
    found = Contents()
    for name in archive.names:
        suffix = posixpath.splitext(name)[1].lower()
        start = archive.head(name, 16)
        format = _format(suffix, start)
        if format in MODELS:
            found.models[name] = format
        elif format == MATERIALX:
            found.materials.append(name)
        elif suffix == ZIP and start.startswith(START_OF_ZIP):
            found.zips.append(name)
    return found


def _format(suffix: str, start: bytes) -> str:
    """The format of a file. Its first bytes say it, where those of its format are always the same."""
    by_bytes = next((format for magic, format in MAGIC if start.startswith(magic)), "")
    if by_bytes == "zip":
        return "usd" if suffix in (PACKAGE, *USD_LAYERS) else "3mf" if suffix == ".3mf" else ""
    by_name = "usd" if suffix == PACKAGE else SUFFIXES.get(suffix[1:], "")
    return by_bytes or by_name


def chosen(found: Contents, entry: str | None) -> str | None:
    """The path of the model or the MaterialX file that is meant; None where there is no model, and nothing was asked
    for. Raises ParseError."""
    if entry is not None:
        names = [*found.models, *found.materials]
        file = Finder(names).find("", entry)
        if file is None:
            there = f"they are {listed(names, MOST_NAMED)}" if names else "it has none"
            raise ParseError(f"the zip has no model {entry[:100]!r}; {there}", "/entry")
        return file.path
    if len(found.models) > 1:
        named = listed(list(found.models), MOST_NAMED)
        how = "choose one by its name: ?entry=NAME, on the command line --entry NAME"
        choices = tuple(found.models)[:MOST_CHOICES]
        raise ParseError(f"the zip holds {len(found.models)} models, {named}; {how}", choices=choices)
    return next(iter(found.models), None)


def nothing(archive: Archive, found: Contents) -> str:
    """The sentence about a zip that holds neither a model nor materials."""
    if not archive.names:
        return "the zip is empty, but for what programs that show folders leave in them"
    if found.zips:
        how = "a zip within a zip is not opened: unpack it, and upload what it holds"
        return f"the zip holds {listed(found.zips)}; {how}"
    kinds = {KINDS[format] for format in map(_suffix_format, archive.names) if format}
    named = "and no images whose names say what they are, such as wood_color.png and wood_normal.png"
    images = f", {named}; an image that is used by itself is uploaded without a zip"
    others = [name for name in archive.names if name.lower().endswith(OTHER_MODELS)]
    pictures = [name for name in archive.names if name.lower().endswith(UNREAD_IMAGES)]
    has_others = any(name.lower().endswith(ENDINGS) for name in archive.names)
    unread = f"; {listed(others[:1])} is {UNREAD}" if others else ""
    if pictures:
        unread += f"; {listed(pictures[:1])} is an image in a format that is not read ({NAMED} are)"
    if any(name.lower().endswith(STEP) for name in archive.names):
        unread = "; a STEP file is read by itself: upload it without the zip"
    what = f"no model ({READ}){images if 'image' in kinds or has_others else ''}"
    return f"the zip holds {listed(archive.names)}; {what}{unread}"


def _suffix_format(name: str) -> str:
    return SUFFIXES.get(posixpath.splitext(name)[1][1:].lower(), "")
