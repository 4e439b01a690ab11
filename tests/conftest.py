"""Fixtures that several files share."""

from __future__ import annotations

import ctypes
import importlib.util
import logging
import os
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import nullcontext, suppress
from pathlib import Path

import pytest

from gpu import ContextError, Renderer
from gpu import context as contexts
from service.system import logs
from service.system.logs import Console
from tests import kernel_count
from tests.families import FamilyRenderer
from tests.privileges import shed
from tests.rendering import release_pictures
from tests.service.receiving import Receiver
from tests.serving import AHEAD, CALLBACK_SECRETS, KEYS, SPARE_KEY, Server

TESTS = Path(__file__).parent
# The files that take longest, in this order: begun last, one of them would leave a core without work.
LONG_FILES = (
    "web/test_editor.py", "web/test_saving.py", "web/test_everyone.py", "web/test_lobe.py", "web/test_picture.py",
    "web/test_variants.py", "shaders/test_furnace.py", "gpu/test_bsdf.py", "gpu/test_instances.py",
    "extremes/test_radiance.py", "service/rendering/test_untouched_parts.py", "gpu/test_flags.py",
    "gpu/test_fallback.py",
    "service/rendering/test_survival.py", "service/rendering/test_durable.py", "shaders/test_light.py",
    "gpu/test_precompile.py", "service/pack/test_tangents.py", "service/bench/test_bench.py", "client/test_agents.py",
    "service/test_hostile.py", "service/rendering/test_divided.py", "client/test_batch.py", "service/test_rest.py",
    "service/rendering/test_fairness.py", "shaders/test_microfacet.py", "shaders/test_lobes.py",
    "service/test_one_client.py", "service/exports/test_gltf_out.py", "service/rendering/test_checkpoints.py",
    # of `make long-test`
    "bench/test_first_frames.py", "bench/test_hemisphere.py", "bench/test_scale.py", "bench/test_soak.py",
    "bench/test_profile.py", "service/rendering/cluster/test_cluster.py", "service/rendering/cluster/test_nodes.py",
    "service/bench/test_device.py",
)  # fmt: skip

STRICT = {
    "SUNBOX_API_KEY": ", ".join([*KEYS, SPARE_KEY]),
    "SUNBOX_APIKEY": "misspelt-key",
    "SUNBOX_LOG_FORMAT": "json",
    "SUNBOX_MAX_CLIENTS": "3",
    "SUNBOX_MAX_RUNNING": "1",
    "SUNBOX_MAX_QUEUE": "2",
    "SUNBOX_MAX_JOBS": "2",
    "SUNBOX_KEEP_RENDERS": "6",
    "SUNBOX_MAX_BODY": "64000",
    "SUNBOX_MAX_KEY_ASSETS": "65536",
    "SUNBOX_MAX_PIXELS": "1000",
    "SUNBOX_MAX_SECONDS": "5",
    "SUNBOX_MAX_TRIANGLES": "200000",
    "SUNBOX_BODY_TIMEOUT": "0.5",
    "SUNBOX_PARSE_SECONDS": "5",
    "SUNBOX_ALLOWED_ORIGINS": "https://friend.example, http://other.example:81",
}
# One render at a time, which is stored often; the renderer has room for two pictures of 500 x 500, and two seconds.
MORTAL = {
    "SUNBOX_API_KEY": "anna",
    "SUNBOX_CALLBACK_SECRET": ",".join(CALLBACK_SECRETS),
    "SUNBOX_CHECKPOINT_S": "0.1",
    "SUNBOX_GPU_MEMORY": str(64 << 20),
    "SUNBOX_HANG_S": "2",
    "SUNBOX_MAX_RUNNING": "1",
}


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import only the files that have tests of the one marker that is asked for: all of them take 7 s."""
    if collection_path.name.startswith("test_"):
        if config.option.markexpr.startswith("browser"):
            return None if collection_path.is_relative_to(TESTS / "web") else True
        if config.option.markexpr == "calm":
            return None if "mark.calm" in collection_path.read_text("utf-8") else True
    return None


@pytest.hookimpl(tryfirst=True)  # before markers choose
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if not {"ray", "notebook"}.isdisjoint(mark.name for mark in item.iter_markers()):
            item.add_marker(pytest.mark.slow)  # 500 MB are installed for them
    for marker, package in (
        ("ray", "ray"),
        ("notebook", "jupyterlab"),
        ("usd", "pxr"),
        ("models", "cmeel"),
        ("cad", "cascadio"),
    ):
        if importlib.util.find_spec(package) is None and not os.environ.get("CI"):
            reason = f"{package} is not installed: .venv/bin/pip install -r requirements.{marker}.lock"
            for item in items:
                if item.get_closest_marker(marker) is not None:
                    item.add_marker(pytest.mark.skip(reason=reason))
    ranks = {TESTS / name: rank for rank, name in enumerate(LONG_FILES)}
    items.sort(key=lambda item: ranks.get(item.path, len(ranks)))


def pytest_configure(config: pytest.Config) -> None:
    os.environ[AHEAD] = "off"  # else each renderer that is started compiles for a minute what no test asks for
    folder = tempfile.TemporaryDirectory(prefix="sunbox-tests-")
    config.add_cleanup(folder.cleanup)
    shed(Path(folder.name))
    count = kernel_count.start(config)
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(Failures(config))
        config.pluginmanager.register(Totals(count))


class Failures:
    """Names each failed test as soon as it has failed: a run that is stopped for its length has no summary."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        terminal = self.config.pluginmanager.get_plugin("terminalreporter")
        if report.failed and terminal is not None:
            crash = getattr(report.longrepr, "reprcrash", None)
            why = f" - {crash.message.splitlines()[0]}" if crash and crash.message else ""
            terminal.write_line(f"\nFAILED {report.nodeid} [{report.when}, {report.duration:.0f} s]{why}"[:300])


