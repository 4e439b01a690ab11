"""Whatever needs a kernel that is not there waits for a process that compiles it, and everybody else is served."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import KernelKey, Renderer, RenderSettings, Steps
from gpu.bsdf import kernels as bsdf
from gpu.kernels.binaries import ENTRIES
from gpu.kernels.cache import KernelCache
from gpu.kernels.source import KernelSource
from gpu.precompile.kernel_keys import flags, kernel_key
from service.document import DiffuseMaterial, parse_scene
from service.ipc import channel, heartbeat
from service.ipc.leases import Assist
from service.ipc.messages import (
    Done,
    EvaluateBsdf,
    Failed,
    Progress,
    Read,
    Restore,
    StopRule,
    ToRenderer,
    Update,
    View,
    Want,
    driver_of,
)
from service.ipc.task_control import ApplyNow, Drop
from service.pack import pack, pack_material
from service.worker.helpers.compile_client import records
from service.worker.helpers.compile_lane import Compiled
from service.worker.loop import Loop
from service.worker.payloads import sent_picture
from tests.documents import Shelf
from tests.serving import SCENE
from tests.supervisors import SIZE, arrays_of

COSTLY = ENTRIES | set(bsdf.ENTRIES.values())
FIRST, OTHER = 1, 2  # tasks
GREY, UP = pack_material(DiffuseMaterial(type="diffuse", albedo=0.5)), np.array([[0.0, 0.0, 1.0]])
ROUNDS = 2000  # of a loop, in which whatever can be done is done
GLASS = {
    **SCENE,
    "materials": {**SCENE["materials"], "ball": {"type": "principled", "transmission": 1.0, "roughness": 0.0}},
}


class Program:
    """In the place of a costly kernel: it traces nothing."""

    def run(self, *groups: int) -> None:
        pass

    def release(self) -> None:
        pass


class Compiler:
    """In the place of a process that compiles: it answers when it is told to."""

    process_id, ends = None, ()

    def __init__(self) -> None:
        self.asked: list[KernelKey] = []
        self.compiled: list[KernelKey] = []
        self._answers: list[Compiled] = []

    def answer(self, detail: str = "") -> None:
        """Have what it was asked last."""
        self.compiled.append(self.asked.pop())
        self._answers.append(Compiled(1.0, cached=True, detail=detail))

    def ask(self, key: KernelKey) -> None:
        self.asked.append(key)

    def hear(self) -> Compiled:
        if not self._answers:
            raise BlockingIOError
        return self._answers.pop()

    def close(self) -> int:
        return 0


class Looping:
    """A renderer's loop in this process, which the test turns, and the server's end of it."""

    def __init__(self, renderer: Renderer) -> None:
        self.renderer, self.compiler = renderer, Compiler()
        self._end, its = channel.pair()
        memory = heartbeat.memory()
        self._loop = Loop(its, renderer, heartbeat.Heartbeat(memory), 1 << 30, None, 1.0, ahead="off")
        os.close(memory)
        self._loop._compiler._lanes["now"][0].helper = self.compiler  # type: ignore[assignment]
        self._heard: list[Any] = []

    def send(self, *messages: ToRenderer) -> None:
        for message in messages:
            channel.send(self._end, message)

    def rest(self) -> list[KernelKey]:
        """Turn the loop until there is nothing to do; which kernels it waits for."""
        for _ in range(ROUNDS):
            if not self._turn():
                return self.compiler.asked[:]
        raise AssertionError("it does not come to rest")

    def next(self, task: int, *kinds: type) -> Any:
        """Turn the loop until that task says something of these kinds: what it says."""
        for _ in range(ROUNDS):
            self._turn()
            for at, each in enumerate(self._heard):
                if isinstance(each, kinds) and each.task == task:
                    return self._heard.pop(at)
        raise AssertionError(f"it says nothing of that: {self._heard}")

    def _turn(self) -> bool:
        busy = self._loop.step(wait=False)
        with suppress(BlockingIOError):
            while True:
                self._heard.append(channel.receive(self._end))
        return busy

    def close(self) -> None:
        for task in (FIRST, OTHER):
            self._loop.handlers[Drop](Drop(task))
        self._end.close()


@pytest.fixture(scope="module")
def bare(gpu: Renderer) -> Iterator[Renderer]:
    """A renderer of its own: its kernels that trace are none, and no other test may find them."""
    with Renderer() as renderer:
        yield renderer


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The texts of the costly kernels that the renderer makes itself."""
    texts: list[str] = []
    compile_ = KernelCache._compile

    def counted(self: KernelCache, entry: str, defines: Mapping[str, object]) -> Any:
        if entry not in COSTLY:
            return compile_(self, entry, defines)
        texts.append(KernelSource(entry, defines).text)
        return Program()

    monkeypatch.setattr(KernelCache, "_compile", counted)
    return texts


