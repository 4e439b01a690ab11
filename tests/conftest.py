"""Fixtures that several files share."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from gpu import ContextError, Renderer


@pytest.fixture(scope="session")
def gpu() -> Iterator[Renderer]:
    """A renderer for all tests of the session. Skips where there is no GL, saying why; never in CI."""
    try:
        renderer = Renderer()
    except ContextError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))
    yield renderer
    renderer.close()
