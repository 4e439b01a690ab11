"""The description of a parsed asset: its size, bounds and warnings."""

from service.formats.cache import Parsed
from service.formats.formats import KINDS
from service.formats.types import AssetInfo, ImageData, LutData, MeasuredData


def describe(id: str, format: str, size: int, parsed: Parsed) -> AssetInfo:
    warnings = [{"pointer": "", "detail": text} for text in parsed.warnings] or None
    if isinstance(parsed, ImageData):
        height, width, channels = parsed.pixels.shape
        return AssetInfo(id, KINDS[format], format, size, width, height, channels, warnings=warnings)
    if isinstance(parsed, LutData | MeasuredData):
        return AssetInfo(id, KINDS[format], format, size, warnings=warnings)
    bounds = [corner.tolist() for corner in parsed.bounds]
    vertices, triangles = len(parsed.vertices), len(parsed.faces)
    return AssetInfo(
        id, KINDS[format], format, size, vertices=vertices, triangles=triangles, bounds=bounds, warnings=warnings
    )
