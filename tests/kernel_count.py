"""Counts the path kernels of a run of the tests: each takes LLVM seconds, so that their number is bounded.

Counted are the kernels of pictures in the tests' own processes and in servers, each once a run, whatever worker of
xdist asked for it first. Probes of single functions stand beside. A server under an editor compiles more or fewer of
them by how fast the machine is; its bound is as wide as that.
"""

from __future__ import annotations

import fcntl
import logging
import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.families import EXACT

ENTRIES = ("pathtrace.comp", "lighttrace.comp", "guides.comp")
TESTS, SERVERS = "tests", "servers"
BOUNDS = {TESTS: 280, SERVERS: 300}  # 60 and 60 are the aim; 254 were counted, and 150 to 230
# A line of a server's log, on a terminal or as JSON.
COMPILED = re.compile(r"compiled (?:pathtrace|lighttrace|guides)\.comp\b.*?\bkey[\"']?[=:] ?[\"']?([0-9a-f]{12})")
VARIABLE = "SUNBOX_TEST_KERNELS"  # the file in which all processes of a run write down what they compiled


class KernelCount(logging.Handler):
    """The keys of the kernels that a run has compiled, each with the test that brought it."""

    def __init__(self, path: Path, bounded: bool) -> None:
        super().__init__(logging.INFO)
        self._path = path
        self.bounded = bounded
        self.test = ""
        self._excess: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        if record.msg in [f"compiled {entry}" for entry in ENTRIES] and isinstance(record.args, dict):
            self.add([str(record.args["key"])])

    def add(self, keys: list[str], where: str = TESTS) -> None:
        """Write down those that are new to the run; `where` is TESTS or SERVERS."""
        with self._path.open("a+") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            file.seek(0)
            known = dict(line.split()[:2] for line in file)
            for key in dict.fromkeys(keys):
                if key not in known:
                    known[key] = where
                    file.write(f"{key} {where} {self.test}\n")
                    if self.bounded and list(known.values()).count(where) > BOUNDS[where]:
                        self._excess.append(key)

    def excess(self) -> int:
        """How many came on top of `MOST` since the last call."""
        found, self._excess = len(self._excess), []
        return found

    @property
    def exceeded(self) -> bool:
        """Whether the run has compiled more than it may."""
        return self.bounded and any(self._total(where) > most for where, most in BOUNDS.items())

    def __str__(self) -> str:
        told = (f"{self._total(where)}" + self.bounded * f" of at most {most}" for where, most in BOUNDS.items())
        return "path kernels: {} in tests, {} in servers".format(*told)

    def _total(self, where: str) -> int:
        return sum(line.split()[1] == where for line in self._path.read_text().splitlines())


_count: KernelCount | None = None


def start(config: pytest.Config) -> KernelCount:
    """Begin to count. The first process of a run makes the file; its workers and servers inherit the variable."""
    global _count
    if VARIABLE not in os.environ:
        handle, name = tempfile.mkstemp(prefix="sunbox-kernels-")
        os.close(handle)
        os.environ[VARIABLE] = name

        def forget() -> None:
            del os.environ[VARIABLE]
            os.unlink(name)

        config.add_cleanup(forget)
    # With exact kernels, and in what `make long-test` alone runs, there is one for nearly every scene.
    bounded = not EXACT and "not slow" in config.option.markexpr
    _count = KernelCount(Path(os.environ[VARIABLE]), bounded)
    logger = logging.getLogger("gpu.kernels.cache")
    logger.setLevel(logging.INFO)
    logger.addHandler(_count)
    config.add_cleanup(lambda: logger.removeHandler(_count))
    return _count


def read_log(log: Path) -> None:
    """Count what a server says in its log that it has compiled."""
    if _count is not None:
        _count.add(COMPILED.findall(log.read_text(errors="replace")), SERVERS)


def watch(item: pytest.Item) -> Iterator[None]:
    """A test's time: it fails where it brings a kernel too many."""
    assert _count is not None
    _count.test = item.nodeid
    yield
    more = _count.excess()
    if more:
        pytest.fail(f"brings {more} path kernel(s) beyond those of {BOUNDS}: give its scenes a family's kernel")
