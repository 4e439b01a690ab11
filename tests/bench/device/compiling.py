"""How long kernels take: on an empty cache, several at a time; again in other processes; and without the cache."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from tempfile import mkdtemp

from gpu import Renderer
from service.bench import machine
from service.bench.device import stage
from tests.bench.device import subjects
from tests.bench.device.part import Options, Row

PROCESSES = 14
WRITES_S = 1.0  # drivers write their caches in the background, and a worker of a pool ends at once
AGAIN = ("shader-ball", "cornell-boxes", "whisky", "shader-ball: soap-film")
SIZE = (8, 8)


def compiled(name: str, device: int | None, cache: str | None, guides: bool = False) -> Row:
    """Seconds of a scene's kernels in this process, which is new."""
    if cache is not None:
        os.environ |= machine.shader_caches(cache)
    began = time.perf_counter()
    arrays = subjects.arrays(name)
    packed = time.perf_counter()
    with Renderer(device) as renderer:
        ready = time.perf_counter()
        picture = renderer.picture(renderer.load(arrays), stage.settings(SIZE))
        out: Row = {
            "scene": name,
            "pack_s": round(packed - began, 3),
            "context_s": round(ready - packed, 3),
            "compile_s": round(picture.compile_ms / 1e3, 3),
        }
        if guides:
            picture.trace(1.0, 1)
            ready = time.perf_counter()
            picture.read("depth")
            out["guides_s"] = round(time.perf_counter() - ready, 3)
            ready = time.perf_counter()
            picture.display()
            out["display_s"] = round(time.perf_counter() - ready, 3)
        time.sleep(WRITES_S)
        return out


def rows(options: Options) -> Iterator[Row]:
    processes = max(1, min(PROCESSES, machine.cores() - 1))
    names = subjects.NAMES if options.scale >= 1 else subjects.NAMES[:4]
    yield from _all("alone", AGAIN[:1], options, 1, mkdtemp())
    began = time.perf_counter()
    yield from _all("cold", names, options, processes, None, True)
    yield {"what": "all cold", "processes": processes, "kernels of": len(names),
           "wall_s": round(time.perf_counter() - began, 1)}  # fmt: skip
    again = [name for name in AGAIN if name in names]
    yield from _all("from another process", again, options, 1, None)
    yield from _all("with another cache", again[:2], options, 1, mkdtemp())
    folder = Path(os.environ["__GL_SHADER_DISK_CACHE_PATH"])
    files = [path for path in folder.rglob("*") if path.is_file()]
    yield {"what": "cache", "files": len(files), "bytes": sum(path.stat().st_size for path in files)}


def _all(
    what: str, names: tuple[str, ...] | list[str], options: Options, processes: int, cache: str | None,
    guides: bool = False,
) -> Iterator[Row]:  # fmt: skip
    # A process a kernel: what the driver keeps in memory must not help.
    with ProcessPoolExecutor(processes, get_context("spawn"), max_tasks_per_child=1) as pool:
        asked = {pool.submit(compiled, name, options.device, cache, guides): name for name in names}
        for done in as_completed(asked):
            try:
                yield {"what": what, **done.result()}
            except Exception as error:  # of whatever kind: the other kernels go on
                yield {"what": what, "scene": asked[done], "failed": f"{type(error).__name__}: {error}"[:1500]}
