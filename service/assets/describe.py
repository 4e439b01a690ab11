"""The description of a parsed asset: its size, bounds and warnings."""

import numpy as np

from service.assets.cache import Parsed
from service.assets.formats import KINDS
from service.assets.types import AssetInfo, ImageData, MeshData


def describe(id: str, format: str, size: int, parsed: Parsed) -> AssetInfo:
    warnings = [{"pointer": "", "detail": text} for text in parsed.warnings] or None
    if isinstance(parsed, ImageData):
        height, width, channels = parsed.pixels.shape
        size_ = {"width": width, "height": height, "channels": channels}
        return AssetInfo(id, KINDS[format], format, size, **size_, warnings=warnings)
    counts = {"vertices": len(parsed.vertices), "triangles": len(parsed.faces)}
    return AssetInfo(id, KINDS[format], format, size, **counts, bounds=_bounds(parsed), warnings=warnings)


def _bounds(mesh: MeshData) -> list[list[float]]:
    """Corners of the box around its triangles; a vertex of none does not count."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    corners = mesh.vertices[used]
    return [corners.min(axis=0).tolist(), corners.max(axis=0).tolist()]