class Totals:
    """Says at the end how many path kernels the run has compiled, the parts of `make test` before it included."""

    def __init__(self, count: kernel_count.KernelCount) -> None:
        self.count = count

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        # Servers say what they have compiled when they end, after the last test.
        if self.count.exceeded:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        terminalreporter.write_line(str(self.count))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    yield from kernel_count.watch(item)


@pytest.fixture(scope="module", autouse=True)
def pictures() -> Iterator[None]:
    """Pictures last as long as the tests of their file."""
    yield
    release_pictures()
    with suppress(AttributeError, OSError):  # another C library
        ctypes.CDLL(None).malloc_trim(0)  # glibc would keep some GB that LLVM took


@pytest.fixture(scope="session")
def gpu() -> Iterator[FamilyRenderer]:
    """A renderer for all tests of the session. Skips where there is no GL, saying why; never in CI.

    With llvmpipe it has one thread: with more it would take all processors from what the tests beside it wait for, as
    the renderers of servers are nicer. Scenes get the kernels of their families, but in tests with the mark `exact`.
    Unoptimised kernels (GALLIVM_PERF=nopt) are there in 0.7 of the time, but trace 2.3 to 4.5 times slower.
    """
    try:
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("LP_NUM_THREADS", "1")
            renderer = FamilyRenderer()
    except ContextError as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))
    yield renderer
    renderer.close()


@pytest.fixture(autouse=True)
def _current_context(request: pytest.FixtureRequest) -> Iterator[None]:
    """Make the session's context current: the last test may have made another, and a probe calls GL by itself. Give
    scenes the kernels that the product gives them in tests with the mark `exact`."""
    if "gpu" not in request.fixturenames:
        yield
        return
    renderer: FamilyRenderer = request.getfixturevalue("gpu")
    if request.node.get_closest_marker("llvmpipe") and "llvmpipe" not in renderer.info["renderer"]:
        pytest.skip("these bits are llvmpipe's alone")
    contexts.use(renderer.context)
    with renderer.exact() if request.node.get_closest_marker("exact") else nullcontext():
        yield


@pytest.fixture(scope="session")
def server(gpu: Renderer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """`sunbox serve`, ready, for all tests of the session that leave it as it was."""
    served = Server(tmp_path_factory.mktemp("server"))
    served.wait()
    yield served
    served.stop()


@pytest.fixture(scope="session")
def strict(gpu: Renderer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server with two keys and small limits, whose log is for machines; for tests that leave it as it was."""
    served = Server(tmp_path_factory.mktemp("strict"), **STRICT)
    served.wait()
    yield served
    assert served.stop() == 0


@pytest.fixture(scope="session")
def listening() -> Iterator[Receiver]:
    """Whom `mortal` may call back."""
    receiver = Receiver()
    yield receiver
    receiver.close()


@pytest.fixture(scope="session")
def _mortal(gpu: Renderer, listening: Receiver, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    hosts = f"{listening.url},http://localhost:{listening.port}"
    served = Server(tmp_path_factory.mktemp("mortal"), SUNBOX_CALLBACK_HOSTS=hosts, **MORTAL)
    yield served
    if served.runs:
        assert served.stop() == 0


@pytest.fixture
def mortal(_mortal: Server) -> Server:
    """A server with one key that a test may end or kill, as any process of it, and start again in its folder.

    The next test finds it running, and no render that goes on.
    """
    if not _mortal.runs:
        _mortal.start()
    _mortal.wait()
    for state in ("queued", "running"):
        for each in _mortal.http.get("/v1/renders", params={"state": state}).raise_for_status().json():
            _mortal.http.delete(f"/v1/renders/{each['id']}").raise_for_status()
    return _mortal


@pytest.fixture
def caplog(caplog: pytest.LogCaptureFixture) -> pytest.LogCaptureFixture:
    """pytest's, whose text has the values of records."""
    caplog.handler.setFormatter(Console())
    return caplog


@pytest.fixture
def untouched_logging() -> Iterator[None]:
    """Logging as it was before the test."""
    root, rooms = logging.getLogger(), [logging.getLogger(room) for room in logs.ROOMS]
    before, levels, hooks = (
        root.handlers[:],
        [each.level for each in (root, *rooms)],
        (sys.excepthook, threading.excepthook),
    )
    yield
    root.handlers[:] = before
    for each, level in zip((root, *rooms), levels, strict=True):
        each.setLevel(level)
    sys.excepthook, threading.excepthook = hooks
    logging.captureWarnings(False)


@pytest.fixture
def filled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Benchmarks' servers find their kernels in this machine's cache instead of an empty one, where they take 10 s of
    a core."""
    monkeypatch.setattr("service.bench.machine.shader_caches", lambda folder: {})
