"""The meshes and images of a scene's file, as separate files to which its document refers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from service.formats.types import ScenePart


@dataclass
class PartFiles:
    """The parts of a scene; `parts[k]` is "part:k" in the document."""

    parts: list[ScenePart] = field(default_factory=list)
    _numbers: dict[bytes, int] = field(default_factory=dict)

    def add(self, data: bytes, pointer: str) -> str:
        """Add a part, unless one with the same bytes is there. Returns its reference."""
        return self._added(ScenePart(data, pointer))

    def add_mesh(self, data: bytes, pointer: str, vertices: np.ndarray, triangles: int) -> str:
        """Add a mesh of these vertices (n, 3), likewise."""
        bounds = [vertices.min(axis=0).tolist(), vertices.max(axis=0).tolist()] if len(vertices) else None
        return self._added(ScenePart(data, pointer, len(vertices), triangles, bounds))

    def _added(self, part: ScenePart) -> str:
        data = bytes(part.data)
        if data not in self._numbers:
            self._numbers[data] = len(self.parts)
            self.parts.append(part)
        return f"part:{self._numbers[data]}"
