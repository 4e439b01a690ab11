"""Ray's settings for tests: no part in a cluster that runs here already, and nothing in the home folder."""

from __future__ import annotations

from collections.abc import Iterator
from tempfile import TemporaryDirectory

import pytest


@pytest.fixture(scope="session", autouse=True)
def ray_settings() -> Iterator[None]:
    # Not pytest's folder: the paths of Ray's sockets have to be short.
    with pytest.MonkeyPatch.context() as patch, TemporaryDirectory(prefix="sunbox-ray-") as folder:
        patch.setenv("RAY_TMPDIR", folder)
        patch.delenv("RAY_ADDRESS", raising=False)
        patch.setenv("RAY_AUTH_TOKEN", "0123456789abcdef" * 4)
        patch.setenv("RAY_AUTH_MODE", "token")
        yield
