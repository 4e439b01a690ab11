"""What a file asks for and does not get: listed with its place, never dropped in silence."""

from dataclasses import dataclass, field

MOST = 200  # a file of ten thousand materials may ask ten thousand times
LONGEST = 300


@dataclass
class Notes:
    """Places and texts in the order in which they were found, each once."""

    _found: dict[tuple[str, str], None] = field(default_factory=dict)
    _left_out: int = 0

    def add(self, pointer: str, detail: str) -> None:
        key = pointer[:LONGEST], detail[:LONGEST]
        if key in self._found:
            return
        if len(self._found) < MOST:
            self._found[key] = None
        else:
            self._left_out += 1

    def document(self) -> list[dict[str, str]]:
        """`[{pointer, detail}]`."""
        listed = [{"pointer": pointer, "detail": detail} for pointer, detail in self._found]
        if self._left_out:
            listed.append({"pointer": "", "detail": f"and {self._left_out} more like these"})
        return listed
