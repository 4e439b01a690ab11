"""The text of a `.mtlx` file as the library's document, with the standard library beside it.

The library's parser follows neither DOCTYPE nor entities, and inclusions only where a file is read by its name. All
of them are refused all the same, so that a file never means less here than elsewhere.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any
from xml.parsers import expat

from service.formats.errors import MissingExtra, ParseError
from service.formats.formats import missing
from service.formats.formats import text as utf8

MOST_BYTES = 16 << 20  # of the text; the library's own is 0.6 MB for 800 nodes
MOST_ELEMENTS = 200_000
OTHER_TARGETS = ("genmdl", "genmsl", "genosl", "genslang", "lama", "translation")  # folders that nothing here needs
MOST_DEPTH = 32  # the library recurses into elements; a graph in a document has four levels


def check_library() -> None:
    """Raise MissingExtra where the library is not installed."""
    if (package := missing().get("mtlx")) is not None:
        raise MissingExtra(f"MaterialX needs the package {package}, which is not installed on this server")


def read_document(data: bytes, file: str) -> Any:
    """A document of the library's. `file` is the name in errors. Raises ParseError."""
    check_library()
    if len(data) > MOST_BYTES:
        raise ParseError(f"it has {len(data)} bytes; {MOST_BYTES} are allowed in one .mtlx", file)
    text = utf8(data)
    _check(text, file)
    import MaterialX as mx

    document = mx.createDocument()
    try:
        mx.readFromXmlString(document, text.decode("utf-8", "replace"))
    except Exception as error:  # the bindings translate exceptions of C++ into types of their own
        raise ParseError(f"it can't be read as MaterialX ({str(error)[:200]})", file) from None
    document.setDataLibrary(_library())
    return document


@cache
def _library() -> Any:
    """The standard definitions, from the wheel. It takes 0.1 s.

    The library's own loader asks the system for more than a child may ask for.
    """
    import MaterialX as mx

    library = mx.createDocument()
    root = Path(mx.__file__).parent / "libraries"
    for path in sorted(root.rglob("*.mtlx")):
        if not any(part in path.parts for part in OTHER_TARGETS):
            part = mx.createDocument()
            mx.readFromXmlString(part, path.read_text())
            library.importLibrary(part)
    return library


def file_names(data: bytes) -> list[str]:
    """The files that a text names, with the prefixes of the elements around; [] for a text that is broken."""
    parser, prefixes, found = expat.ParserCreate(), [""], dict[str, None]()

    def start(name: str, attributes: dict[str, str]) -> None:
        prefixes.append(attributes.get("fileprefix", prefixes[-1]))
        if attributes.get("type") == "filename" and attributes.get("value"):
            found[prefixes[-1] + attributes["value"]] = None

    parser.StartElementHandler, parser.EndElementHandler = start, lambda name: prefixes.pop()
    try:
        parser.Parse(utf8(data), True)
    except expat.ExpatError:
        return []  # the importer says where
    return list(found)


def _check(text: bytes, file: str) -> None:
    """Raise ParseError for what is not well formed, too large or too deep, and for what leads out of the file."""
    parser, depth, count = expat.ParserCreate(), 0, 0

    def refuse(detail: str) -> None:
        raise ParseError(detail, f"{file}:{parser.CurrentLineNumber}")

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if name.rpartition(":")[2].lower() == "include":
            refuse("inclusions (xi:include) are refused: nothing outside of the upload is opened")
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
