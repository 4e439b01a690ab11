"""A renderer whose paths may work as long as they like, to measure what a scene costs that no caller can ask for."""

from __future__ import annotations

import re
from pathlib import Path
from tempfile import TemporaryDirectory

from gpu.kernels.source import SHADERS
from gpu.renderer import Renderer

_FILE = "shapes/budget.glsl"
_TURNS = re.compile(r"(?<=const int BUDGET_TURNS = )\d+(?=;)")
MOST = 2**31 - 1  # turns of a path: as many as an int holds


class UnboundedRenderer(Renderer):
    """A Renderer without the bound on a path's work: thousands of shapes in a list, not in a tree, use it up.

    Raises ContextError.
    """

    def __init__(self) -> None:
        self._folder = TemporaryDirectory(prefix="sunbox-shaders-")
        try:
            text, count = _TURNS.subn(str(MOST), (SHADERS / _FILE).read_text())
            assert count == 1
            path = Path(self._folder.name) / _FILE
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
            super().__init__(None, (Path(self._folder.name), SHADERS))
        except BaseException:
            self._folder.cleanup()
            raise

    def close(self) -> None:
        super().close()
        self._folder.cleanup()
