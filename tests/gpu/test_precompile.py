"""Kernels that nobody has compiled yet: whoever needs one waits for it, and nobody else does."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import KernelKey, Renderer, RenderSettings, SceneEdit
from gpu.kernels import features
from gpu.precompile.kernel_keys import common_keys, kernel_key
from service.ipc.messages import Done, Image, Loaded, Read, StopRule, Update, View
from service.renderers.local.supervisor import Supervisor
from service.worker.device.loaded_scene import LoadedScene, edited_scene, kernel_request
from service.worker.helpers.compile_client import SPARE_AFTER_S, CompileClient, Priority, records
from service.worker.helpers.compile_lane import Compiled
from service.worker.helpers.compile_main import LOCKS
from tests.serving import PATIENCE_S, wait_until
from tests.supervisors import LINEAR, SCENES, SIZE, Ears, compile_helpers, with_supervisor

pytestmark = pytest.mark.exact

COLD = {**SIZE, "clamp": 5.0}  # compiled in

AHEAD = """
import sys
from gpu.kernels import features
from gpu.precompile.kernel_keys import ENTRY, GUIDES, common_keys, kernel_key
from gpu.precompile.precompiler import Precompiler
from tests.supervisors import SETTINGS, arrays_of
a, settings = arrays_of(sys.argv[1]), SETTINGS[sys.argv[1]]
precompiler = Precompiler()
keys = [kernel_key(a, settings, features.flags(a), entry) for entry in (ENTRY, GUIDES)]
print(all([precompiler.compile(each)[1] for each in [*keys, *common_keys()]]))
"""
RENDERER = """
import sys
from gpu import Renderer
from tests.supervisors import SETTINGS, arrays_of
with Renderer() as renderer:
    picture = renderer.picture(renderer.load(arrays_of(sys.argv[1])), SETTINGS[sys.argv[1]])
    picture.trace(9.0, 10)
    picture.read("normal")
    picture.noise()
    picture.display()
    picture.display(tone_map="agx", dtype="f4")
"""


async def beside(
    supervisor: Supervisor, arrays: Any, kill: bool = False, newer: bool = False
) -> tuple[int, np.ndarray]:
    """How often somebody else's picture had grown before a cold kernel was there; and what that one made."""
    ears, other = Ears(), Ears()
    busy, late = supervisor.open(other), supervisor.open(ears)
    await supervisor.send_scene(Update(busy, 1, arrays, SIZE, StopRule()))
    await other.next_of(busy, Loaded)
    await supervisor.send_scene(Update(late, 1, arrays, COLD, StopRule(4)))
    loaded = asyncio.create_task(ears.next_of(late, Loaded))
    seen: list[int] = []
    while not loaded.done():
        supervisor.send(Read(busy, len(seen), LINEAR))
        seen.append((await other.next_of(busy, Image)).progress.samples)
        await asyncio.sleep(0)
        if newer and len(seen) == 3:
            supervisor.send(Update(late, 2, stop=StopRule(6), base=1))
        if kill:
            for helper in compile_helpers(supervisor.process_id):
                os.kill(helper, signal.SIGKILL)
                kill = False
    assert not kill
    assert (await loaded).generation == 1 + newer and not supervisor.statistics.restarts
    assert (await ears.next_of(late, Done)).reason == "max_samples"
    supervisor.send(Read(late, 1, LINEAR))
    pixels = np.array((await ears.next_of(late, Image)).pixels)
    supervisor.drop(busy)
    supervisor.drop(late)
    return len(set(seen)), pixels


def in_the_loop(gpu: Renderer, arrays: Any, samples: int = 4) -> np.ndarray:
    scene = gpu.load(arrays)
    picture = gpu.picture(scene, RenderSettings(32, 32, clamp=5.0))
    picture.trace(60.0, samples)
    pixels = picture.read()
    picture.release()
    scene.release()
    return pixels


