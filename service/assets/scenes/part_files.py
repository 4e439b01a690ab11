"""The meshes and images of a scene's file, as separate files to which its document refers."""

from __future__ import annotations

from dataclasses import dataclass, field

from service.assets.types import ScenePart


@dataclass
class PartFiles:
    """The parts of a scene; `parts[k]` is "part:k" in the document."""

    parts: list[ScenePart] = field(default_factory=list)
    _numbers: dict[bytes, int] = field(default_factory=dict)

    def add(self, data: bytes, pointer: str, vertices: int | None = None, triangles: int | None = None) -> str:
        """Add a part, unless one with the same bytes is there. Returns its reference."""
        if data not in self._numbers:
            self._numbers[data] = len(self.parts)
            self.parts.append(ScenePart(data, pointer, vertices, triangles))
        return f"part:{self._numbers[data]}"
