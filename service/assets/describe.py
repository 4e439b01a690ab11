"""The description of a parsed asset: its size, bounds and warnings."""

from service.assets.cache import Parsed
from service.assets.formats import KINDS
from service.assets.types import AssetInfo, ImageData


def describe(id: str, format: str, size: int, parsed: Parsed) -> AssetInfo:
    warnings = [{"pointer": "", "detail": text} for text in parsed.warnings] or None
    if isinstance(parsed, ImageData):
        height, width, channels = parsed.pixels.shape
        size_ = {"width": width, "height": height, "channels": channels}
        return AssetInfo(id, KINDS[format], format, size, **size_, warnings=warnings)
    bounds = [corner.tolist() for corner in parsed.bounds]
    counts = {"vertices": len(parsed.vertices), "triangles": len(parsed.faces)}
    return AssetInfo(id, KINDS[format], format, size, **counts, bounds=bounds, warnings=warnings)
