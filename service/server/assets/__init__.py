"""Meshes and images that scenes refer to: uploaded ones by the hash of their bytes, files beside a scene by path.

store         uploaded assets
folder        the files of the store, each written whole or not at all, and the disk space of all
integrity     whether the bytes on the disk still match their hash
entries       one of several models in a zip, as a file of its own
local_files   assets that are files beside a scene
posing        a scene's file with other materials, or at a time of its animation
"""

from service.server.assets.local_files import FileAssets
from service.server.assets.store import AssetStore

__all__ = ["AssetStore", "FileAssets"]
