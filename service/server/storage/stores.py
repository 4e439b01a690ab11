"""The stores of the data folder: assets, documents and the pictures of renders, within one quota."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from service.config import Config
from service.server.assets import AssetStore
from service.server.storage.asset_access import AssetAccess
from service.server.storage.asset_shares import AssetShares
from service.server.storage.documents import Documents
from service.server.storage.lost_pictures import LostPictures
from service.server.storage.quota import Quota, reserve_bytes
from service.system.disk_usage import Usage, usage


@dataclass(frozen=True)
class Storage:
    """The stores of one data folder."""

    assets: AssetStore
    documents: Documents
    quota: Quota
    shares: AssetShares
    access: AssetAccess

    def prepare(self) -> None:
        """Migrate the database and delete a crash's leftovers, once, before a server starts. Raises DamagedFile."""
        self.documents.prepare()
        self.quota.clear()
        self.shares.clear()


DOCUMENTS_PART = 4  # all keys' documents take a quarter of the quota, so that pictures of others can be stored
RENDERS = "renders"  # the folder of the renders' pictures, in the data folder


def storage(config: Config, pictures: Callable[[], Usage] | None = None) -> Storage:
    """`pictures` says what the renders' pictures take, where a server counts them; else the disk is read."""
    renders = config.data_dir / RENDERS
    beside, lost = pictures or (lambda: _pictures(renders)), LostPictures(renders)
    # They depend on each other: assets need room, the quota the documents' references, documents the assets.
    limit = Usage(config.data_quota, config.data_files)
    quota = Quota(
        config.data_dir,
        limit,
        lambda: documents.assets_in_use(),
        lambda: documents.usage() + beside() + lost.usage(),
        lost,
        lambda ids: shares.forget(ids),
        lambda: shares.owned(),
        reserve_bytes(config.data_quota),
    )
    assets = AssetStore(config.data_dir, config, _builtin_assets, quota.room)
    most = config.data_quota // DOCUMENTS_PART
    documents = Documents(config.data_dir, assets, quota, config.max_key_documents, most)
    shares = AssetShares(config.data_dir, quota, config.max_key_assets)
    return Storage(assets, documents, quota, shares, AssetAccess(config.data_dir, assets))


def _pictures(folder: Path) -> Usage:
    total = Usage()
    if not folder.is_dir():
        return total
    with suppress(FileNotFoundError), os.scandir(folder) as entries:
        for entry in entries:
            with suppress(FileNotFoundError):  # a checkpoint that the server replaced just now
                if entry.is_file(follow_symlinks=False):
                    total += usage(entry.stat(follow_symlinks=False))
    return total


def _builtin_assets() -> dict[str, bytes]:
    from service.document import presets

    return presets.builtin_assets()
