"""Kernels for servers that are measured in little."""

from __future__ import annotations

import pytest

from service.bench import machine


@pytest.fixture
def filled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Servers find their kernels in this machine's cache instead of an empty one, where they take 10 s of a core."""
    monkeypatch.setattr(machine, "shader_caches", lambda folder: {})
