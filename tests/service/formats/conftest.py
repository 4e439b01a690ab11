"""A store of assets that the tests of a file share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from service.server.assets import AssetStore


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()
