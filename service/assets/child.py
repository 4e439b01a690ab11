"""The process that parses strangers' files: `python -m service.assets.child FD`, FD being a socket to the parent.

One request after the other: a format and a file come in, arrays in sealed memory go out. It ends when the parent
does, and is killed where a file takes too much time; memory that a file must not take is refused to it.
"""

import contextlib
import ctypes
import errno
import fcntl
import importlib
import json
import mmap
import os
import resource
import signal
import socket
import sys
from typing import Any

import numpy as np

from service.assets.data import AssetLimits, ImageData, MeshData, SceneFile
from service.assets.errors import ParseError
from service.assets.wire import Pieces, publish, receive, send
from service.shared import trim

CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000
LARGE = 1 << 20  # bytes of a file after which memory is given back to the system
LIBRARIES = ("numpy", "PIL.Image", "OpenImageIO", "DracoPy", "trimesh.exchange.stl")


def main() -> None:
    link = socket.socket(fileno=int(sys.argv[1]))
    _confine()
    while True:
        try:
            request, source = receive(link)
        except (EOFError, OSError):
            return
        if source < 0:
            for name in LIBRARIES:
                importlib.import_module(name)
            continue
        large = os.fstat(source).st_size > LARGE
        reply, result = _answer(request, source, link)
        os.close(source)
        if large:
            trim()
        try:
            send(link, reply, result)
        except OSError:
            return
        if result >= 0:
            os.close(result)


def _confine() -> None:
    """Never a core file, no network where the kernel lets us drop it, and the first to go when memory runs out."""
    _limit(resource.RLIMIT_CORE, 0)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWNET) != 0:
        libc.unshare(CLONE_NEWUSER | CLONE_NEWNET)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle; it closes the socket
    os.nice(5)
    with contextlib.suppress(OSError), open("/proc/self/oom_score_adj", "w") as score:
        score.write("1000")


def _limit(which: int, value: int) -> None:
    """The soft limit, as far as the hard one that we were given lets us; it can be lifted again for the next file."""
    hard = resource.getrlimit(which)[1]
    resource.setrlimit(which, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))


def _answer(request: dict[str, Any], source: int, link: socket.socket) -> tuple[dict[str, Any], int]:
    limits = AssetLimits(**request["limits"])
    try:
        _bound(limits, request["memory"])
        # A signal when the parent hangs up, whose default is to end: also in the middle of a library's loop.
        fcntl.fcntl(link, fcntl.F_SETOWN, os.getpid())
        fcntl.fcntl(link, fcntl.F_SETFL, fcntl.fcntl(link, fcntl.F_GETFL) | os.O_ASYNC)
        parsed = _parse(request["format"], source, limits, request["whole"])
        arrays, facts = _arrays(parsed)
        del parsed
        fd, table = publish(arrays)
        return {"arrays": table, **facts}, fd
    except ParseError as error:
        return {"error": error.detail[:2000], "pointer": error.pointer[:1000]}, -1
    except Exception as error:
        if isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM:
            return {"error": f"reading it takes more than the {request['memory'] >> 20} MiB allowed"}, -1
        # Libraries raise anything at all on nonsense; none of it may end the child.
        plain = isinstance(error, OSError | ValueError) and str(error)
        said = str(error) if plain else f"{type(error).__name__}: {error}"
        return {"error": f"it can't be read as {request['format'].upper()} ({said[:300]})"}, -1
    finally:
        fcntl.fcntl(link, fcntl.F_SETFL, fcntl.fcntl(link, fcntl.F_GETFL) & ~os.O_ASYNC)
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        resource.setrlimit(resource.RLIMIT_AS, (hard, hard))


def _bound(limits: AssetLimits, memory: int) -> None:
    """Memory beyond what the libraries have taken already, and processor time beyond what earlier files took."""
    with open("/proc/self/statm") as sizes:
        taken = int(sizes.read().split()[0]) * mmap.PAGESIZE
    _limit(resource.RLIMIT_AS, taken + memory)
    used = resource.getrusage(resource.RUSAGE_SELF)
    _limit(resource.RLIMIT_CPU, int(used.ru_utime + used.ru_stime + limits.seconds) + 1)


def _parse(format: str, source: int, limits: AssetLimits, whole: bool) -> MeshData | ImageData | SceneFile:
    """`whole`: of a file that is a scene not its triangles only."""
    from service.assets.gltf.scene import read_scene
    from service.assets.image import SIGNATURES, parse_image
    from service.assets.mesh import parse_mesh

    size = os.fstat(source).st_size
    if not size:
        raise ParseError("the file is empty")
    if format in SIGNATURES:
        return parse_image(format, os.pread(source, size, 0), f"/proc/self/fd/{source}", limits)
    # Mapped and not read: the file is in memory already.
    data = memoryview(mmap.mmap(source, size, access=mmap.ACCESS_READ))
    return read_scene(data, limits) if whole else parse_mesh(format, data, limits)


def _arrays(parsed: MeshData | ImageData | SceneFile) -> tuple[dict[str, Pieces], dict[str, Any]]:
    if isinstance(parsed, SceneFile):
        parts = [(len(p.data), p.pointer, p.vertices, p.triangles) for p in parsed.parts]
        told = json.dumps(vars(parsed) | {"parts": parts}).encode()
        files = [np.frombuffer(part.data, np.uint8) for part in parsed.parts]
        return {"scene": [np.frombuffer(told, np.uint8)], "files": files}, {}
    if isinstance(parsed, ImageData):
        return {"pixels": [parsed.pixels]}, {"warnings": list(parsed.warnings)}
    arrays: dict[str, Pieces] = {
        name: [array] for name, array in vars(parsed).items() if isinstance(array, np.ndarray)
    }
    return arrays, {"warnings": list(parsed.warnings)}


if __name__ == "__main__":
    main()
