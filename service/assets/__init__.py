"""Meshes and images that scenes refer to: uploaded ones by the hash of their bytes, files beside a scene by path.

types         meshes, images, measured reflection, scene files, limits, and the protocol by which packing loads assets
errors        ParseError, which readers raise
formats       the formats, and how a file's format is recognised
limits        the bounds on assets, as the configuration sets them
source        the bytes of an upload, in memory or in a file
store         uploaded assets
rendered      uploaded pictures that Sunbox rendered, with what their noise is
describe      the description of an asset: size, bounds, warnings
folder        the files of the store, each written whole or not at all
folder_totals  the disk space of all assets, updated with each change
integrity     whether the bytes on the disk still match their hash
cache         parsed assets in memory
local_files   assets that are files beside a scene
scene_import  a whole scene's file -> a document whose references are assets
posing        a scene's file with other materials, or at a time of its animation
sandbox       the child process that parses
readers       readers of single formats
gltf          the reader of glTF
obj           the importer of OBJ files with materials and textures
usd           the importer of USD
texture_sets  the importer of images that make materials by their names
materialx     the importer of MaterialX
measured      the readers of measured reflection
scenes        parts that the importers of whole scenes share
"""

from service.assets.local_files import FileAssets
from service.assets.store import AssetStore
from service.assets.types import (
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
    "AssetInfo", "AssetLimits", "AssetStore", "Assets", "FileAssets", "ImageData", "LutData", "MeasuredData",
    "MeshData", "MeshOddities",
]  # fmt: skip
