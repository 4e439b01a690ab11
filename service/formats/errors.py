"""ParseError, the refusal of a file. This module imports nothing, so that the parsing child stays small."""

LAYER = "/layer"  # the pointer where an image has no layer of a name


class ParseError(Exception):
    """A file was refused; the message says to its author what is wrong and where.

    `pointer` (RFC 6901) is the place in the file's own JSON, where it has one; of an OBJ's files FILE or FILE:LINE.
    `choices` are the models of a zip that holds several.
    """

    def __init__(self, detail: str, pointer: str = "", choices: tuple[str, ...] = ()) -> None:
        super().__init__(f"{pointer}: {detail}" if pointer else detail)
        self.detail = detail
        self.pointer = pointer
        self.choices = choices


class MissingExtra(ParseError):
    """A file was refused because the package that reads it is not installed; the message names the extra."""


class NoTriangles(ParseError):
    """A scene was refused because none of its nodes has a mesh."""


def at_fault(place: str, asset: str) -> str:
    """The pointer to the field at fault, given the place that a refusal names in a file and the pointer to the asset:
    this, or the one to the `layer` beside it."""
    return asset.rpartition("/")[0] + LAYER if place == LAYER else asset
