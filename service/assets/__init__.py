"""Meshes and images that scenes refer to: uploaded ones by the hash of their bytes, files beside a scene by path."""

from service.assets.data import AssetInfo, AssetLimits, Assets, ImageData, MeshData
from service.assets.files import FileAssets
from service.assets.store import AssetStore

__all__ = ["AssetInfo", "AssetLimits", "AssetStore", "Assets", "FileAssets", "ImageData", "MeshData"]
