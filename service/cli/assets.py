"""The assets of a scene that the command line renders, and their ids, by which a picture's metadata names them."""

from __future__ import annotations

import hashlib
import logging
from typing import Any

from service.document import references
from service.formats import ImageData, LutData, MeasuredData, MeshData
from service.problems import AssetError, NotFound, ServiceError
from service.server.assets import AssetStore, FileAssets

log = logging.getLogger(__name__)


class SourceAssets:
    """Files by path and uploads by id. `names` gives the files that ids were once read from."""

    def __init__(self, found: FileAssets, store: AssetStore, names: dict[str, str]) -> None:
        self._found = found
        self._store = store
        self._names = names

    def mesh(self, ref: str) -> MeshData:
        """Raises AssetError."""
        return self._found.mesh(self._where(ref))

    def image(self, ref: str, layer: str = "") -> ImageData:
        """Raises AssetError."""
        return self._found.image(self._where(ref), layer)

    def measured(self, ref: str) -> MeasuredData:
        """Raises AssetError."""
        return self._found.measured(self._where(ref))

    def read(self, ref: str) -> bytes:
        """The bytes of a file. Raises AssetError."""
        return self._found.read(self._where(ref))

    def lut(self, ref: str) -> tuple[str, LutData]:
        """A table of colours and its id. It is copied into the data folder, so that its picture can be made again.
        Raises AssetError."""
        where = self._where(ref)
        found = self._found.lut(where)
        if where.startswith("sha256:"):
            return where, found
        self._keep(where)
        return _id(self._found.read(where)), found

    def _keep(self, ref: str) -> None:
        try:
            self._found.add(ref)
        except (ServiceError, OSError) as error:  # another user's folder may not even be listed
            log.warning("asset not kept", {"ref": ref, "error": error})

    def keep(self, scene: Any) -> None:
        """Copy the files that a document refers to into the data folder, so that its picture can be made again
        without them. Where there is no room, they stay needed.
        """
        for ref in references.references(scene):
            if not ref.startswith("sha256:"):
                self._keep(ref)

    def by_id(self, scene: Any) -> tuple[Any, dict[str, str]]:
        """The document with ids in the place of paths, and the paths by id."""
        names = dict(self._names)

        def identified(ref: str) -> str:
            if ref.startswith("sha256:"):
                return ref
            id = _id(self._found.read(ref))
            names[id] = ref
            return id

        return references.renamed(scene, identified), names

    def _where(self, ref: str) -> str:
        """The reference itself, or where the data folder lacks it the path of the file that it was read from."""
        if ref not in self._names:
            return ref
        try:
            self._store.info(ref)
            return ref
        except (NotFound, AssetError):
            pass
        name = self._names[ref]
        try:
            if _id(self._found.read(name)) == ref:
                return name
        except AssetError:
            pass
        raise AssetError(f"{name!r} as it was then ({ref[:19]}...) is not here; --asset-root DIR says where to look")


def _id(data: bytes) -> str:
    return "sha256:" + hashlib.sha256(data).hexdigest()
