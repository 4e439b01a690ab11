"""OBJ files with their materials and textures, alone and zipped."""

from __future__ import annotations

import io
import zipfile

import numpy as np

QUAD = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
TEXTURED = QUAD + "mtllib m.mtl\nusemtl m\nf 1/1 2/2 3/3 4/4\n"
GREY, NORMALS = np.full((4, 4, 3), 128, np.uint8), np.full((4, 4, 3), (128, 128, 255), np.uint8)


def zipped(files: dict[str, bytes | str], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as made:
        for name, data in files.items():
            made.writestr(zipfile.ZipInfo(name), data, method)
    return out.getvalue()
