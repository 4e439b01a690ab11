"""What one key saves leaves room for what others save, and for their pictures."""

from __future__ import annotations

from pathlib import Path

from service.config import Config
from service.problems import TooLarge
from service.server.assets import AssetStore
from service.server.storage.documents import Documents, checked
from service.server.storage.stores import DOCUMENTS_PART, storage

DOCUMENT = checked("materials", {"type": "diffuse", "albedo": 0.5})
SIZE = len(DOCUMENT.body)


def fill(saved: Documents, owner: str, most: int) -> int:
    """How many documents an owner can save, up to `most`."""
    for number in range(most):
        try:
            saved.put("materials", f"{number}", DOCUMENT, None, owner)
        except TooLarge:
            return number
    return most


def test_documents_have_shares_by_key(tmp_path: Path) -> None:
    """Without a bound that is set: one key leaves half to others, and several leave some to the next one."""
    saved = Documents(tmp_path, AssetStore(tmp_path), most=9 * SIZE)
    assert [fill(saved, owner, 10) for owner in ("anna", "bert", "carl")] == [4, 2, 1]
    saved.put("materials", "0", DOCUMENT, None, "anna")  # in the place of as much
    assert fill(saved, "", 10) == 10, "without keys they are everybody's"


def test_a_bound_that_is_set_counts_instead(tmp_path: Path) -> None:
    config = Config(data_dir=tmp_path, data_quota=64 << 20)
    assert storage(config).documents._most == (64 << 20) // DOCUMENTS_PART
    bounded = storage(config.model_copy(update={"max_key_documents": 3 * SIZE}))
    assert fill(bounded.documents, "anna", 10) == 3
    bounded.assets.close()
