"""Fixtures that several files share."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from gpu import ContextError, Renderer
from gpu import context as contexts
from tests.privileges import shed
from tests.rendering import release_pictures
from tests.serving import Server


def pytest_configure(config: pytest.Config) -> None:
    folder = tempfile.TemporaryDirectory(prefix="sunbox-tests-")
    config.add_cleanup(folder.cleanup)
    shed(Path(folder.name))


@pytest.fixture(scope="module", autouse=True)
def pictures() -> Iterator[None]:
    """Pictures last as long as the tests of their file."""
    yield
    release_pictures()


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


@pytest.fixture(autouse=True)
def _current_context(request: pytest.FixtureRequest) -> None:
    """Make the session's context current: the last test may have made another, and a probe calls GL by itself."""
    if "gpu" in request.fixturenames:
        contexts.use(request.getfixturevalue("gpu")._context)


@pytest.fixture(scope="session")
def server(gpu: Renderer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """`sunbox serve`, ready, for all tests of the session that leave it as it was."""
    served = Server(tmp_path_factory.mktemp("server"))
    served.wait()
    yield served
    served.stop()
