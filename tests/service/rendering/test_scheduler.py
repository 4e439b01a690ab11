"""Whose turn it is in the renderer's process, and how long a pass may be then."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from gpu import Renderer, SceneEdit
from gpu.picture.tiles import LEAST_A_PASS
from service.document import parse_scene
from service.ipc.messages import StopRule, Update
from service.pack import pack
from service.worker.context import WorkerContext
from service.worker.helpers.denoise_client import DenoiseClient
from service.worker.scheduler import (
    CATCH_UP_S,
    FIRST_FRAME_LEAD_S,
    LATE_S,
    MOST_OWED_S,
    Account,
    Scheduler,
)
from service.worker.task import HOLD_S, Task
from tests.documents import Shelf
from tests.serving import SCENE


@dataclass(eq=False)
class Turn:
    ready: bool = True
    unseen: bool = False
    wanted: bool = False
    account: Account = field(default_factory=Account)
    client: str = ""

    def __post_init__(self) -> None:
        self.client = self.client or str(id(self))


def turns(tasks: list[Turn], count: int, slice_s: float = 0.02) -> list[int]:
    """How often each had its turn."""
    scheduler, had = Scheduler(), [0] * len(tasks)
    for _ in range(count):
        task = scheduler.choose(tasks)
        assert task is not None
        scheduler.charge(task, slice_s)
        had[tasks.index(task)] += 1
    return had


def test_everyone_gets_the_same_time() -> None:
    assert turns([Turn(), Turn(), Turn()], 300) == [100, 100, 100]
    assert turns([Turn(), Turn(ready=False)], 10) == [10, 0]
    assert Scheduler().choose([Turn(ready=False)]) is None


def test_sharers_are_those_who_are_ready() -> None:
    scheduler, mine, other = Scheduler(), [Turn(client="mine") for _ in range(3)], [Turn(client="other")]
    assert scheduler.sharers("mine") == 1
    scheduler.choose(mine + other)
    assert scheduler.sharers("mine") == 6  # a half, in three
    assert scheduler.sharers("other") == 2
    other[0].ready = False
    scheduler.choose(mine[:1] + other)
    assert scheduler.sharers("mine") == 1


def test_a_stream_among_many_takes_passes_of_one_sample(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the next picture of each comes soon; nobody waits for the next pass of a render."""
    monkeypatch.setattr("service.worker.task_picture.SLICE_S", 0.0)  # a tile a turn
    context = WorkerContext(gpu, lambda _: None, DenoiseClient(), sharers=lambda client: 10**6)
    arrays = pack(parse_scene(SCENE), Shelf()).arrays
    passes = {}
    for interactive in (True, False):
        task = Task(context, 1)
        task.update(Update(1, 1, arrays, {"width": 32, "height": 32}, StopRule(24), interactive=interactive))
        passes[interactive] = {0}
        while task.ready:
            task.turn()
            passes[interactive].add(task.picture.residency.full.under_way[0])
        task.release()
    assert passes[True] == {0, 1} and max(passes[False]) >= LEAST_A_PASS


def test_a_hold_ends_with_an_update(gpu: Renderer) -> None:
    context = WorkerContext(gpu, lambda _: None, DenoiseClient())
    arrays = pack(parse_scene(SCENE), Shelf()).arrays
    task = Task(context, 1)
    task.update(Update(1, 1, arrays, {"width": 32, "height": 32}, StopRule(1 << 20), interactive=True))
    while task.unseen:
        task.turn()
    assert task.ready and task.left_s is None
    task.hold()
    assert not task.ready and task.left_s is not None and 0 < task.left_s <= HOLD_S
    task.update(Update(1, 2, edit=SceneEdit(camera=arrays.camera), base=1))
    assert task.ready and task.left_s is None
    task.turn()
    assert task.ready
    task.release()


def test_who_was_idle_saves_nothing_up() -> None:
    scheduler, busy, late_comer = Scheduler(), Turn(), Turn(ready=False)
    for _ in range(100):
        assert scheduler.choose([busy, late_comer]) is busy
        scheduler.charge(busy, 1.0)
    late_comer.ready = True
    had = 0
    for _ in range(20):
        task = scheduler.choose([busy, late_comer])
        assert task is not None
        scheduler.charge(task, 1.0)
        had += task is late_comer
    assert 9 <= had <= 11


def test_a_first_frame_goes_first_but_starves_nobody() -> None:
    newest, other = Turn(unseen=True), Turn()
    scheduler = Scheduler()
    assert scheduler.choose([newest, other]) is newest
    scheduler.charge(newest, FIRST_FRAME_LEAD_S / 2)
    assert scheduler.choose([newest, other]) is newest
    had = turns([Turn(unseen=True), Turn()], 200)  # as when an edit follows an edit
    assert had[1] > 80


class Stream(Turn):
    """Traces frames of `frame_s` seconds in turns of 20 ms. Its first turn takes `load_s`."""

    def begin(self, now_s: float, load_s: float, frame_s: float) -> None:
        self._next_s, self._frame_s, self._done_s = load_s, frame_s, 0.0
        self.shown_at, self.longest_s, self.unseen = now_s, 0.0, True

    def turn(self, now_s: float) -> float:
        """The seconds that it takes."""
        took_s, self._next_s = self._next_s, 0.02
        self._done_s += 0.02
        if self._done_s >= (0.04 if self.unseen else self._frame_s):
            self.longest_s = max(self.longest_s, now_s + took_s - self.shown_at)
            self.shown_at, self._done_s, self.unseen = now_s + took_s, 0.0, False
        return took_s


