"""ParseError: what the parsing child says of a file. Imports nothing, so that the child stays small."""


class ParseError(Exception):
    """A file that is refused; the message says what is wrong and where, to the person who made it.

    `pointer` (RFC 6901) is the place in the file's own JSON, where it has one; of an OBJ's files FILE or FILE:LINE.
    """

    def __init__(self, detail: str, pointer: str = "") -> None:
        super().__init__(f"{pointer}: {detail}" if pointer else detail)
        self.detail = detail
        self.pointer = pointer
