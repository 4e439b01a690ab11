"""STEP as a GLB, by OpenCASCADE. Runs in the parsing child."""

from __future__ import annotations

import os

from service.formats.errors import MissingExtra, ParseError
from service.formats.read.foreign.glb import Glb

# Of a curved face's edges: how far the triangles may be from it, as a share of its size, and by how much they turn.
# A turn of .3 makes 21 sides of a circle; normals are the surface's own, so that outlines alone show it.
DEVIATION, TURN = 0.002, 0.3


def converted(data: bytes) -> Glb:
    """The file in metres with +Y up, which is the file's +Z. Raises ParseError, MissingExtra."""
    try:
        import cascadio
    except ImportError:
        raise MissingExtra("STEP files need sunbox-server[cad] on the server") from None
    made = cascadio.load(
        data, file_type="step", tol_linear=DEVIATION, tol_relative=True, tol_angular=TURN, use_parallel=False
    )
    if not made and not _may_write():
        raise ParseError(
            "STEP files can't be read here: the kernel has no Landlock, without which no library may write"
        )
    if not made:
        raise ParseError("it can't be read: OpenCASCADE finds no shapes in it")
    file = Glb.read(made)
    file.turn_z_up("STEP")
    return file


def _may_write() -> bool:
    """True if a file in memory can be opened by its name, as OpenCASCADE does."""
    file = os.memfd_create("probe", os.MFD_CLOEXEC)
    try:
        os.close(os.open(f"/proc/self/fd/{file}", os.O_WRONLY))
    except OSError:
        return False
    finally:
        os.close(file)
    return True
