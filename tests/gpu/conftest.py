"""A picture for tests about how samples are summed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from gpu import Picture, Renderer
from gpu.picture import passes
from tests.gpu.test_noise_meter import SCENES
from tests.rendering import picture

SETTINGS: dict[str, Any] = {"width": 48, "height": 37, "max_bounces": 3, "filter": "blackman_harris"}
SCENE = SCENES["rough metal"]


@pytest.fixture
def made(gpu: Renderer) -> Callable[[int], Picture]:
    """Makes the picture, with that many samples."""
    return lambda samples: picture(gpu, SCENE, samples, **SETTINGS)


@pytest.fixture
def slices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks are merged in many small slices."""
    monkeypatch.setattr(passes, "_MERGED", 100)
