"""Compiles kernels: `python -m service.worker.helpers.compile_main DESCRIPTOR --parent PID`.

A process of its own with its own context: what it compiles the renderer loads from the driver's disk cache. Where the
renderer is lost, the kernel under way is finished, for the next one: killed every few seconds on a starved machine,
they would never have it.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import resource
import select
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import get_args

from service.ipc import channel
from service.system.confined import hide
from service.system.cpu import HIGHEST, raise_thread_niceness
from service.system.lifeline import end_with, end_with_pipe, hung_up
from service.system.shared_memory import trim
from service.worker.helpers.compile_client import Priority, records
from service.worker.helpers.compile_lane import Compiled, Started

IDLE_S = 60.0  # then it ends, and gives back what the driver and its compiler hold (some 250 MB)
LOCKS: dict[Priority, str] = {"now": ".lock", "soon": ".soon", "spare": ".spare"}  # endings of the files
LOOK_S = 0.05  # between two looks whether another one has the kernel that both want
SPARE_IDLE_S = 5.0  # ... where kernels come seldom
SOON_NICENESS = 2  # steps above the renderer's: beside tracing on two cores it gets half of one


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m service.worker.helpers.compile_main")
    parser.add_argument("descriptor", type=int)
    parser.add_argument("--parent", type=int, required=True)
    parser.add_argument("--driver", required=True, help="its name and version, which records go by")
    parser.add_argument("--lifeline", type=int, help="a pipe, whose other end the server holds")
    parser.add_argument("--memory", type=int, required=True, help="bytes that it may take for kernels")
    parser.add_argument("--device", type=int)
    parser.add_argument("--priority", choices=get_args(Priority), default="now")
    arguments = parser.parse_args()
    priority: Priority = arguments.priority
    if priority == "soon":
        raise_thread_niceness(os.getpriority(os.PRIO_PROCESS, 0) + SOON_NICENESS)
    elif priority == "spare":
        try:
            os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
        except OSError:  # a container's runtime may refuse it
            raise_thread_niceness(HIGHEST)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if not (end_with(arguments.parent) if arguments.lifeline is None else end_with_pipe(arguments.lifeline)):
        return 0
    hide()
    from gpu.errors import GpuError
    from gpu.precompile.precompiler import Precompiler

    with socket.socket(fileno=arguments.descriptor) as end:
        try:
            ahead = Precompiler(arguments.device)
            bound_memory(arguments.memory)
            channel.send(end, Started())
            spent_s = 0.0
            while select.select([end], [], [], IDLE_S if priority == "now" else SPARE_IDLE_S)[0]:
                key = channel.receive(end, wait=True)
                record = records() / key.digest(arguments.driver)
                try:
                    # What compiles with less of the processor can take as long as it likes: only its like waits for
                    # it, that of the other renderers, which all have the same list.
                    with _alone(record, end, LOCKS[priority]):
                        compiled = Compiled(0.0, True) if os.path.exists(record) else Compiled(*ahead.compile(key))
                        if compiled.cached:
                            _record(record)
                except GpuError as error:
                    compiled = Compiled(0.0, True, str(error))
                trim()
                before_s, spent_s = spent_s, time.process_time()
                channel.send(end, replace(compiled, resident=_status("VmRSS"), spent_s=spent_s - before_s))
        except (channel.Closed, GpuError):
            pass
    return 0


def bound_memory(memory: int) -> None:
    """Let this process take so many more bytes of memory of its own. Address space is another thing: drivers of GPUs
    reserve more of it than any machine has memory. LLVM ends its process where it gets no more."""
    most = _status("VmData") + memory
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    within = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (within, hard))


def _status(name: str) -> int:
    """A figure of this process [proc_pid_status(5)], in bytes."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) << 10 for line in lines if line.startswith(f"{name}:"))


@contextmanager
def _alone(record: Path, end: socket.socket, lock_suffix: str) -> Iterator[None]:
    """Wait for a lock, so that no other process of its kind compiles the same kernel. Raises channel.Closed."""
    path = record.with_suffix(lock_suffix)
    try:
        record.parent.mkdir(parents=True, exist_ok=True)
        lock = os.open(path, os.O_CREAT | os.O_RDWR | os.O_CLOEXEC, 0o600)
    except OSError:  # nobody can write there: then each compiles for itself
        yield
        return
    try:
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if hung_up(end.fileno()):
                    raise channel.Closed from None
                time.sleep(LOOK_S)
        yield
        path.unlink(missing_ok=True)
    finally:
        os.close(lock)


def _record(record: Path) -> None:
    with suppress(OSError):
        record.touch()


if __name__ == "__main__":
    raise SystemExit(main())
