"""A child that parses strangers' files can do nothing else: it tries, and the kernel refuses.

Where the kernel of this machine lacks Landlock or seccomp, the tests of these are skipped, and say so.
"""

from __future__ import annotations

import asyncio
import errno
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from service.config import Config
from service.formats.sandbox.sandbox import Sandbox
from service.formats.types import AssetLimits
from service.server.app import create_app
from service.server.state import AppState
from service.system.child_processes import ROOT, Children, inherited_environment
from service.system.confined import Rights, child, kernel
from service.system.confined.kernel import AUDIT_ARCH, READING, RIGHTS, system_calls
from tests import privileges
from tests.serving import KEYS, SCENE, SMALL, Server, families

# As what it is started: with the rights of whoever runs the tests, root perhaps, and without any capability.
PYTHONS = {"as the tests": privileges._own, "without capabilities": None}
TRIES = """
import ctypes, fcntl, json, os, resource, signal, socket, struct, subprocess, sys
from dataclasses import asdict
from service.system.confined import child as layers, confine, renounce
folder, victim, layer = sys.argv[1], int(sys.argv[2]), sys.argv[3]
if layer == "landlock":
    layers.filter_system_calls = lambda calls, writes_memory: False
if layer == "seccomp":
    layers.allow_reading_only = lambda calls, paths: 0
libc = ctypes.CDLL(None, use_errno=True)
ours, theirs = socket.socketpair()
own = os.getpid()
unsent = open(folder + "/open", "rb")
rights = renounce(confine(1))

def call(name, *arguments):
    done = libc.syscall(NUMBERS[name], *arguments)
    if os.getpid() != own:
        os._exit(0)  # clone3 is a fork
    if done == -1:
        raise OSError(ctypes.get_errno(), name)

def library(name, *arguments):
    if getattr(libc, name)(*arguments) == -1:
        raise OSError(ctypes.get_errno(), name)

def forked():
    child = os.fork()
    if child == 0:
        os._exit(0)
    os.waitpid(child, 0)

NUMBERS = json.loads(sys.argv[4])
PTRACE_ATTACH = 16
buffer = ctypes.create_string_buffer(4096)
vector = struct.pack("@PN", ctypes.addressof(buffer), 16)
tries = {
    "read a file outside": lambda: open(folder + "/secret"),
    "list a folder outside": lambda: os.listdir(folder),
    "read what the system has": lambda: open("/etc/passwd"),
    "write a file": lambda: open(folder + "/secret", "w"),
    "append to a file": lambda: open(folder + "/secret", "a"),
    "make a file": lambda: open(folder + "/new", "x"),
    "make a file without a name": lambda: os.open(folder, os.O_TMPFILE | os.O_RDWR),
    "write among the packages": lambda: open(json.__file__, "r+b"),
    "truncate": lambda: os.truncate(folder + "/secret", 0),
    "make a folder": lambda: os.mkdir(folder + "/more"),
    "delete": lambda: os.unlink(folder + "/secret"),
    "rename": lambda: os.rename(folder + "/secret", folder + "/public"),
    "make a link": lambda: os.symlink("/", folder + "/link"),
    "change rights": lambda: os.chmod(folder + "/secret", 0o777),
    "TCP": lambda: socket.socket(socket.AF_INET).connect(("127.0.0.1", 9)),
    "UDP": lambda: socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b"x", ("127.0.0.1", 9)),
    "Unix sockets": lambda: socket.socket(socket.AF_UNIX).connect(folder + "/socket"),
    "send to an address": lambda: ours.sendto(b"x", folder + "/socket"),
    "socket pairs": lambda: socket.socketpair(),
    "netlink": lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW),
    "exec": lambda: os.execv("/bin/true", ["/bin/true"]),
    "start a program": lambda: subprocess.run(["/bin/true"], check=True),
    "fork": forked,
    "clone3": lambda: call("clone3", buffer, 88),
    "trace the server": lambda: library("ptrace", PTRACE_ATTACH, victim, 0, 0),
    "kill the server": lambda: os.kill(victim, signal.SIGTERM),
    "signal a thread of the server": lambda: call("tgkill", victim, victim, signal.SIGTERM),
    "have the kernel signal the server": lambda: fcntl.fcntl(ours, fcntl.F_SETOWN, victim),
    "choose which signal": lambda: fcntl.fcntl(ours, fcntl.F_SETSIG, signal.SIGKILL),
    "read the server's memory": lambda: open(f"/proc/{victim}/mem", "rb"),
    "write the server's memory": lambda: open(f"/proc/{victim}/mem", "r+b"),
    "read the server's environment": lambda: open(f"/proc/{victim}/environ", "rb").read(),
    "read across processes": lambda: call("process_vm_readv", victim, vector, 1, vector, 1, 0),
    "limit the server": lambda: resource.prlimit(victim, resource.RLIMIT_NOFILE, (3, 3)),
    "open a process": lambda: os.pidfd_open(victim),
    "io_uring": lambda: call("io_uring_setup", 8, buffer),
    "BPF": lambda: call("bpf", 0, buffer, 48),
    "userfaultfd": lambda: call("userfaultfd", 1),
    "keys": lambda: call("keyctl", 0, -3, 0),
    "name spaces": lambda: library("unshare", 0x10000000),
    "mount": lambda: library("mount", b"none", folder.encode(), b"tmpfs", 0, None),
    "be root": lambda: os.setuid(0 if os.getuid() else 12345),
    "be dumpable again": lambda: library("prctl", 4, 1, 0, 0, 0),
    "type into the terminal": lambda: fcntl.ioctl(ours, 0x5412, b"x"),
}
said = {}
for name, attempt in tries.items():
    try:
        attempt()
        said[name] = "done"
    except OSError as error:
        said[name] = error.errno
works = {
    "read among the packages": bool(open(json.__file__).read()),
    "import": bool(__import__("wave")),
    "read an open file": os.pread(unsent.fileno(), 100, 0) == b"open",
    "answer": ours.sendmsg([b"x"]) == ours.send(b"x") == 1,
    "memory": os.write(os.memfd_create("x"), b"x") == 1,
    "threads": not __import__("threading").Thread(target=print, kwargs={"file": sys.stderr}).start(),
}
sys.stdout.write(json.dumps([asdict(rights), said, works]))
"""
NUMBERS = {  # of calls that Python has no function for: on x86_64 and aarch64
    "clone3": (435, 435), "tgkill": (234, 131), "process_vm_readv": (310, 270), "io_uring_setup": (425, 425),
    "bpf": (321, 280), "userfaultfd": (323, 282), "keyctl": (250, 219),
}  # fmt: skip
# What each layer refuses alone: Landlock knows files, TCP, and signals; it leaves the rest to seccomp.
BY_LANDLOCK = {
    "read a file outside", "list a folder outside", "read what the system has", "write a file", "append to a file",
    "make a file", "write among the packages", "truncate", "make a folder", "delete", "rename", "make a link", "exec",
    "start a program", "TCP", "trace the server", "read the server's memory", "write the server's memory",
    "read the server's environment", "read across processes",
}  # fmt: skip
BY_SECCOMP_NOT = {"read a file outside", "list a folder outside", "read what the system has"}
BY_ANYTHING = {"read the server's memory", "write the server's memory", "read the server's environment"}


