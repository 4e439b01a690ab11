"""First looks by a process whose kernels are not optimised, while the kernel of the picture is compiled."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.precompile.kernel_keys import common_keys
from service.bench.scenes import BenchAssets
from service.document import parse_scene, presets
from service.ipc import channel
from service.ipc.messages import Done, Frame, Loaded, Progress, StopRule, Update, View, Want
from service.pack import pack
from service.renderers.local.supervisor import Supervisor
from service.worker.device.loaded_scene import KernelRequest
from service.worker.helpers import first_look_client
from service.worker.helpers.compile_client import CompileClient
from service.worker.helpers.compile_lane import Compiled
from service.worker.helpers.first_look_client import TRIES, FirstLookClient, Leave, Look, Wanted
from service.worker.view.first_look import UnoptimisedLook
from tests.supervisors import LINEAR, Ears, Rendering, arrays_of, settings, with_supervisor

SIDE = 64
WANT = Want(1, 7, View())


class Helper:
    """In the place of a process: what it was asked, and what it is to answer."""

    process_id: int | None = None
    ends = ("one",)

    def __init__(self) -> None:
        self.asked: list[Any] = []
        self.answers = deque[Any]()
        self.starts = self.closed = 0
        self.paused = False

    def start(self) -> None:
        self.starts += 1

    def ask(self, message: object) -> None:
        self.asked.append(message)

    def hear(self) -> Any:
        if not self.answers:
            raise BlockingIOError
        answer = self.answers.popleft()
        if isinstance(answer, Exception):
            raise answer
        return answer

    def pause(self, is_paused: bool) -> None:
        self.paused = is_paused

    def close(self) -> int:
        self.closed += 1
        return -9


def client_of(helper: Helper) -> FirstLookClient:
    client = FirstLookClient(None, 1 << 30)
    client._helper = helper  # type: ignore[assignment]
    return client


def request() -> KernelRequest:
    return KernelRequest(arrays_of("plain"), RenderSettings(SIDE, SIDE), None)  # type: ignore[arg-type]


def frame(generation: int, serial: int = 7, scale: float = 0.25) -> Frame:
    progress = Progress(1, None, 0.1)
    return Frame(1, serial, generation, np.zeros((1, 1, 4)), progress, scale, last=False, provisional=True)


def test_a_look_asks_once_for_a_frame_and_sends_what_comes() -> None:
    helper, sent = Helper(), list[Any]()
    client = client_of(helper)
    look = UnoptimisedLook(1, sent.append, client)
    assert look.can(request()) and not look.shows and not look.bytes
    look.begin(request(), 3)
    assert not look.answer(WANT) and not look.answer(WANT) and look.bytes > 0
    assert [type(message) for message in helper.asked] == [Look, Wanted]
    helper.answers += [frame(2), frame(3)]
    client.hear()
    assert look.answer(WANT) and [each.generation for each in sent] == [3], "of another generation comes nothing"
    assert look.shown(3) == 0.25 and not look.shown(2)
    look.release()
    assert isinstance(helper.asked[-1], Leave) and not look.answer(WANT) and not look.bytes


@pytest.mark.parametrize("given", [{"estimator": "light"}, {"sampler": "independent"}, {"width": 16}])
def test_what_is_not_shown(given: Any) -> None:
    size = {"width": SIDE, "height": SIDE}
    other = KernelRequest(arrays_of("plain"), RenderSettings(**{**size, **given}), None)  # type: ignore[arg-type]
    assert not UnoptimisedLook(1, print, client_of(Helper())).can(other)
    assert not UnoptimisedLook(1, print, None).can(request()), "on a GPU there is no such process"


def test_a_process_that_ends_at_its_work_is_tried_again_some_times() -> None:
    helper = Helper()
    client = client_of(helper)
    for left in reversed(range(TRIES)):
        assert client.able
        client.begin(Look(1, 1, None, None), print)  # type: ignore[arg-type]
        helper.answers.append(channel.Closed())
        client.hear()
        assert client.able == (left > 0)
    asked = len(helper.asked)
    client.begin(Look(1, 2, None, None), print)  # type: ignore[arg-type]
    client.start()
    assert len(helper.asked) == asked and not helper.starts and not UnoptimisedLook(1, print, client).can(request())


def test_one_that_ends_because_it_is_idle_is_no_failure() -> None:
    helper = Helper()
    client = client_of(helper)
    for _ in range(TRIES + 1):
        client.begin(Look(1, 1, None, None), print)  # type: ignore[arg-type]
        client.leave(1)
        helper.answers.append(channel.Closed())
        client.hear()
    assert client.able


def test_its_environment_keeps_the_words_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GALLIVM_PERF", "no_rho_approx")
    assert FirstLookClient(None, 1)._helper._environment == {"GALLIVM_PERF": "no_rho_approx,nopt"}
    monkeypatch.delenv("GALLIVM_PERF")
    assert FirstLookClient(None, 1)._helper._environment == {"GALLIVM_PERF": first_look_client.UNOPTIMISED}


def test_what_nobody_waits_for_stands_still_while_somebody_does(
    gpu: Renderer, monkeypatch: Any, tmp_path: Any
) -> None:
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    compiler, helpers = CompileClient(gpu.info, None), {}
    for priority, (lane,) in compiler._lanes.items():
        helpers[priority] = helper = Helper()
        lane.helper, lane.begins = helper, 0.0  # type: ignore[assignment]
    first, second, third, fourth = common_keys()[:4]
    compiler.prepare([first], "soon")
    assert helpers["soon"].asked == [first] and not helpers["soon"].paused
    assert compiler.queue(second, lambda milliseconds: None)
    assert helpers["soon"].paused, "the one under way"
    compiler.prepare([third], "spare")
    assert helpers["spare"].asked == [] and compiler._lanes["spare"][0].left_s is None, "and none is begun"
    helpers["now"].answers.append(Compiled(1.0, True))
    compiler.hear()
    assert not helpers["soon"].paused and helpers["spare"].asked == [third]
    assert fourth not in helpers["now"].asked


def test_a_scene_without_a_kernel_is_shown_before_it_is_there(
    rendering: Rendering, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """... and ends with the bits that it has where nothing was shown before.

    The process starts with the scene before; for the second one LLVM takes two seconds."""
    size = settings(SIDE, max_bounces=2)
    heavy = pack(parse_scene(presets.get("scenes", "shader-ball")), BenchAssets()).arrays
    pictures: list[np.ndarray] = []
    kinds: list[list[str]] = []

    async def test(supervisor: Supervisor) -> None:
        ears = Ears()
        task = supervisor.open(ears)
        await supervisor.send_scene(Update(task, 1, arrays_of("plain"), size, StopRule(8), interactive=True))
        await ears.next_of(task, Done)
        await supervisor.send_scene(Update(task, 2, heavy, size, StopRule(8), interactive=True))
        serial, told = 0, list[str]()
        supervisor.send(Want(task, serial, LINEAR))
        while True:
            message = await ears.next_of(task, Frame, Loaded)
            told.append("look" if getattr(message, "provisional", False) else type(message).__name__)
            if isinstance(message, Frame):
                if message.last:
                    break
                assert np.isfinite(message.pixels).all() and message.pixels[..., :3].max() > 0
                serial += 1
                supervisor.send(Want(task, serial, LINEAR))
        kinds.append(told)
        pictures.append(message.pixels)
        await ears.next_of(task, Done)

    rendering(test)  # which compiles nothing but the kernel itself
    monkeypatch.setenv("MESA_SHADER_CACHE_DIR", str(tmp_path))
    with_supervisor(test, ahead="some")
    assert "look" not in kinds[0]
    looks = kinds[1].index("Loaded")
    assert looks > 0 and set(kinds[1][:looks]) == {"look"} and "look" not in kinds[1][looks:]
    assert (pictures[0] == pictures[1]).all()
