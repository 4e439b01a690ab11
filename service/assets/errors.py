"""ParseError: what the parsing child says of a file. Imports nothing, so that the child stays small."""


class ParseError(Exception):
    """A file that is refused; the message says what is wrong and where, to the person who made it."""