@pytest.fixture
def victim() -> Iterator[int]:
    """A process as the server is one: of the same user, with secrets in its memory and environment."""
    program = "from service.system.confined import hide; assert hide(); print(flush=True); input()"
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={"KEY": "secret"},
    )
    assert process.stdout is not None and process.stdout.readline()
    yield process.pid
    assert process.poll() is None  # nobody has ended it
    process.communicate(b"\\n")


def tried(
    folder: Path, victim: int, layer: str, python: str | None
) -> tuple[Rights, dict[str, Any], dict[str, bool]]:
    folder.joinpath("secret").write_text("secret")
    folder.joinpath("open").write_text("open")
    machine = list(AUDIT_ARCH).index(os.uname().machine) if os.uname().machine in AUDIT_ARCH else 0
    numbers = json.dumps({name: both[machine] for name, both in NUMBERS.items()})
    command = [python or sys.executable, "-c", TRIES, str(folder), str(victim), layer, numbers]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rights, said, works = json.loads(done.stdout)
    assert folder.joinpath("secret").read_text() == "secret" and len(list(folder.iterdir())) == 2
    return Rights(**rights), said, works


def needs(rights: Rights, *names: str) -> None:
    for name in names:
        if not getattr(rights, name):
            pytest.skip(f"the kernel of this machine has no {name}")