def test_others_are_traced_meanwhile(gpu: Renderer, arrays: Any, cold: Path) -> None:
    async def test(supervisor: Supervisor) -> None:
        grown, pixels = await beside(supervisor, arrays, newer=True)
        assert grown >= 5
        assert np.array_equal(pixels, in_the_loop(gpu, arrays, samples=6))
        assert len(compile_helpers(supervisor.process_id)) == 1

    with_supervisor(test)

    async def again(supervisor: Supervisor) -> None:
        await beside(supervisor, arrays)
        assert compile_helpers(supervisor.process_id) == []  # what is in the disk cache needs none

    with_supervisor(again)


def test_others_are_traced_while_a_first_normal_is_compiled_for(gpu: Renderer, arrays: Any, cold: Path) -> None:
    async def test(supervisor: Supervisor) -> None:
        ears, other = Ears(), Ears()
        busy, late = supervisor.open(other), supervisor.open(ears)
        for task, hears, stop in ((busy, other, StopRule()), (late, ears, StopRule(2))):
            await supervisor.send_scene(Update(task, 1, arrays, SIZE, stop))
            await hears.next_of(task, Loaded)
        await ears.next_of(late, Done)
        before = compile_helpers(supervisor.process_id)
        supervisor.send(Read(late, 1, View("normal", encoding="linear")))
        normal = asyncio.create_task(ears.next_of(late, Image))
        seen: list[int] = []
        while not normal.done():
            supervisor.send(Read(busy, len(seen), LINEAR))
            seen.append((await other.next_of(busy, Image)).progress.samples)
            await asyncio.sleep(0)
        assert seen[-1] > seen[0] and len(before) <= len(compile_helpers(supervisor.process_id)) == 1
        pixels = (await normal).pixels
        scene = gpu.load(arrays)
        picture = gpu.picture(scene, RenderSettings(**SIZE))
        picture.trace(60.0, 2)
        assert np.array_equal(pixels, picture.read("normal"))
        picture.release()
        scene.release()

    with_supervisor(test)


def test_who_is_woken_has_its_kernel(gpu: Renderer, arrays: Any) -> None:
    """What a slider raised while it was moved stays raised: no other kernel, and no other bits."""
    loaded = LoadedScene(gpu, arrays, RenderSettings(32, 32), True, frozenset())
    rough = np.array(arrays.materials)
    glowing = rough.copy()
    glowing["emission"] = 1.0
    for materials in (glowing, rough):
        loaded.scene.edit(replace(loaded.arrays, materials=materials))
    loaded.ladder.reset()
    loaded.ladder.full.trace(60.0, 3)
    flags = loaded.scene.flags
    assert flags > features.flags(arrays, editing=True)
    offloaded = loaded.offloaded()
    edit = Update(1, 2, edit=SceneEdit(materials=rough), base=1)
    wanted = kernel_request(edit, offloaded.settings, edited_scene(edit, offloaded), loaded=False)
    back = LoadedScene.back(gpu, offloaded)
    assert back.scene.flags == flags and back.ladder.full.samples == 3
    assert back.ladder.full.compile_ms == 0  # it is still there
    assert wanted is not None and dict(wanted.key.defines) == back.scene.defines(offloaded.settings)
    back.release()


def test_a_kernel_whose_compiler_is_killed_is_begun_again(gpu: Renderer, arrays: Any, cold: Path) -> None:
    async def test(supervisor: Supervisor) -> None:
        _, pixels = await beside(supervisor, arrays, kill=True)
        assert np.array_equal(pixels, in_the_loop(gpu, arrays))

    with_supervisor(test)


