"""What is kept in the data folder: assets and documents, within one quota."""

from __future__ import annotations

from dataclasses import dataclass

from service.assets import AssetStore
from service.config import Config
from service.disk_usage import Usage
from service.documents import Documents
from service.quota import Quota


@dataclass(frozen=True)
class Storage:
    assets: AssetStore
    documents: Documents
    quota: Quota


def storage(config: Config) -> Storage:
    # They depend on each other: assets need room, the quota the documents' references, documents the assets.
    limit = Usage(config.data_quota, config.data_files)
    quota = Quota(config.data_dir, limit, lambda: documents.assets_in_use(), lambda: documents.usage())
    assets = AssetStore(config.data_dir, config, _builtin_assets, quota.room)
    documents = Documents(config.data_dir, assets, quota)
    return Storage(assets, documents, quota)


def _builtin_assets() -> dict[str, bytes]:
    from service import presets  # the command line seldom needs them

    return presets.builtin_assets()
