"""The meshes and images of a scene's file, as separate files to which its document refers."""

from __future__ import annotations

from dataclasses import dataclass, field

from service.assets.types import ScenePart


@dataclass
class PartFiles:
    """The parts of a scene; `kept[k]` is "part:k" in the document."""

    kept: list[ScenePart] = field(default_factory=list)
    _numbers: dict[bytes, int] = field(default_factory=dict)

    def keep(self, data: bytes, pointer: str, vertices: int | None = None, triangles: int | None = None) -> str:
        """The reference of a part; the same bytes get the same one."""
        if data not in self._numbers:
            self._numbers[data] = len(self.kept)
            self.kept.append(ScenePart(data, pointer, vertices, triangles))
        return f"part:{self._numbers[data]}"
