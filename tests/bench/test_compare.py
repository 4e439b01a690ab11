"""Two revisions beside each other."""

from __future__ import annotations

from pathlib import Path

import pytest

from service.bench import scenes
from tests.bench import compare
from tests.bench.__main__ import main


@pytest.mark.bench
def test_a_revision_is_the_same_as_itself(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """And not as one without what the scene needs. Where this is no checkout, that is said."""
    monkeypatch.setattr(compare, "cases", lambda: scenes.cases()[2:3])
    options = compare.Options("HEAD", 1, 32, 2, 16, 4, 2, 64)
    try:
        commit = compare.unpack("HEAD", tmp_path)
    except compare.NoRevision:
        assert main(["compare"]) == 2
        return
    assert (tmp_path / "pyproject.toml").exists()
    document = compare.measure(options, lambda what: None)
    (row,) = document["scenes"]
    assert document["machine"]["before"] == commit and row["rel_mse"]["before"] > 0
    if str(document["machine"]["after"]) == commit:  # nothing has been changed since
        assert row["same_bits"] and row["rel_mse"]["ratio"] == 1
    assert scenes.cases()[2].name in compare.table(document) and "ratio" in compare.table(document)
    assert main(["compare", "--revision", "no-such-thing"]) == 2
