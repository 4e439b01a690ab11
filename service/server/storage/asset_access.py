"""Access to assets by key: those of other keys seem not to exist."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from service.document import Scene
from service.document.base import MOST_MISTAKES
from service.formats import Assets, ImageData, MeasuredData, MeshData
from service.problems import AssetError, FieldError, InvalidDocument, NotFound
from service.server.assets import AssetStore
from service.server.assets.store import ID, unknown
from service.server.storage.database import Database

# From a JSON array of assets, those that only other owners uploaded and that no document this owner can read uses.
_FOREIGN = """
    SELECT wanted.value FROM json_each(:ids) AS wanted
    WHERE EXISTS (SELECT 1 FROM asset_owners WHERE asset = wanted.value)
    AND NOT EXISTS (SELECT 1 FROM asset_owners WHERE asset = wanted.value AND owner = :owner)
    AND NOT EXISTS (
        SELECT 1 FROM uses JOIN documents USING (kind, name, owner)
        WHERE uses.asset = wanted.value AND (documents.owner = :owner OR documents.shared = 1)
    )
    AND NOT EXISTS (
        SELECT 1 FROM uses JOIN document_readers USING (kind, name, owner)
        WHERE uses.asset = wanted.value AND document_readers.reader = :owner
    )
    AND NOT EXISTS (
        SELECT 1 FROM render_uses JOIN renders USING (number)
        WHERE render_uses.asset = wanted.value AND renders.owner = :owner AND NOT renders.gone
    )
    AND NOT EXISTS (
        SELECT 1 FROM batch_uses JOIN batches USING (number)
        WHERE batch_uses.asset = wanted.value AND batches.owner = :owner
    )
"""


Use = tuple[str, str]  # a JSON pointer, and the reference to an asset that stands there


@dataclass(frozen=True)
class AllowedUses:
    """The assets of one document that its owner may use, which gives them to the owner for as long as the document is
    stored. `AssetAccess.allowed` alone makes them."""

    owner: str
    assets: tuple[str, ...]


NO_USES = AllowedUses("", ())


class AssetAccess:
    """For any number of threads; not for an event loop. Methods raise Unavailable where the disk fails.

    An owner is a text; "" may use every asset. Nothing is stored here, so that an answer is never out of date.
    """

    def __init__(self, folder: Path, assets: AssetStore) -> None:
        self._database = Database(folder)
        self._assets = assets

    def check(self, owner: str, id: str) -> None:
        """Raises NotFound for an asset that this owner may not use, with the words for one that does not exist."""
        if self.foreign(owner, [id]):
            raise unknown(id)

    def foreign(self, owner: str, ids: Collection[str]) -> set[str]:
        """The ones among these assets, which need not exist, that this owner may not use."""
        asked = [id for id in set(ids) if ID.fullmatch(id) and not self._assets.is_builtin(id)] if owner else []
        if not asked or not self._database.exists():
            return set()
        with self._database.open() as database:
            rows = database.execute(_FOREIGN, {"owner": owner, "ids": json.dumps(asked)})
            return {id for (id,) in rows}

    def allowed(self, owner: str, uses: Sequence[Use]) -> AllowedUses:
        """The uses that may be stored for a document of this owner.

        Raises InvalidDocument with the pointers of references to assets that do not exist, or that this owner may not
        use, which look the same.
        """
        assets = tuple(dict.fromkeys(ref for _, ref in uses))
        foreign = self.foreign(owner, assets)

        def why_not(ref: str) -> str | None:
            return unknown(ref).detail if ref in foreign else self._assets.missing(ref)

        missing = ((ref, why) for ref in assets if (why := why_not(ref)) is not None)
        if first := dict(islice(missing, MOST_MISTAKES)):
            mistakes = (FieldError(pointer, first[ref]) for pointer, ref in uses if ref in first)
            raise InvalidDocument(islice(mistakes, MOST_MISTAKES))
        return AllowedUses(owner, assets)

    def view(self, owner: str, scene: Scene) -> Assets:
        """The assets as this owner sees them, for packing this scene."""
        return self.files(owner, scene)

    def files(self, owner: str, scene: Scene) -> VisibleFiles:
        """The same with their bytes, for writing this scene to a file."""
        return VisibleFiles(self._assets, self.foreign(owner, set(references(scene))) if owner else set())


class VisibleFiles:
    """Assets without the foreign ones. Methods raise AssetError."""

    def __init__(self, assets: AssetStore, foreign: set[str]) -> None:
        self._assets = assets
        self._foreign = foreign

    def mesh(self, ref: str) -> MeshData:
        self._check(ref)
        return self._assets.mesh(ref)

    def image(self, ref: str, layer: str = "") -> ImageData:
        self._check(ref)
        return self._assets.image(ref, layer)

    def measured(self, ref: str) -> MeasuredData:
        self._check(ref)
        return self._assets.measured(ref)

    def read(self, ref: str) -> bytes:
        self._check(ref)
        try:
            return self._assets.read(ref)
        except NotFound as error:
            raise AssetError(error.detail) from None

    def size(self, ref: str) -> int:
        """The bytes of a file; 0 where there is none."""
        try:
            return 0 if ref in self._foreign else self._assets.info(ref).bytes
        except (NotFound, AssetError):
            return 0

    def _check(self, ref: str) -> None:
        if ref in self._foreign:
            raise AssetError(unknown(ref).detail)


def references(scene: Scene) -> Iterator[str]:
    """The assets of a scene."""
    for holder in (scene.environment, *scene.textures.values(), *scene.materials.values(), *scene.shapes):
        if (ref := getattr(holder, "asset", None)) is not None:
            yield ref
        if (faces := getattr(holder, "assets", None)) is not None:
            yield from faces.model_dump().values()
