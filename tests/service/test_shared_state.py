"""What threads share is guarded: each shared container has a lock or a reason, and is used by eight threads."""

from __future__ import annotations

import ast
import asyncio
import gc
import os
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from service.formats.cache import ParsedCache
from service.formats.source import digest
from service.formats.types import AssetLimits, MeasuredData
from service.pack.cache import CacheBudget, PackCache
from service.server.assets.folder import AssetFolder
from service.server.assets.integrity import Integrity
from service.server.renders.scene import PackedScenes
from service.server.renders.store.pictures import PictureFiles
from service.server.storage.asset_shares import AssetShares
from service.server.storage.quota import Quota
from service.system import background, garbage, shared_memory
from service.system.background import count_death
from service.system.child_processes import Children
from service.system.disk_usage import Usage
from service.system.executors import Pool
from service.system.memory import MemoryBudget
from service.system.shares import CALLER
from service.system.turns import FairRoom
from tests.service.rendering.stored import picture
from tests.serving import wait_until

SERVICE = Path(__file__).parents[2] / "service"
THREADS = 8
# What modules change at run time, and why that is safe. Those of one thread: its own.
CHANGED = {
    "renderers/ray/gateway.py _written": "appended to by one thread, and read as a whole",
    "server/renders/store/fitting.py _adapters": "the same value under a key, whoever makes it",
    "system/background.py _deaths": "a lock",
    "system/garbage.py _pauses": "a lock",
    "system/garbage.py _was_enabled": "a lock",
    "system/cpu.py _steps": "set once, before there are threads",
    "system/shared_memory.py _blocks": "a lock for changes; listed by `copy`, which is one step of the interpreter",
    "worker/view/frames.py _baked": "of the renderer's thread",
    "worker/foreseen.py _compiling": "of a process with one thread",
}
# Classes for any thread that have no lock, and why they need none.
WITHOUT = {
    "AssetFolder": "a lock of the folder's, which other processes respect as well",
    "AssetStore": "its parts have locks; its own fields are set once",
    "Assets": "an interface",
    "Files": "an interface",
    "Members": "of one task",
    "Queued": "a queue.Queue",
    "Written": "a queue.Queue",
    "SceneBvh": "a tree with threads in another sense",
    **dict.fromkeys(("BatchRows", "RenderRows", "CallbackRows", "AssetAccess", "Documents"), "a transaction a call"),
    "Database": "a connection a call",
    "LostPictures": "the file system's own steps",
    "ParserPool": "its parts have locks",
    "ClientExecutor": "of the event loop; one thread works",
}
CHANGES = {"append", "add", "pop", "popitem", "clear", "update", "setdefault", "extend", "discard", "remove"}


@cache
def modules() -> list[tuple[str, ast.Module]]:
    paths = [path for path in sorted(SERVICE.rglob("*.py")) if "bench" not in path.parts]
    return [(str(path.relative_to(SERVICE)), ast.parse(path.read_text())) for path in paths]


def changed_in(tree: ast.Module) -> set[str]:
    """Names of a module that its functions assign to, or whose value they change."""
    names = set[str]()
    for each in tree.body:
        targets = each.targets if isinstance(each, ast.Assign) else [getattr(each, "target", None)]
        names |= {target.id for target in targets if isinstance(target, ast.Name)}
    changed = set[str]()
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            for node in ast.walk(function):
                if isinstance(node, ast.Global):
                    changed |= set(node.names)
                elif isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store | ast.Del):
                    changed.add(getattr(node.value, "id", ""))
                elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") in CHANGES:
                    changed.add(getattr(getattr(node.func, "value", None), "id", ""))
    return names & changed


def shared() -> dict[str, bool]:
    """The classes that are for several threads, as they say or by a lock; whether they have one."""
    found = dict[str, bool]()
    for _, tree in modules():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                made = [ast.unparse(call.func) for call in ast.walk(node) if isinstance(call, ast.Call)]
                locked = any(f"threading.{name}" in made for name in ("Lock", "RLock", "Condition"))
                if locked or "thread" in (ast.get_docstring(node) or "").lower():
                    found[node.name] = locked
    return found


def test_each_shared_container_has_a_lock_or_a_reason() -> None:
    assert {f"{path} {name}" for path, tree in modules() for name in changed_in(tree)} == CHANGED.keys()
    assert {name for name, locked in shared().items() if not locked} == WITHOUT.keys()


