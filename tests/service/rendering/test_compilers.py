"""Processes that compile: what they may take, when they are replaced, and what becomes of kernels that end them."""

from __future__ import annotations

import select
import signal
from pathlib import Path

import pytest

from gpu import CompileError, Renderer
from gpu.precompile.kernel_keys import common_keys, kernel_key
from service.ipc import channel
from service.worker.helpers import compile_client
from service.worker.helpers.compile_client import ALONE_S, REFUSED_S, CompileClient, compilers
from service.worker.helpers.compile_lane import MOST_KERNELS, MOST_RESIDENT, TRIES, Compiled, Started
from tests.serving import PATIENCE_S
from tests.supervisors import SETTINGS, arrays_of

KEYS = common_keys()
STARTED, DONE = Started(), Compiled(1.0, cached=True)


class Processes:
    """In the place of processes of one lane: each message of `answers` is the next one's, and a number ends one."""

    def __init__(self, *answers: Started | Compiled | int) -> None:
        self.process_id: int | None = None
        self.begun = 0
        self.asked: list[int] = []  # which of `KEYS`
        self._answers, self._exit_code = list(answers), 0
        self._works = self.paused = False

    def pause(self, is_paused: bool) -> None:
        self.paused = is_paused

    def ask(self, key: object) -> None:
        if self.process_id is None:
            self.begun += 1
            self.process_id = -self.begun
        self.asked.append([*map(id, KEYS)].index(id(key)))
        self._works = True

    def hear(self) -> Started | Compiled:
        if not (self._answers and self._works):
            raise BlockingIOError
        answer = self._answers.pop(0)
        self._works = isinstance(answer, Started)
        if isinstance(answer, int):
            self._exit_code = answer
            raise channel.Closed
        return answer

    def close(self) -> int:
        self.process_id = None
        return self._exit_code


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[float]:
    """The monotonic clock of compilers, which the test advances. No kernel is recorded."""
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    clock = [1000.0]
    for module in ("compile_client", "compile_lane"):
        monkeypatch.setattr(f"service.worker.helpers.{module}.time.monotonic", lambda: clock[0])
    return clock


def client(gpu: Renderer, *answers: Started | Compiled | int) -> tuple[CompileClient, Processes]:
    compiler, processes = CompileClient(gpu.info, None, foresees=False), Processes(*answers)
    compiler._lanes["now"][0].helper = processes  # type: ignore[assignment]
    return compiler, processes


def heard(compiler: CompileClient, times: int = 20) -> None:
    for _ in range(times):
        compiler.hear()


def test_a_process_is_replaced_after_some_kernels_or_where_it_has_grown(gpu: Renderer, now: list[float]) -> None:
    large = Compiled(1.0, cached=True, resident=MOST_RESIDENT + 1)
    for answers, replaced_after in (([DONE] * (MOST_KERNELS + 1), MOST_KERNELS), ([DONE, large, DONE], 2)):
        compiler, processes = client(gpu, STARTED, *answers[:replaced_after], STARTED, *answers[replaced_after:])
        for number in range(len(answers)):
            key = KEYS[number % len(KEYS)]
            compiler._needs_no_wait.clear()
            for record in compile_client.records().glob("*"):
                record.unlink()
            assert compiler.queue(key, lambda milliseconds: None)
            assert processes.begun == 1 + (number >= replaced_after)
            heard(compiler, 2)


@pytest.mark.parametrize("code", [-signal.SIGSEGV, -signal.SIGABRT, 1])
def test_a_kernel_that_ends_its_compiler_is_refused_for_a_while(code: int, gpu: Renderer, now: list[float]) -> None:
    """LLVM ends its process in one of these ways where it gets no memory."""
    done: list[float] = []
    compiler, processes = client(gpu, STARTED, code, STARTED, DONE)
    assert compiler.queue(KEYS[0], done.append)
    heard(compiler)
    assert done == [0.0] and processes.asked == [0]
    with pytest.raises(CompileError, match=r"could not be compiled: its compiler ended \(.*\), .* MiB of memory"):
        compiler.queue(KEYS[0], done.append)
    compiler.prepare(KEYS[:1], "now")
    assert compiler.queue(KEYS[1], done.append), "others are compiled as before"
    assert processes.asked == [0, 1] and processes.begun == 2
    heard(compiler)
    now[0] += REFUSED_S
    assert compiler.queue(KEYS[0], done.append) and processes.asked == [0, 1, 0]