@pytest.mark.parametrize("python", PYTHONS)
def test_everything_is_refused(tmp_path: Path, victim: int, python: str) -> None:
    rights, said, works = tried(tmp_path, victim, "all", PYTHONS[python])
    assert rights.no_new_privileges and rights.no_capabilities and rights.hidden
    needs(rights, "landlock", "seccomp")
    refused = (errno.EPERM, errno.EACCES, errno.ENOSYS, errno.ENOTTY)
    assert {name: error for name, error in said.items() if error not in refused} == {}
    assert set(works.values()) == {True}


@pytest.mark.parametrize("python", PYTHONS)
def test_landlock_alone(tmp_path: Path, victim: int, python: str) -> None:
    rights, said, works = tried(tmp_path, victim, "landlock", PYTHONS[python])
    needs(rights, "landlock")
    refused = BY_LANDLOCK if rights.landlock >= 4 else BY_LANDLOCK - {"TCP"}
    refused |= {"kill the server"} if rights.landlock >= 6 else set()
    assert {name for name in refused if said[name] == "done"} == set() and not rights.seccomp
    assert set(works.values()) == {True}


@pytest.mark.parametrize("python", PYTHONS)
def test_seccomp_alone(tmp_path: Path, victim: int, python: str) -> None:
    rights, said, works = tried(tmp_path, victim, "seccomp", PYTHONS[python])
    needs(rights, "seccomp")
    done = {name for name, error in said.items() if error == "done"}
    assert done <= BY_SECCOMP_NOT and not rights.landlock
    assert not done & BY_ANYTHING  # the server is hidden
    assert set(works.values()) == {True}


