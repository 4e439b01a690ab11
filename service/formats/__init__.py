"""Files of other programs: meshes, images, measured reflection and whole scenes that are read; pictures, written.

types         meshes, images, measured reflection, scene files, limits, and the protocol by which packing loads assets
errors        ParseError, which readers raise
formats       the formats, and how a file's format is recognised
source        the bytes of an upload, in memory or in a file
cache         parsed assets in memory, and what is said of one: size, bounds, warnings
scene_import  a whole scene's file -> a document whose references are assets
sandbox       the child process that parses
surface       what the inputs of surface models mean, for all formats
read          readers of single formats, and importers of whole scenes
images        pixels -> files
"""

from service.formats.errors import at_fault
from service.formats.types import (
    AssetInfo,
    AssetLimits,
    Assets,
    ImageData,
    LutData,
    MeasuredData,
    MeshData,
    MeshOddities,
)

__all__ = [
    "AssetInfo", "AssetLimits", "Assets", "ImageData", "LutData", "MeasuredData", "MeshData", "MeshOddities",
    "at_fault",
]  # fmt: skip
