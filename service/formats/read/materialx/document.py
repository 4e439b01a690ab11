"""The text of a `.mtlx` file as the library's document, with the standard library beside it.

The library's parser follows neither DOCTYPE nor entities, which are refused all the same, so that a file never means
less here than elsewhere. What it includes is read from the upload alone, and never by the library.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

from service.formats.errors import MissingExtra, ParseError
from service.formats.formats import missing
from service.formats.formats import text as utf8

MOST_BYTES = 16 << 20  # of the text; the library's own is 0.6 MB for 800 nodes
MOST_ELEMENTS = 200_000
MOST_INCLUDED = 100  # files
ATTRIBUTE = re.compile(rb"=\s*+(?:\"[^\"]*+\"|'[^']*+')")
OTHER_TARGETS = ("genmdl", "genmsl", "genosl", "genslang", "lama", "translation")  # folders that nothing here needs
MOST_DEPTH = 32  # the library recurses into elements; a graph in a document has four levels


def check_library() -> None:
    """Raise MissingExtra where the library is not installed."""
    if (package := missing().get("mtlx")) is not None:
        raise MissingExtra(f"MaterialX needs the package {package}, which is not installed on this server")


class Named(NamedTuple):
    """What a text calls by a name: images and the like, and other texts that it includes."""

    files: list[str]
    included: list[str]


Included = Callable[[str, str], str | None]  # the path of the text that the one at a path includes by a name


def read_document(file: str, read: Callable[[str], bytes], included: Included) -> Any:
    """The text at a path, and all that it includes, as a document of the library's. Raises ParseError."""
    check_library()
    data = read(file)
    document = _read(data, file)
    seen, left = {file}, [(file, data)]
    while left:
        source, data = left.pop()
        for name in named(data).included:
            path = included(source, name)
            if path is None or path in seen:
                continue
            if len(seen) > MOST_INCLUDED:
                raise ParseError(f"it includes more than the {MOST_INCLUDED} files allowed", file)
            seen.add(path)
            left.append((path, read(path)))
            document.importLibrary(_read(left[-1][1], path))
    document.setDataLibrary(_library())
    return document


def _read(data: bytes, file: str) -> Any:
    """A text as a document, without what it includes. `file` is the name in errors."""
    if len(data) > MOST_BYTES:
        raise ParseError(f"it has {len(data)} bytes; {MOST_BYTES} are allowed in one .mtlx", file)
    text = utf8(data).lstrip()
    try:
        _check(text, file)
    except ParseError:
        text = _lenient(text)
        _check(text, file)
    import MaterialX as mx

    document, options = mx.createDocument(), mx.XmlReadOptions()
    options.readXIncludeFunction = None
    try:
        mx.readFromXmlString(document, text.decode("utf-8", "replace"), mx.FileSearchPath(), options)
    except Exception as error:  # the bindings translate exceptions of C++ into types of their own
        raise ParseError(f"it can't be read as MaterialX ({str(error)[:200]})", file) from None
    return document


def is_standard(name: str) -> bool:
    """True for the name of a file of the standard library, which every document has."""
    return any(path.name == name.replace("\\", "/").rpartition("/")[2] for path in _library_files())


@cache
def _library() -> Any:
    """The standard definitions, from the wheel. It takes 0.1 s.

    The library's own loader asks the system for more than a child may ask for.
    """
    import MaterialX as mx

    library = mx.createDocument()
    for path in _library_files():
        if not any(part in path.parts for part in OTHER_TARGETS):
            part = mx.createDocument()
            mx.readFromXmlString(part, path.read_text())
            library.importLibrary(part)
    return library


def _library_files() -> list[Path]:
    import MaterialX as mx

    return sorted((Path(mx.__file__).parent / "libraries").rglob("*.mtlx"))


def _lenient(text: bytes) -> bytes:
    """A text that XML does not allow, as the library's own parser takes it: with `<` in attributes, as in <UDIM>."""
    return ATTRIBUTE.sub(lambda found: found[0].replace(b"<", b"&lt;"), text)


def named(data: bytes) -> Named:
    """The files that a text names, with the prefixes of the elements around; none of a text that is broken."""
    text = utf8(data).lstrip()
    return _named(text) or _named(_lenient(text)) or Named([], [])  # the importer says what is broken


def _named(text: bytes) -> Named | None:
    parser, prefixes, found, included = expat.ParserCreate(), [""], dict[str, None](), dict[str, None]()

    def start(name: str, attributes: dict[str, str]) -> None:
        prefixes.append(attributes.get("fileprefix", prefixes[-1]))
        if attributes.get("type") == "filename" and attributes.get("value"):
            found[prefixes[-1] + attributes["value"]] = None
        if name.rpartition(":")[2].lower() == "include" and attributes.get("href"):
            included[attributes["href"]] = None

    parser.StartElementHandler, parser.EndElementHandler = start, lambda name: prefixes.pop()
    try:
        parser.Parse(text, True)
    except expat.ExpatError:
        return None
    return Named(list(found), list(included))


def _check(text: bytes, file: str) -> None:
    """Raise ParseError for what is not well formed, too large or too deep, and for entities."""
    parser, depth, count = expat.ParserCreate(), 0, 0

    def refuse(detail: str) -> None:
        raise ParseError(detail, f"{file}:{parser.CurrentLineNumber}")

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth == 1 and name != "materialx":
            refuse(f"the root must be <materialx>, not <{name[:40]}>")
        if depth > MOST_DEPTH or count > MOST_ELEMENTS:
            refuse(f"{MOST_ELEMENTS} elements within {MOST_DEPTH} levels are allowed")

    def end(name: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = lambda *_: refuse("a DOCTYPE and entities are refused")
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ParseError(f"it is not well-formed XML ({error})"[:200], f"{file}:{error.lineno}") from None