@pytest.fixture
def loop(bare: Renderer, compiled: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Looping]:
    """No kernel is recorded, and none is in the renderer's memory."""
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    bare._kernels.release()
    looping = Looping(bare)
    yield looping
    looping.close()


def update(task: int, generation: int = 1, document: Any = SCENE, samples: int = 2, **settings: Any) -> Update:
    arrays = pack(parse_scene(document), Shelf()).arrays
    return Update(task, generation, arrays, {**SIZE, **settings}, StopRule(samples))


def restored(renderer: Renderer) -> Restore:
    """A picture of the scene without samples."""
    scene = renderer.load(arrays_of("plain"))
    picture = renderer.picture(scene, RenderSettings(**SIZE))
    saved = sent_picture(Steps(picture.save()).finish(), driver_of(renderer.info))
    picture.release()
    scene.release()
    return Restore(FIRST, 1, saved, None, Progress(0, None, 0.0, None))


# What is sent together, and then what is sent when that has its kernels; and the kernels that all of it needs.
ROUTES: dict[str, tuple[list[list[Any]], set[str]]] = {
    "a scene": ([[update(FIRST)]], {"pathtrace.comp"}),
    "a stream": (
        [
            [
                Update(FIRST, 1, arrays_of("plain"), SIZE, StopRule(4096), interactive=True),
                Want(FIRST, 1, View(prior=True)),
            ]
        ],
        {"pathtrace.comp", "guides.comp"},
    ),
    "paths of light": ([[update(FIRST, document=GLASS, caustics="light")]], {"pathtrace.comp", "lighttrace.comp"}),
    "other settings": ([[update(FIRST)], [update(FIRST, 2, clamp=5.0)]], {"pathtrace.comp"}),
    "states one by one": ([[update(FIRST), ApplyNow(FIRST), update(FIRST, 2, clamp=5.0)]], {"pathtrace.comp"}),
    "a saved picture": ([[update(FIRST), restored]], {"pathtrace.comp"}),
    "first hits": ([[update(FIRST)], [Read(FIRST, 1, View("normal"))]], {"pathtrace.comp", "guides.comp"}),
    "coverage": ([[update(FIRST)], [Read(FIRST, 1, View("shape_coverage"))]], {"pathtrace.comp", "cover.comp"}),
    "part of another's picture": ([[Assist(FIRST), update(FIRST)]], {"pathtrace.comp"}),
    "values of a BSDF": ([[EvaluateBsdf(FIRST, "values", GREY, UP, UP)]], {"bsdf_values.comp"}),
    "a BSDF's terms": ([[EvaluateBsdf(FIRST, "terms", GREY, UP, UP)]], {"bsdf_terms.comp"}),
    "albedo": ([[EvaluateBsdf(FIRST, "albedo", GREY, UP, UP[:0], samples=1)]], {"bsdf_albedo.comp"}),
}


def test_every_costly_kernel_has_a_route_to_it() -> None:
    assert set.union(*(entries for _, entries in ROUTES.values())) == COSTLY


@pytest.mark.parametrize("route", ROUTES)
def test_others_are_served_while_a_kernel_is_compiled(route: str, loop: Looping, compiled: list[str]) -> None:
    """Nobody else is there when it is asked for. The renderer makes only kernels that a process has compiled."""
    stages, entries = ROUTES[route]
    known = kernel_key(arrays_of("plain"), RenderSettings(**SIZE, sampler="independent"), flags(arrays_of("plain")))
    records().mkdir(parents=True)
    (records() / known.digest(driver_of(loop.renderer.info))).touch()
    messages = [[each(loop.renderer) if callable(each) else each for each in stage] for stage in stages]
    loop.renderer._kernels.release()
    compiled.clear()
    for number, stage in enumerate(messages):
        loop.send(*stage)
        asked = loop.rest()
        assert asked and not set(compiled) & {key.text for key in asked}
        loop.send(update(OTHER, 1 + number, sampler="independent"))
        assert loop.next(OTHER, Done).generation == 1 + number
        while asked:
            loop.compiler.answer()
            asked = loop.rest()
    made = {key.text: key.entry for key in loop.compiler.compiled}
    assert known.text in compiled and set(compiled) <= made.keys() | {known.text}
    assert set(made.values()) == entries


def test_who_waits_for_a_kernel_that_cannot_be_is_told_so_once(loop: Looping, compiled: list[str]) -> None:
    """The renderer does not try it, and for some minutes nobody does."""
    for task in (FIRST, OTHER):
        loop.send(update(task))
        if task == FIRST:
            assert len(loop.rest()) == 1
            loop.compiler.answer(detail="it takes more than 300 s")
        said = loop.next(task, Failed)
        assert said.detail == "the scene's kernel could not be compiled: it takes more than 300 s"
        assert not said.refused and loop.rest() == [] == compiled