def test_the_children_that_parse_have_given_up_their_rights(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    bodies = Children("service.server.requests.parser_child", 1)
    with Sandbox(AssetLimits()) as box:
        rights = box.rights()
        assert rights == box.rights() == bodies.rights()
        assert rights.no_new_privileges and rights.no_capabilities and rights.hidden
        assert len([one for one in caplog.records if "rights" in one.message]) == 1
    bodies.close()


def test_what_the_kernel_lacks_is_said_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(Children, "rights", lambda self: Rights(no_new_privileges=True))
    box = Sandbox(AssetLimits())
    assert box.rights().missing == ["no_capabilities", "no_network", "hidden", "landlock", "seccomp"]
    box.rights()
    assert not Rights(True, True, False, True, 1, True).missing  # without sockets no network is needed
    (record,) = caplog.records
    assert record.levelname == "WARNING" and "landlock,seccomp" in caplog.text


@pytest.mark.parametrize(
    "given_up", [Rights(), Rights(True, True, True, True, 0, True), Rights(True, True, False, True, 1, True)]
)
def test_a_server_may_ask_for_all_of_it(given_up: Rights, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`SUNBOX_REQUIRE_SANDBOX`: where the kernel does not take something, the start ends with its name."""
    monkeypatch.setattr(Children, "rights", lambda self: given_up)

    def reason(require_sandbox: bool) -> str | None:
        state: AppState = create_app(Config(data_dir=tmp_path, require_sandbox=require_sandbox)).state.sunbox
        try:
            return asyncio.run(state.sandbox_missing())
        finally:
            state.storage.assets.close()

    assert reason(False) is None
    told = reason(True)
    assert (told is None) == (not given_up.missing)
    assert told is None or all(name in told for name in ("SUNBOX_REQUIRE_SANDBOX", *given_up.missing))


def test_the_server_says_it_and_is_hidden(server: Server) -> None:
    told = server.http.get("/v1/info").json()["sandbox"]
    with Sandbox(AssetLimits()) as box:
        assert Rights(**told) == box.rights()
    assert "rights" in server.log.read_text()
    for name in ("mem", "environ"):
        assert "PermissionError" in read_by_another(server.process.pid, name)


def read_by_another(pid: int, name: str) -> str:
    """What another process of this user has to say that reads a file in a process's folder of /proc."""
    program = f"open('/proc/{pid}/{name}', 'rb').read(1)"
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True).stderr


def test_no_process_beside_the_server_has_its_keys(strict: Server) -> None:
    """A renderer, whose driver nothing confines, and the denoiser that it starts: other processes of this user read
    neither their memory nor their environment, and root finds no key there, nor one under a misspelt name."""
    order = {"scene": SCENE, "settings": {**SMALL, "denoise": True}}
    answer = strict.http.post("/v1/render", json=order, headers={"authorization": f"Bearer {KEYS[0]}"})
    assert answer.status_code == 200, answer.text
    renderer = strict.renderer()
    programs = {pid: Path(f"/proc/{pid}/cmdline").read_text() for pid in families(renderer)}
    (denoiser,) = (pid for pid, program in programs.items() if "denoise_main" in program)
    for pid in (renderer, denoiser):  # a compiler may just be starting
        for name in ("mem", "environ"):
            assert "PermissionError" in read_by_another(pid, name)
    for pid in programs:
        with suppress(OSError):  # it has ended, or who runs the tests is not root
            given = Path(f"/proc/{pid}/environ").read_bytes()
            assert not any(key.encode() in given for key in (*KEYS, "misspelt-key"))


def test_what_a_child_inherits(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("SUNBOX_API_KEY", "SUNBOX_LOG_FORMAT", "RAY_AUTH_TOKEN", "LD_PRELOAD"):
        monkeypatch.setenv(name, "given")
    found = inherited_environment()
    assert found["LD_PRELOAD"] == found["SUNBOX_LOG_FORMAT"] == "given" and found["PATH"]
    assert not {"SUNBOX_API_KEY", "RAY_AUTH_TOKEN"} & found.keys()
    assert inherited_environment("RAY_AUTH_TOKEN").items() - found.items() == {("RAY_AUTH_TOKEN", "given")}


@pytest.mark.parametrize("machine", AUDIT_ARCH)
def test_the_filter_is_sound(machine: str) -> None:
    """Of both processors: every jump lands within the program, and its last word is no."""
    calls = system_calls(machine)
    assert calls is not None
    program = kernel.program(calls, 1)
    assert len(program) < 4096  # BPF_MAXINSNS
    for at, (code, true, false, _) in enumerate(program[:-1]):
        assert at + 1 + max(true, false) < len(program) and max(true, false) < 256
        assert code == kernel.EQUAL or true == false == 0
    assert program[-1][0] == kernel.RETURN and program[-1][3] & kernel.REFUSE


def test_another_processor_has_no_filter() -> None:
    assert system_calls("riscv64") is None


@pytest.mark.skipif(not Path("/usr/include/asm-generic/unistd.h").exists(), reason="no kernel headers are installed")
def test_the_numbers_are_those_of_the_headers() -> None:
    """aarch64 has the generic ones; those of x86_64 stand where Debian's linux-libc-dev puts them."""
    generic = numbers(Path("/usr/include/asm-generic/unistd.h"))
    generic.setdefault("newfstatat", generic.get("fstatat", -1))
    for name, (_, number) in READING.items():
        assert number is None or generic[name] == number, name
    x86 = Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h")
    if x86.exists():
        found = numbers(x86)
        assert {name: found[name] for name in READING} == {name: number for name, (number, _) in READING.items()}


def numbers(header: Path) -> dict[str, int]:
    words = (line.split() for line in header.read_text().splitlines())
    found = [(each[1], each[2]) for each in words if len(each) > 2 and each[1].startswith("__NR")]
    return {name.partition("_")[2].lstrip("_").removeprefix("NR_").removeprefix("NR3264_"): int(number)
            for name, number in found if number.isdigit()}  # fmt: skip


def test_every_version_of_landlock_refuses_what_it_knows() -> None:
    assert list(RIGHTS) == sorted(RIGHTS) and list(RIGHTS.values()) == sorted(RIGHTS.values())


def test_packages_are_read_where_they_were_installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By `pip install --user` or `--target` as well, which sysconfig does not know; no other folder of the path."""
    packages, other = tmp_path / "packages", tmp_path / "other"
    (packages / "pydantic-2.0.dist-info").mkdir(parents=True)
    other.mkdir()
    monkeypatch.setattr(sys, "path", [*sys.path, str(packages), str(other)])
    assert packages in list(child.readable()) and other not in list(child.readable())