def test_without_a_cache_nobody_is_asked(
    gpu: Renderer, arrays: Any, cold: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MESA_SHADER_CACHE_DISABLE", "true")

    async def test(supervisor: Supervisor) -> None:
        _, pixels = await beside(supervisor, arrays)
        assert compile_helpers(supervisor.process_id) == [] and np.array_equal(pixels, in_the_loop(gpu, arrays))

    with_supervisor(test)


class Instant:
    """In the place of the helper's process."""

    process_id = None

    def __init__(self) -> None:
        self.asked: list[KernelKey] = []
        self.answers = 0

    def ask(self, key: KernelKey) -> None:
        self.asked.append(key)

    def hear(self) -> Compiled:
        if self.answers == len(self.asked):
            raise BlockingIOError
        self.answers += 1
        return Compiled(5.0, cached=True)

    def pause(self, is_paused: bool) -> None: ...


def compiling_instantly(gpu: Renderer, priority: Priority) -> tuple[CompileClient, Instant]:
    compiler, helper = CompileClient(gpu.info, None), Instant()
    compiler._lanes[priority][0].helper = helper  # type: ignore[assignment]
    return compiler, helper


def test_what_any_scene_needs_is_prepared_once(gpu: Renderer, cold: Path) -> None:
    """What pictures are shown with, what the noise meter and `adaptive` ask, and what makes a driver let go."""
    asked = []
    for _ in range(2):
        compiler, helper = compiling_instantly(gpu, "soon")
        compiler.prepare(common_keys(), "soon")
        while compiler.left_s is not None:
            compiler.hear()
        assert all(compiler.on_disk(key) for key in common_keys())
        asked.append(helper.asked)
    assert asked == [common_keys(), []] and len(common_keys()) == 26


def test_what_may_be_needed_some_time_waits_for_the_first_minute(gpu: Renderer, cold: Path) -> None:
    compiler, helper = compiling_instantly(gpu, "spare")
    compiler.prepare(common_keys()[:1], "spare")
    compiler.hear()
    assert helper.asked == [] and not compiler.is_idle("spare")
    assert compiler.left_s == pytest.approx(SPARE_AFTER_S, abs=15)
    compiler._lanes["spare"][0].begins = 0.0
    compiler.hear()
    assert helper.asked == common_keys()[:1]


def test_what_a_newer_scene_needs_takes_the_place_of_the_older_one_s(gpu: Renderer, cold: Path) -> None:
    """But for the kernel that is being compiled."""
    compiler, helper = compiling_instantly(gpu, "soon")
    keys = common_keys()
    streams: list[Any] = [lambda milliseconds: None, lambda milliseconds: 0]
    compiler.prepare(keys[:3], "soon", done=streams[0])
    compiler.prepare(keys[3:5], "soon", done=streams[1])
    compiler.prepare(keys[2:3] + keys[6:8], "soon", done=streams[0])
    while compiler.left_s is not None:
        compiler.hear()
    assert sorted(map(keys.index, helper.asked)) == [0, 2, 3, 4, 6, 7]


def test_what_somebody_waits_for_stands_behind_nothing_foreseen(gpu: Renderer, cold: Path) -> None:
    compiler, urgent = compiling_instantly(gpu, "now")
    foreseen: dict[Priority, Instant] = {"soon": Instant(), "spare": Instant()}
    for priority, helper in foreseen.items():
        compiler._lanes[priority][0].helper = helper  # type: ignore[assignment]
    compiler._lanes["spare"][0].begins = 0.0
    keys, ended = common_keys(), list[float]()
    compiler.prepare(keys[:3], "spare")
    compiler.prepare(keys[3:5], "soon")
    assert compiler.queue(keys[2], ended.append) and urgent.asked == [keys[2]]
    while compiler.left_s is not None:
        compiler.hear()
    assert ended == [5.0] and not compiler.queue(keys[4], ended.append), "it was foreseen"
    compiler.prepare(keys[:5], "spare")
    assert foreseen["spare"].asked == keys[:3] and compiler.is_idle("spare")


def test_clients_take_turns_at_the_compiler(gpu: Renderer, cold: Path) -> None:
    compiler, helper = compiling_instantly(gpu, "now")
    keys = list(common_keys()[:7])
    of = dict(zip(keys, ["flood"] * 5 + ["other"] * 2, strict=True))
    for key, client in of.items():
        assert compiler.queue(key, lambda ms, key=key: None, client=client)  # type: ignore[misc]
    while compiler.left_s is not None:
        compiler.hear()
    assert [of[key] for key in helper.asked] == ["flood", "other", "flood", "other", "flood", "flood", "flood"]


@pytest.mark.parametrize("name", SCENES)
def test_the_renderer_finds_all_of_it(gpu: Renderer, cold: Path, name: str) -> None:
    def run(program: str) -> str:
        done = subprocess.run([sys.executable, "-c", program, name], capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def files() -> int:
        return sum(path.is_file() for path in cold.rglob("*"))

    if not gpu.info["software"]:
        pytest.skip("other drivers keep their caches elsewhere")
    assert run(AHEAD) == "True"
    before = files()
    run(RENDERER)
    assert files() == before > 0


def test_a_kernel_outlives_the_renderer_that_wanted_it(gpu: Renderer, arrays: Any, cold: Path) -> None:
    """Else a machine so slow that renderers are killed before a kernel is there would never have it."""
    wanted = kernel_key(arrays, RenderSettings(**COLD), features.flags(arrays))
    record = records() / wanted.digest(f"{gpu.info['renderer']} {gpu.info['version']}")

    async def test(supervisor: Supervisor) -> None:
        late, helper = await compiled_for(supervisor, arrays)
        pid = supervisor.process_id
        assert pid is not None
        while not record.with_suffix(LOCKS["now"]).exists():  # it was told what to compile
            await asyncio.sleep(0.01)
        supervisor.drop(late)
        os.kill(pid, signal.SIGKILL)
        assert not record.exists()  # it has hardly begun
        while supervisor.process_id in (pid, None):
            await asyncio.sleep(0.01)
        while is_there(helper):  # until it is done
            await asyncio.sleep(0.02)
        assert record.exists()

    with_supervisor(test)


def test_a_kernel_under_way_ends_with_the_server(gpu: Renderer, arrays: Any, cold: Path) -> None:
    left: list[int] = []

    async def test(supervisor: Supervisor) -> None:
        left.append((await compiled_for(supervisor, arrays))[1])

    with_supervisor(test)
    wait_until(lambda: not is_there(left[0]))


async def compiled_for(supervisor: Supervisor, arrays: Any) -> tuple[int, int]:
    """A task whose kernel is being compiled while another's picture is traced, and the process that does that."""
    other = Ears()
    busy, late = supervisor.open(other), supervisor.open(Ears())
    await supervisor.send_scene(Update(busy, 1, arrays, SIZE, StopRule()))
    await other.next_of(busy, Loaded)
    await supervisor.send_scene(Update(late, 1, arrays, COLD, StopRule(4)))
    while not (begun := compile_helpers(supervisor.process_id)):
        await asyncio.sleep(0.01)
    return late, begun[0]


def is_there(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def test_the_other_end_of_a_pipe_is_a_lifeline() -> None:
    """Of two that share it, in the middle of a loop that never looks."""
    read, write = os.pipe()
    program = "import sys\nfrom service.system.lifeline import end_with_pipe\n"
    program += "print(end_with_pipe(int(sys.argv[1])), flush=True)\nwhile True: pass"
    command = [sys.executable, "-c", program, str(read)]
    both = [subprocess.Popen(command, pass_fds=[read], stdout=subprocess.PIPE, text=True) for _ in range(2)]
    for each in both:
        assert each.stdout is not None and each.stdout.readline() == "True\n"
    os.close(write)
    assert [each.wait(PATIENCE_S) for each in both] == [-signal.SIGIO] * 2
    late = subprocess.Popen(command, pass_fds=[read], stdout=subprocess.PIPE, text=True)
    assert late.stdout is not None and late.stdout.readline() == "False\n"
    late.kill()
    for each in (*both, late):
        each.communicate()
    os.close(read)