def simulated(streams: list[Stream], frames_s: list[float], loads: bool = True) -> list[float]:
    """The longest wait of each in a minute, by a simulated clock: they come one after the other, with frames that
    take so long in turn, and every fifth one loads a kernel."""
    scheduler, clock_s, here = Scheduler(), 0.0, 0
    while clock_s < 60.0:
        while here < len(streams) and clock_s >= 0.02 * here:
            streams[here].begin(clock_s, 0.4 if loads and here % 5 == 0 else 0.02, frames_s[here % len(frames_s)])
            here += 1
        stream = scheduler.choose(streams[:here])
        assert stream is not None
        took_s = stream.turn(clock_s)
        scheduler.charge(stream, took_s)
        clock_s += took_s
        if stream.shown_at == clock_s:
            scheduler.shown(stream)
    return [max(stream.longest_s, clock_s - stream.shown_at) for stream in streams]


@pytest.mark.parametrize("frames_s", [[0.08], [0.06, 0.08, 0.1, 0.16]], ids=["equal", "unequal"])
@pytest.mark.parametrize("one_key", [False, True])
def test_nobody_waits_long_among_thirty_two_streams(one_key: bool, frames_s: list[float]) -> None:
    waits = simulated([Stream(client="key" if one_key else "", wanted=True) for _ in range(32)], frames_s)
    assert max(waits) <= 5.0, sorted(waits)


def test_large_pictures_get_no_more_time_than_others() -> None:
    """Where a few share the device, whose frames are late makes no difference."""
    streams = [Stream(wanted=True) for _ in range(4)]
    simulated(streams, [8.0, 0.06, 0.06, 0.06], loads=False)
    used_s = [stream.account.used_s for stream in streams]
    assert max(used_s) < 1.1 * min(used_s)


def test_a_late_picture_gets_a_sixteenth_at_most() -> None:
    streams = [Stream(wanted=True) for _ in range(64)]
    simulated(streams, [8.0, *63 * [0.02]], loads=False)
    used_s = [stream.account.used_s for stream in streams]
    assert max(used_s) == used_s[0] < 60.0 * (1 / 16 + 1 / 64)


def test_a_key_with_many_late_streams_takes_nothing_from_another() -> None:
    many = [Stream(client="many", wanted=True) for _ in range(31)]
    one = Stream(client="one", wanted=True)
    simulated([*many, one], [0.16], loads=False)
    assert 25.0 < one.account.used_s < 32.0


def test_only_who_wants_a_frame_is_late() -> None:
    scheduler, late, others = Scheduler(), Turn(wanted=True), [Turn() for _ in range(31)]
    tasks = [late, *others]
    for task in tasks:
        scheduler.shown(task)
        scheduler.charge(task, LATE_S / 16)  # they are all late now, by a share of half a sixteenth
    scheduler.charge(late, 0.01)
    assert scheduler.choose(tasks) is late
    late.wanted = False
    assert scheduler.choose(tasks) is not late
    late.wanted = True
    scheduler.shown(late)
    assert scheduler.choose(tasks) is not late


@pytest.mark.slow
def test_what_a_long_turn_took_is_paid_back() -> None:
    scheduler, loads, others = Scheduler(), Turn(), [Turn() for _ in range(31)]
    used = dict.fromkeys(map(id, [loads, *others]), 0.0)
    before = 0  # turns of others until its next one
    for count in range(40_000):
        task = scheduler.choose([loads, *others])
        assert task is not None
        seconds = 0.6 if task is loads and not used[id(loads)] else 0.02
        scheduler.charge(task, seconds)
        used[id(task)] += seconds
        before += used[id(loads)] in (0.0, 0.6)
        if count == 320:
            assert used[id(loads)] - min(used.values()) > 0.3
    assert before < 4 * 32
    assert max(used.values()) - min(used.values()) < 0.05


def test_long_turns_do_not_pay() -> None:
    """Who takes a second each time gets no more than the others, but for what may be owed."""
    scheduler, greedy, others = Scheduler(), Turn(), [Turn() for _ in range(7)]
    used_s = 0.0
    for _ in range(10_000):
        task = scheduler.choose([greedy, *others])
        assert task is not None
        scheduler.charge(task, 1.0 if task is greedy else 0.02)
        used_s += 1.0 if task is greedy else 0.02
    mean_s = sum(other.account.used_s for other in others) / 7
    assert greedy.account.used_s <= mean_s + MOST_OWED_S + CATCH_UP_S / 8 + 1.0


def test_a_turn_of_many_seconds_is_waited_for_in_full() -> None:
    """Whoever took 20 s waits until another has had as much, but for what may be owed."""
    scheduler, greedy, other = Scheduler(), Turn(), Turn()
    waits_s, since_s = [], 0.0
    for _ in range(6000):
        task = scheduler.choose([greedy, other])
        assert task is not None
        scheduler.charge(task, 20.0 if task is greedy else 0.02)
        since_s += 0.02
        if task is greedy:
            waits_s.append(since_s)
            since_s = 0.0
    assert len(waits_s) > 4 and min(waits_s[1:]) >= 20.0 - MOST_OWED_S - CATCH_UP_S


def test_who_comes_during_a_long_turn_is_level_with_whoever_had_it() -> None:
    scheduler, first, others = Scheduler(), Turn(), [Turn() for _ in range(31)]
    assert scheduler.choose([first]) is first
    scheduler.charge(first, 1.0)
    had = []
    for _ in range(64):
        task = scheduler.choose([first, *others])
        assert task is not None
        scheduler.charge(task, 0.02)
        had.append(task is first)
    assert sum(had) == 2
