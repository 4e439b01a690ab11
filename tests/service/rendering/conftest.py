"""Fixtures of tests about renderers."""

from __future__ import annotations

import pytest

from service.renderers.local import restarts


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A renderer that ends is started again at once, and given up soon."""
    monkeypatch.setattr(restarts, "BETWEEN_TRIES_S", 0.0)
    monkeypatch.setattr(restarts, "HOPELESS_S", 0.05)
