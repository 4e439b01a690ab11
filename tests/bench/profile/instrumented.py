"""A renderer whose kernels run statements of ours at lines of their shaders that are named, and count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from gpu.errors import GpuError
from gpu.kernels.source import SHADERS
from gpu.layout.bindings import Slot
from gpu.renderer import Renderer

if TYPE_CHECKING:
    from gpu.picture.picture import Picture

SLOT = Slot.OUTPUT  # of the counters: kernels that trace paths do not use it
_FILE = "instrumented.glsl"


@dataclass(frozen=True)
class Edit:
    """A statement in GLSL before the one line of a shader file that contains `line`."""

    file: str
    line: str
    statement: str


class LineGone(GpuError):
    """An edit names a line that a shader file has not, or has more than once."""


class InstrumentedRenderer(Renderer):
    """A Renderer whose shader files are edited. `functions` is GLSL that the edits may call; it may use a buffer
    `counts` of `counters` uints. Pictures must be multiples of 8 pixels wide and high for every invocation to count.

    Raises LineGone, ContextError.
    """

    def __init__(self, edits: Sequence[Edit], functions: str, counters: int, device: int | None = None) -> None:
        self._folder = TemporaryDirectory(prefix="sunbox-shaders-")
        try:
            folder = Path(self._folder.name)
            (folder / _FILE).write_text(
                '#include "layout.glsl"\n'
                "layout(std430, binding = SLOT_OUTPUT) buffer instrumented_buffer { uint counts[]; };\n" + functions
            )
            for file in {edit.file for edit in edits}:
                text = edited(SHADERS / file, [edit for edit in edits if edit.file == file])
                (folder / file).parent.mkdir(parents=True, exist_ok=True)
                (folder / file).write_text(text)
            super().__init__(device, (folder, SHADERS))
        except BaseException:
            self._folder.cleanup()
            raise
        self._counts = self.context.buffer(reserve=4 * counters)

    def count(self, picture: Picture, samples: int) -> np.ndarray:
        """The counters, (counters,) int64, after that many further samples of every pixel. The noise meter, which
        traces with the same kernel, must be off."""
        self._use_context()
        self._counts.write(bytes(self._counts.size))
        wanted = picture.samples + samples
        while picture.samples < wanted:
            self._counts.bind_to_storage_buffer(int(SLOT))
            picture.trace(60.0, wanted)
        return np.frombuffer(self._counts.read(), np.uint32).astype(np.int64)

    def close(self) -> None:
        self._counts.release()
        super().close()
        self._folder.cleanup()


def edited(path: Path, edits: Sequence[Edit]) -> str:
    """The text of a shader file with the edits in it. Raises LineGone."""
    lines = path.read_text().splitlines()
    for edit in edits:
        places = [i for i, line in enumerate(lines) if edit.line in line]
        if len(places) != 1:
            raise LineGone(f"{edit.file}: {len(places)} lines contain {edit.line!r}; one should")
        lines.insert(places[0], edit.statement)
    return f'#include "{_FILE}"\n' + "\n".join(lines) + "\n"
