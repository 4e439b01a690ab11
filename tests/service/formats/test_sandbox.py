"""The parsing child: no file costs more than its bounds, and what dies is replaced."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.formats import ImageData, MeshData
from service.formats.errors import ParseError
from service.formats.sandbox import sandbox
from service.formats.sandbox.sandbox import Sandbox
from service.formats.sandbox.wire import adopt, memory, publish
from service.formats.types import AssetLimits, MeshOddities
from service.system import child_processes, cpu
from service.system.child_processes import Children
from service.system.cpu import working_niceness
from tests.asset_files import OBJ, TRIANGLE, exr
from tests.serving import wait_until


@pytest.fixture
def box() -> Iterator[Sandbox]:
    with Sandbox(AssetLimits()) as box:
        yield box


def endless() -> bytes:
    """A polygon of 12 000 corners, every second one concave: its ears take minutes."""
    angle = np.arange(12000) * 2 * np.pi / 12000
    radius = 1 + 0.5 * (np.arange(12000) % 2)
    corners = "".join(f"v {x} {y} 0\n" for x, y in zip(radius * np.cos(angle), radius * np.sin(angle), strict=True))
    return (corners + "f " + " ".join(str(k + 1) for k in range(12000)) + "\n").encode()


def pid_of(box: Sandbox) -> int:
    box.parse("obj", OBJ)
    return box.children.idle[-1].process.pid


def running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_arrays_cross_the_border(box: Sandbox) -> None:
    mesh = box.parse("obj", OBJ)
    pixels = np.random.default_rng(0).random((5, 7, 3)).astype(np.float32)
    image = box.parse("exr", exr(pixels))
    assert isinstance(mesh, MeshData) and np.array_equal(mesh.vertices, TRIANGLE)
    assert isinstance(image, ImageData) and np.array_equal(image.pixels, pixels)


def test_an_open_file_is_as_good_as_bytes(box: Sandbox, tmp_path: Path) -> None:
    (tmp_path / "m.obj").write_bytes(OBJ)
    with open(tmp_path / "m.obj", "rb") as file:
        assert isinstance(box.parse("obj", file.fileno()), MeshData)
        assert not file.closed


def test_one_child_serves_many_files(box: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    """Until it has seen enough of them, or one that was wrong and may have been an attempt."""
    monkeypatch.setattr(sandbox, "FILES", 3)
    box.children = Children("service.formats.sandbox.child", sandbox.FILES, sandbox.ENVIRONMENT)
    pid = pid_of(box)
    assert pid_of(box) == pid
    third = pid_of(box)
    assert third != pid and not running(pid)
    with pytest.raises(ParseError):
        box.parse("obj", b"f 1 2 3\n")
    assert not running(third) and pid_of(box) != third


def test_a_child_starts_without_what_only_the_service_needs() -> None:
    script = "import sys, service.formats.sandbox.child; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    assert "service.formats.sandbox.child" in loaded
    assert not {"pydantic", "service.document", "service.config", "gpu"} & set(loaded)


def test_a_child_that_was_started_ahead_reads_the_first_file(box: Sandbox) -> None:
    box.start()
    waiting = box.children.idle[0].process.pid
    assert pid_of(box) == waiting


def test_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox, "SECONDS_PER_BYTE", 0)
    with Sandbox(AssetLimits()) as box:
        pid = pid_of(box)  # a process may take its time to start
        box.limits = AssetLimits(seconds=0.5)
        with pytest.raises(ParseError, match=r"longer than the 0\.5 s|processor time than the 0\.5 s"):
            box.parse("obj", endless())  # alone one second
        assert not running(pid)
        box.limits = AssetLimits()
        assert pid_of(box) != pid


def test_waiting_for_a_processor_is_not_the_files_fault(box: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    pid, waited = pid_of(box), 0

    def starved(pid: int) -> dict[int, tuple[int, int]]:
        nonlocal waited
        waited += 10**12
        return {pid: (0, waited)}

    monkeypatch.setattr(cpu, "ran", starved)
    os.kill(pid, signal.SIGSTOP)
    going_on = threading.Timer(1.0, os.kill, [pid, signal.SIGCONT])
    going_on.start()
    box.limits = AssetLimits(seconds=0.3)
    assert isinstance(box.parse("obj", OBJ), MeshData)
    going_on.join()


def test_too_much_memory(box: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    pid = pid_of(box)
    monkeypatch.setattr(sandbox, "BASE_BYTES", 4 << 20)
    monkeypatch.setattr(sandbox, "BYTES_PER_MESH_BYTE", 0)
    with pytest.raises(ParseError, match="more than the 4 MiB allowed"):
        box.parse("obj", OBJ + b"v 0 0 0\n" * 1_000_000)
    assert not running(pid)
    monkeypatch.undo()
    assert isinstance(box.parse("obj", OBJ + b"v 0 0 0\n" * 100_000), MeshData)


def test_too_large_a_file() -> None:
    with Sandbox(AssetLimits(max_file=100)) as box, pytest.raises(ParseError, match="101 bytes; 100 are allowed"):
        box.parse("obj", b" " * 101)


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGKILL, signal.SIGABRT])
def test_a_crash_is_an_answer(box: Sandbox, number: signal.Signals) -> None:
    pid = pid_of(box)
    threading.Timer(0.3, os.kill, (pid, number)).start()
    with pytest.raises(ParseError, match=f"crashed the parser .*{number.name}|out of memory"):
        box.parse("obj", endless())
    assert pid_of(box) != pid


def test_a_child_that_died_waiting_is_replaced(box: Sandbox) -> None:
    pid = pid_of(box)
    os.kill(pid, signal.SIGKILL)
    box.children.idle[0].process.wait()
    assert pid_of(box) != pid


def test_two_files_at_once(box: Sandbox) -> None:
    results: list[object] = []

    def parse() -> None:
        results.append(box.parse("obj", OBJ))

    threads = [threading.Thread(target=parse) for _ in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(30)
    assert len(results) == 6 and 1 <= len(box.children.idle) <= AssetLimits().children


def test_nothing_leaks(box: Sandbox) -> None:
    def descriptors() -> int:
        return len(os.listdir("/proc/self/fd"))

    pid_of(box)
    before = descriptors()
    for _ in range(5):
        box.parse("obj", OBJ)
        with pytest.raises(ParseError):
            box.parse("obj", b"f 1 2 3\n")
    assert descriptors() == before


def test_a_child_keeps_no_file_open(box: Sandbox) -> None:
    """It may have 64, and has read more."""
    pid = pid_of(box)
    for _ in range(sandbox.FILES - 2):
        assert isinstance(box.parse("exr", exr(np.zeros((2, 2, 3), np.float32))), ImageData)
    assert box.children.idle[0].process.pid == pid
    assert resource.prlimit(pid, resource.RLIMIT_NOFILE) == (64, 64)


def test_the_child_is_confined(box: Sandbox, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_API_KEY", "secret")
    pid = pid_of(box)
    assert resource.prlimit(pid, resource.RLIMIT_CORE) == (0, 0)
    assert resource.prlimit(pid, resource.RLIMIT_CPU)[0] < 60
    for limit in (resource.RLIMIT_AS, resource.RLIMIT_CPU, resource.RLIMIT_FSIZE, resource.RLIMIT_NOFILE):
        assert resource.prlimit(pid, limit)[1] != resource.RLIM_INFINITY
    assert os.getpriority(os.PRIO_PROCESS, pid) == working_niceness()


@pytest.mark.parametrize("busy", [False, True])
def test_children_end_with_a_parent_that_is_killed(busy: bool, tmp_path: Path) -> None:
    (tmp_path / "endless.obj").write_bytes(endless())
    program = (
        "import sys, time\n"
        "from service.formats.sandbox.sandbox import Sandbox\n"
        "from service.formats.types import AssetLimits\n"
        "box = Sandbox(AssetLimits())\n"
        f"box.parse('obj', {OBJ!r})\n"
        "print(box.children.idle[0].process.pid, flush=True)\n"
        f"box.parse('obj', open({str(tmp_path / 'endless.obj')!r}, 'rb').read()) if {busy} else time.sleep(60)\n"
    )
    parent = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, cwd=child_processes.ROOT
    )
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    time.sleep(0.5)
    assert running(pid)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_until(lambda: not running(pid))


def test_closing_ends_the_children() -> None:
    box = Sandbox(AssetLimits())
    pid = pid_of(box)
    box.close()
    assert not running(pid)
    with pytest.raises(ParseError, match="shutting down"):
        box.parse("obj", OBJ)


@pytest.mark.parametrize("count, held", [(1 << 10, 0), (1 << 18, 1)])
def test_small_arrays_hold_no_descriptor(count: int, held: int) -> None:
    before = len(os.listdir("/proc/self/fd"))
    fd, table = publish({"a": [np.arange(float(count))]})
    arrays = adopt(fd, table)
    os.close(fd)
    assert len(os.listdir("/proc/self/fd")) == before + held
    assert not arrays["a"].flags.writeable and np.array_equal(arrays["a"], np.arange(count))


def test_unsealed_or_lying_memory_is_not_adopted() -> None:
    fd, table = publish({"a": [np.arange(6.0).reshape(2, 3)]})
    assert np.array_equal(adopt(fd, table)["a"], [[0, 1, 2], [3, 4, 5]])
    with pytest.raises(ValueError, match="buffer"):
        adopt(fd, [table[0] | {"shape": [200, 300]}])
    with pytest.raises(ValueError, match="dtype"):
        adopt(fd, [table[0] | {"dtype": "|O"}])
    with pytest.raises(OSError):
        os.write(fd, b"x")
    os.close(fd)
    loose = memory(bytes(48), "loose")
    with pytest.raises(ValueError, match="sealed"):
        adopt(loose, table)
    os.close(loose)


def test_a_mesh_that_lies_is_not_taken() -> None:
    """Compiled code reads the vertices that its faces name, without a look at how many there are."""
    good: dict[str, Any] = {
        "vertices": np.zeros((3, 3)),
        "faces": np.array([[0, 1, 2]], np.int32),
        "normals": np.zeros((3, 3), np.float32),
        "groups": np.zeros(1, np.int32),
    }
    assert sandbox.mesh_of(dict(good), ("odd",), MeshOddities()).warnings == ("odd",)
    for name, lie in {
        "faces": np.array([[0, 1, 3]], np.int32),
        "vertices": np.zeros((3, 2)),
        "normals": np.zeros((2, 3), np.float32),
        "groups": np.zeros(2, np.int32),
        "uvs": np.zeros((3, 2)),
    }.items():
        with pytest.raises(ValueError, match=r"mesh|vertex"):
            sandbox.mesh_of({**good, name: lie}, (), MeshOddities())
    with pytest.raises(ValueError, match="vertex"):
        sandbox.mesh_of({**good, "faces": np.array([[0, 1, -1]], np.int32)}, (), MeshOddities())
