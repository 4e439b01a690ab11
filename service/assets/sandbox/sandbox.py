"""Parsing in a bounded process beside the service: a file can cost no more than its limits, whatever is in it."""

import json
import logging
import os
import signal
import socket
import subprocess
import sys
import threading
from dataclasses import asdict, replace
from pathlib import Path
from types import TracebackType
from typing import Any

from service.assets.errors import ParseError
from service.assets.formats import KINDS
from service.assets.sandbox.wire import Array, adopt, memory, receive, send
from service.assets.types import AssetLimits, ImageData, MeshData, SceneFile, ScenePart
from service.cpu_time import answers

log = logging.getLogger(__name__)

ROOT = Path(__file__).resolve().parents[3]
# Address space: what the libraries need at most beside the arrays; what a texel of the largest image needs (float
# RGBA, thrice); and a byte of a mesh file: 42 were seen for an OBJ of one-letter words, 9 for one of a million
# triangles with normals, so a big file gets less for each.
BASE_BYTES = 512 << 20
BYTES_PER_TEXEL = 48
BYTES_PER_MESH_BYTE, BYTES_PER_BIG_MESH_BYTE, BIG_MESH_BYTES = 64, 12, 4 << 30
# That OBJ is read at .05 s a megabyte; for a slower machine under load.
SECONDS_PER_BYTE = 0.25 / (1 << 20)
CLOSING_SECONDS = 5.0
START_SECONDS = 30.0  # libraries read from a cold disk
# One thread each: a second one gains nothing on files of this size and takes address space from the limit.
# And what a big file took goes back to the machine: glibc else keeps blocks of up to 32 MiB for the next one.
THREADS = {
    **{"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENIMAGEIO_THREADS": "1"},
    **{"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "4194304"},
}
CRASHES = {
    signal.SIGXCPU: "reading it takes more processor time than the {seconds:g} s allowed",
    signal.SIGKILL: "reading it was stopped: the machine ran out of memory",
}


class Sandbox:
    """`parse` from any thread; at most `limits.children` files at once, the others wait. Children start on demand."""

    def __init__(self, limits: AssetLimits) -> None:
        self.limits = limits
        self._turn = threading.BoundedSemaphore(limits.children)
        self._lock = threading.Lock()
        self._idle: list[_Child] = []
        self._closed = False

    def start(self) -> None:
        """Starts a child for the first file, without waiting."""
        self._give_back(self._take())

    def warm(self) -> None:
        """Starts a child and has it load every library, without waiting: the first file then finds it ready."""
        child = self._take()
        send(child.link, {}, -1)
        self._give_back(child)

    def parse(self, format: str, source: bytes | int) -> MeshData | ImageData:
        """`format` is a key of KINDS; `source` the bytes or an open file. Of a scene all its triangles as one mesh.

        Raises ParseError.
        """
        parsed = self._bounded(format, source, False)
        assert not isinstance(parsed, SceneFile)
        return parsed

    def parse_scene(self, format: str, source: bytes | int) -> SceneFile:
        """Raises ParseError."""
        parsed = self._bounded(format, source, True)
        assert isinstance(parsed, SceneFile)
        return parsed

    def _bounded(self, format: str, source: bytes | int, whole: bool) -> MeshData | ImageData | SceneFile:
        fd = memory(source, "sunbox-source") if isinstance(source, bytes) else source
        try:
            with self._turn:
                return self._parse(format, fd, whole)
        finally:
            if isinstance(source, bytes):
                os.close(fd)

    def _parse(self, format: str, fd: int, whole: bool) -> MeshData | ImageData | SceneFile:
        size = os.fstat(fd).st_size
        if size > self.limits.max_file:
            raise ParseError(f"{size} bytes; {self.limits.max_file} are allowed")
        if KINDS[format] == "image":
            worst = BYTES_PER_TEXEL * self.limits.max_texels + size
        else:
            worst = min(BYTES_PER_MESH_BYTE * size, BIG_MESH_BYTES + BYTES_PER_BIG_MESH_BYTE * size)
        limits = replace(self.limits, seconds=self.limits.seconds + SECONDS_PER_BYTE * size)
        memory = min(BASE_BYTES + worst, self.limits.memory)
        request = {"format": format, "whole": whole, "memory": memory, "limits": asdict(limits)}
        child = self._take()
        try:
            reply, result = child.ask(request, fd, limits)
        except BaseException:
            child.kill()
            raise
        self._give_back(child)
        return _result(reply, result)

    def _take(self) -> "_Child":
        with self._lock:
            if self._closed:
                raise ParseError("the service is shutting down")
            while self._idle:
                child = self._idle.pop()
                if child.process.poll() is None:
                    return child
                child.kill()
        return _Child()

    def _give_back(self, child: "_Child") -> None:
        with self._lock:
            if not self._closed:
                self._idle.append(child)
                return
        child.kill()

    def close(self) -> None:
        """Ends the children that wait; one that parses ends with its file."""
        with self._lock:
            self._closed = True
            idle, self._idle = self._idle, []
        for child in idle:
            child.kill()

    def __enter__(self) -> "Sandbox":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Child:
    def __init__(self) -> None:
        self.link, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            # Nothing of the service's settings: they may hold its key.
            env = {k: v for k, v in os.environ.items() if not k.startswith("SUNBOX_")} | THREADS
            self.process = subprocess.Popen(
                [sys.executable, "-m", "service.assets.sandbox.child", str(theirs.fileno())],
                cwd=ROOT,
                env=env,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        self.started = False

    def ask(self, request: dict[str, Any], fd: int, limits: AssetLimits) -> tuple[dict[str, Any], int]:
        """The child's reply. Raises ParseError where it died or took too long; it must be killed then."""
        wait = limits.seconds if self.started else limits.seconds + START_SECONDS
        try:
            send(self.link, request, fd)
            if not answers(self.link, self.process.pid, wait):
                raise ParseError(f"reading it takes longer than the {limits.seconds:g} s allowed")
            reply = receive(self.link)
        except (EOFError, OSError):
            raise ParseError(self._death(limits)) from None
        self.started = True
        return reply

    def _death(self, limits: AssetLimits) -> str:
        try:
            code = self.process.wait(CLOSING_SECONDS)
        except subprocess.TimeoutExpired:
            return "reading it crashed the parser"
        log.warning("the parser died exit_code=%d", code)
        for number, text in CRASHES.items():
            if code == -number:
                return text.format(seconds=limits.seconds)
        return f"reading it crashed the parser ({signal.Signals(-code).name if code < 0 else f'exit code {code}'})"

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()
        self.link.close()


def _result(reply: dict[str, Any], fd: int) -> MeshData | ImageData | SceneFile:
    if "error" in reply:
        raise ParseError(str(reply["error"]), str(reply.get("pointer", "")))
    try:
        arrays = adopt(fd, reply["arrays"])
    finally:
        os.close(fd)
    if "pixels" in arrays:
        return ImageData(arrays["pixels"], tuple(map(str, reply["warnings"])))
    if "scene" in arrays:
        return _scene(arrays["scene"], arrays["files"])
    get = arrays.get
    return MeshData(
        arrays["vertices"], arrays["faces"], get("normals"), get("uvs"), get("uvs_1"), get("colors"),
        tuple(map(str, reply["warnings"])), get("tangents"),
    )  # fmt: skip


def _scene(text: Array, files: Array) -> SceneFile:
    told, view, parts, at = json.loads(text.tobytes()), files.data, [], 0
    for size, pointer, vertices, triangles in told["parts"]:
        parts.append(ScenePart(view[at : at + size], str(pointer), vertices, triangles))
        at += size
    return SceneFile(
        told["document"], parts, told["warnings"], int(told["triangles"]), bool(told["lit"]), told["exposure"],
        told["aspect_ratio"], told["bounds"],
    )  # fmt: skip