def test_a_kernel_whose_compiler_is_killed_is_begun_again_but_not_for_ever(gpu: Renderer, now: list[float]) -> None:
    """By the kernel, where the machine's memory runs out."""
    done: list[float] = []
    compiler, processes = client(gpu, *[STARTED, -signal.SIGKILL] * (TRIES - 1), STARTED, DONE)
    assert compiler.queue(KEYS[0], done.append)
    heard(compiler)
    assert done == [1.0] and not compiler.queue(KEYS[0], done.append) and processes.begun == TRIES
    compiler, processes = client(gpu, *[STARTED, -signal.SIGKILL] * (TRIES + 1))
    assert compiler.queue(KEYS[1], done.append)
    heard(compiler)
    assert processes.begun == TRIES
    with pytest.raises(CompileError, match=f"its compiler was killed {TRIES} times"):
        compiler.queue(KEYS[1], done.append)


def test_a_kernel_that_takes_too_long_is_refused(gpu: Renderer, now: list[float]) -> None:
    compiler, processes = client(gpu, STARTED)
    assert compiler.queue(KEYS[0], lambda milliseconds: None)
    now[0] += compile_client.LIMIT_S - 1
    heard(compiler)
    assert not compiler.is_idle("now")
    now[0] += 2
    heard(compiler)
    assert compiler.is_idle("now") and processes.process_id is None
    with pytest.raises(CompileError, match="it takes more than 300 s"):
        compiler.queue(KEYS[0], lambda milliseconds: None)


def test_where_no_process_starts_the_renderer_compiles_for_a_minute(gpu: Renderer, now: list[float]) -> None:
    done: list[float] = []
    compiler, processes = client(gpu, *[0] * TRIES, STARTED, DONE)
    assert compiler.queue(KEYS[0], done.append) and compiler.able
    heard(compiler)
    assert done == [0.0] and processes.begun == TRIES and not compiler.able
    assert not compiler.queue(KEYS[0], done.append), "the renderer does it"
    now[0] += ALONE_S
    assert compiler.able and compiler.queue(KEYS[0], done.append)
    heard(compiler)
    assert done == [0.0, 1.0] and compiler.on_disk(KEYS[0])


def test_a_process_gets_no_more_memory_than_it_may_take(
    gpu: Renderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process of its own on an empty cache, which a kernel of pictures costs more than that."""
    if not gpu.info["software"]:
        pytest.skip("what compilers of GPUs take is another thing")
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compile_client, "MEMORY", dict.fromkeys((True, False), 8 << 20))
    key = kernel_key(arrays_of("rich"), SETTINGS["rich"], frozenset())
    compiler, done = CompileClient(gpu.info, None, foresees=False), list[float]()
    try:
        assert compiler.queue(key, done.append)
        while not done:
            assert any(select.select(compiler.ends, [], [], PATIENCE_S))
            compiler.hear()
        with pytest.raises(CompileError, match="as it does where it needs more than 8 MiB of memory"):
            compiler.queue(key, done.append)
    finally:
        compiler.close()


def test_kernels_are_compiled_side_by_side_where_a_gpu_leaves_the_cores_idle(
    gpu: Renderer, now: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compile_client, "compilers", lambda is_software, cores: 2)
    compiler, done = CompileClient(gpu.info, None), list[float]()
    processes = {each: [Processes(STARTED, DONE, STARTED, DONE) for _ in range(2)] for each in ("now", "spare")}
    for priority, helpers in processes.items():
        for lane, helper in zip(compiler._lanes[priority], helpers, strict=True):  # type: ignore[index]
            lane.helper, lane.begins = helper, 0.0  # type: ignore[assignment]
    compiler.prepare([KEYS[2]], "spare")
    assert compiler.is_idle("spare"), "there is another one"
    for key in (KEYS[0], KEYS[1], KEYS[0]):
        assert compiler.queue(key, lambda milliseconds, key=key: done.append(milliseconds))  # type: ignore[misc]
    assert [helper.asked for helper in processes["now"]] == [[0], [1]]
    assert processes["spare"][0].asked == [2] and not processes["spare"][0].paused
    heard(compiler)
    assert done == [1.0] * 3 and all(compiler.on_disk(key) for key in KEYS[:3])


def test_a_processor_that_renders_has_one_compiler() -> None:
    assert [compilers(True, 64), compilers(False, 2), compilers(False, 16), compilers(False, 64)] == [1, 1, 4, 4]
