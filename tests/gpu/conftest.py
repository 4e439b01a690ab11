"""A picture for tests about how samples are summed; a cache without kernels."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from gpu import Picture, Renderer
from gpu.picture import passes
from tests.gpu.noisy_scenes import SCENES
from tests.rendering import picture
from tests.supervisors import arrays_of

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


@pytest.fixture(scope="module")
def arrays(gpu: Renderer) -> Any:
    return arrays_of("plain")


@pytest.fixture
def cold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for compiled kernels, with none in it."""
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    return tmp_path