@contextmanager
def impatient() -> Iterator[None]:
    """Threads change as often as the interpreter can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


Hammer = tuple[Callable[[int], object], Callable[[], object]]  # a turn of a thread, and what holds after all of them


def _parsed_cache(folder: Path) -> Hammer:
    cache = ParsedCache(AssetLimits(cache_bytes=1000))
    made = MeasuredData.__new__(MeasuredData)
    object.__setattr__(made, "values", np.zeros(30))

    def turn(i: int) -> None:
        assert cache.load(str(i % 5), lambda: made, ahead=i % 2 == 0) is made
        cache.shrink(i % 300)
        assert 0 <= cache.bytes <= 1000

    return turn, lambda: not cache._pending


def _integrity(folder: Path) -> Hammer:
    files = AssetFolder(folder)
    ids = []
    for text in (b"a", b"b"):
        (folder / "x").write_bytes(text)
        with (folder / "x").open("rb") as file:
            ids.append(f"sha256:{digest(file)}")
        files.put(ids[-1], {"": text, ".json": b"{}"}, lasting=False)
    sound = Integrity(files)

    def turn(i: int) -> None:
        file = sound.open(ids[i % 2], again=i % 5 == 0)
        assert file is not None
        file.close()

    return turn, lambda: True


def _pack_cache(folder: Path) -> Hammer:
    budget = CacheBudget(4000)
    caches = [PackCache(3, budget) for _ in range(3)]

    def turn(i: int) -> None:
        cache = caches[i % 3]
        assert cache.get(i % 7, lambda: SimpleNamespace(value=np.zeros(i % 7 * 10))).value.size == i % 7 * 10
        cache.find(i % 5)
        budget.shrink(i % 100)
        PackCache(2, budget).gather(SimpleNamespace)

    return turn, lambda: all(c.bytes == sum(size for _, size in c._values.values()) for c in caches)


def _packed_scenes(folder: Path) -> Hammer:
    scenes = PackedScenes(1000)
    scene: Any = type("Scene", (), {"forget": lambda self: scenes.remove(self)})
    kept = [scene() for _ in range(20)]

    def turn(i: int) -> None:
        scenes.keep(kept[i % 20], i % 90)
        if i % 3 == 0:
            scenes.remove(kept[i % 7])
        scenes.shrink(i % 50)

    return turn, lambda: scenes.bytes == sum(scenes._scenes.values()) <= 1000


def _pictures(folder: Path) -> Hammer:
    files = PictureFiles(folder)
    restore = picture()

    def turn(i: int) -> None:
        id = f"{i % 4}"
        if i % 10 == 0:
            files.write(id, "picture", restore)
        elif i % 10 == 5:
            files.delete(id, "picture")
        assert files.size(id) >= 0 and files.usage.files >= 0

    return (
        turn,
        lambda: (
            files.usage == sum(files._sizes.values(), Usage())
            and (files.usage.files == sum(name.suffix == ".picture" for name in folder.iterdir()))
        ),
    )


def _room(folder: Path) -> Hammer:
    room, inside = FairRoom(100), [0]
    lock = threading.Lock()

    def turn(i: int) -> None:
        CALLER.set(f"caller {i % 2}")
        with room.taken(i % 90):
            with lock:
                inside[0] += i % 90
                assert inside[0] <= 100
            with lock:
                inside[0] -= i % 90

    return turn, lambda: room._left == 100 and not room._taken and not len(room._waiting)


def _quota(folder: Path) -> Hammer:
    @contextmanager
    def in_use() -> Iterator[set[str]]:
        yield set()

    quota = Quota(folder, Usage(10**6, 100), in_use)

    def turn(i: int) -> None:
        with quota.room(Usage(i % 100, 1)), quota.pinned([f"sha256:{i % 3}"]):
            quota.used()

    return turn, lambda: quota._pending == Usage() and not +quota._pinned


def _asset_shares(folder: Path) -> Hammer:
    @contextmanager
    def in_use() -> Iterator[set[str]]:
        yield set()

    shares = AssetShares(folder, Quota(folder, Usage(10**6, 100), in_use), 10**5)

    def turn(i: int) -> None:
        if i % 8 == 0:
            with shares.room(f"owner {i % 3}", Usage(10, 1)):
                shares.owned()

    return turn, lambda: not +shares._pending


def _children(folder: Path) -> Hammer:
    class Stand:
        """In place of a child that is there already."""

        is_spent, given, process, private_bytes = False, 0, SimpleNamespace(poll=lambda: None), lambda child: 0

        def __init__(self) -> None:
            self.mine = threading.Lock()

        def kill(self) -> None: ...

    children: Any = Children("none", 10**9)
    children._idle = [Stand() for _ in range(THREADS)]

    def turn(i: int) -> None:
        with children.one() as child:
            assert child.mine.acquire(blocking=False), "nobody else has it"
            child.mine.release()
        assert len(children.idle) <= THREADS

    return turn, lambda: len(set(map(id, children.idle))) == THREADS


def _budget(folder: Path) -> Hammer:
    budget = MemoryBudget(10**6)
    budget.cache("assets", lambda: 10, lambda size: None)

    def turn(i: int) -> None:
        with budget.reserved("scenes", i % 100):
            assert budget.used()["scenes"] >= i % 100
        budget.hold("bodies", type("Holder", (), {})(), 1)  # garbage from the next moment on
        budget.lacks(i)

    def clean() -> bool:
        gc.collect()
        return budget.used() == {"bodies": 0, "documents": 0, "scenes": 0, "pictures": 0, "assets": 10}

    return turn, clean


def _pool(folder: Path) -> Hammer:
    pool = Pool("hammered", 2, each=1)

    def turn(i: int) -> None:
        if i % 20 == 0:
            asyncio.run(several(i))

    async def several(i: int) -> None:
        async def one(j: int) -> int:
            return await pool(lambda: j, f"caller {j % 3}")

        assert await asyncio.gather(*map(one, range(i, i + 6))) == list(range(i, i + 6))

    def over() -> bool:
        wait_until(lambda: not pool._busy)  # its threads look for more work
        return not +pool._running

    return turn, over


def _garbage(folder: Path) -> Hammer:
    def turn(i: int) -> None:
        with garbage.collector_paused():
            assert not gc.isenabled()

    return turn, gc.isenabled


def _deaths(folder: Path) -> Hammer:
    before = background.deaths()["hammered"]
    return lambda i: count_death("hammered"), lambda: background.deaths()["hammered"] - before == THREADS * TURNS


def _blocks(folder: Path) -> Hammer:
    def turn(i: int) -> None:
        arena = shared_memory.SharedArena(shared_memory.LEAST)
        array = arena.put(np.zeros(8))
        found = shared_memory.locate(array.data)
        assert found is not None and found[1] == 0
        assert shared_memory.locate(memoryview(b"elsewhere")) is None

    return turn, lambda: gc.collect() >= 0 and len(os.listdir("/proc/self/fd")) < 500


TURNS = 200  # of each thread
HAMMERS: dict[str, Callable[[Path], Hammer]] = {
    "ParsedCache": _parsed_cache,
    "Integrity": _integrity,
    "CacheBudget": _pack_cache,
    "PackCache": _pack_cache,
    "PackedScenes": _packed_scenes,
    "PictureFiles": _pictures,
    "Quota": _quota,
    "AssetShares": _asset_shares,
    "Children": _children,
    "MemoryBudget": _budget,
    "FairRoom": _room,
    "Pool": _pool,
    "system/garbage.py": _garbage,
    "system/background.py": _deaths,
    "system/shared_memory.py": _blocks,
}
ELSEWHERE = {
    "Sandbox": "a process for each file: tests/service/formats tests its turns",
    "Animator": "one thread writes and one stops it: tests/service/test_contact_sheet.py",
}


@pytest.mark.parametrize("make", dict.fromkeys(HAMMERS.values()), ids=lambda make: make.__name__[1:])
def test_eight_threads_find_no_hole(make: Callable[[Path], Hammer], tmp_path: Path) -> None:
    turn, holds = make(tmp_path)
    start = threading.Barrier(THREADS)

    def hammer(number: int) -> None:
        start.wait()
        for i in range(TURNS):
            turn(number + i)

    with impatient(), ThreadPoolExecutor(THREADS) as threads:
        for done in [threads.submit(hammer, number) for number in range(THREADS)]:
            done.result()
    assert holds()


def test_each_lock_is_hammered() -> None:
    locked = {name for name, has in shared().items() if has}
    modules_changed = {path.split()[0] for path, why in CHANGED.items() if why not in ("of the event loop",)}
    assert locked == {name for name in HAMMERS if "/" not in name} | ELSEWHERE.keys()
    assert {name for name in HAMMERS if "/" in name} <= modules_changed
