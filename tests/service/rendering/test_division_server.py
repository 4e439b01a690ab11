"""Who assists whom, as the server decides it: with renderers that only note what they are told."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any, cast

import numpy as np
import pytest

from gpu import SceneEdit
from service.ipc.channel import Encoded
from service.ipc.leases import Assist, Assistants, Lease, LeaseDone, LeaseFailed, LeaseRefuted
from service.ipc.messages import Done, Failed, Progress, StopRule, ToRenderer, Update
from service.ipc.task_control import Drop, Pause, Resume
from service.renderers.pool.division import Division

SCENE = cast(Any, "a scene")


class _Peer:
    def __init__(self, driver: str | None = "llvmpipe") -> None:
        self.driver = driver
        self.told: list[ToRenderer] = []
        self.leases: Counter[str] = Counter()

    def relay(self, message: ToRenderer) -> None:
        self.told.append(message)

    def relay_encoded(self, encoded: Encoded) -> None:
        raise AssertionError

    def scene_of(self, task: int) -> Iterable[Encoded | ToRenderer]:
        return [_update(task)]

    def take(self) -> list[ToRenderer]:
        told, self.told = self.told, []
        return told


def _update(task: int, **settings: Any) -> Update:
    stop = StopRule(max_samples=100, time_limit=settings.pop("time_limit", None))
    return Update(task, 1, SCENE, {"width": 64, "height": 64, **settings}, stop)


def _pool(*drivers: str | None) -> tuple[Division, list[_Peer]]:
    peers = [_Peer(driver) for driver in drivers]
    return Division(peers), peers


def _begin(division: Division, task: int, home: int, most: int | None = None, **settings: Any) -> None:
    division.opened(task, home, most)
    division.scene_sent(_update(task, **settings))


def test_a_render_gets_all_free_renderers_of_its_driver() -> None:
    division, peers = _pool("a", "a", "b", "a", None)
    _begin(division, 5, 0)
    assert peers[0].take() == [Assistants(5, (1, 3))]
    assert peers[1].take() == [Assist(5), _update(5)] == peers[3].take()
    assert not peers[2].told and not peers[4].told
    assert division.renderers(5) == 3


def test_a_second_render_takes_its_home_back_and_they_share_the_rest() -> None:
    division, peers = _pool("a", "a", "a", "a")
    _begin(division, 1, 0)
    _begin(division, 2, 1)
    assert division.renderers(1) == division.renderers(2) == 2
    assert Drop(1) in peers[1].told and Assistants(2, (3,)) in peers[1].told
    division.heard(Done(1, 1, "max_samples", Progress(100), []))
    assert division.renderers(2) == 4 and division.renderers(1) == 0


def test_what_cannot_be_divided_has_one() -> None:
    for settings in ({"adaptive": True}, {"time_limit": 3.0}):
        division, _ = _pool("a", "a")
        _begin(division, 1, 0, **settings)
        assert division.renderers(1) == 1


def test_a_stream_has_as_many_as_it_asked_for_and_none_while_it_is_paused() -> None:
    division, peers = _pool("a", "a", "a")
    _begin(division, 1, 0, most=1)
    assert division.renderers(1) == 1
    division.divide(1, 2)
    assert division.renderers(1) == 2
    division.sent(Pause(1))
    assert peers[1].take()[-1] == Drop(1) and division.renderers(1) == 0
    division.sent(Resume(1))
    assert division.renderers(1) == 2
    division.divide(1, 99)
    assert division.renderers(1) == 3


def test_edits_reach_all() -> None:
    division, peers = _pool("a", "a")
    _begin(division, 1, 0)
    edit = Update(1, 2, edit=SceneEdit(environment=(1.0, 0.0)), base=1)
    division.sent(edit)
    assert peers[1].told[-1] == edit
    assert edit not in peers[0].told  # the pool sends it there


def test_leases_and_results_find_their_way() -> None:
    division, peers = _pool("a", "a", "a")
    _begin(division, 1, 0, most=2)
    lease, done = Lease(1, 1, 77, 1, 8, 56, 0, 8), LeaseDone(1, 1, 77, np.zeros(0))
    division.forward(lease, 0)
    assert peers[1].told[-1] == lease
    division.forward(done, 1)
    assert peers[0].told[-1] is done and peers[1].leases == {"given": 1, "done": 1}
    peers[0].take()
    division.forward(done, 2)  # nobody asked it
    division.forward(Lease(1, 1, 78, 2, 8, 56, 0, 8), 0)  # which does not assist any more
    assert not peers[0].told and not peers[2].told


def test_who_cannot_load_the_scene_is_not_asked_again_before_there_is_another() -> None:
    division, peers = _pool("a", "a")
    _begin(division, 1, 0)
    division.forward(LeaseFailed(1, 1, "out of memory"), 1)
    assert division.renderers(1) == 1 and peers[0].told[-1] == Assistants(1, ())
    division.assign()
    assert division.renderers(1) == 1
    division.scene_sent(_update(1))
    assert division.renderers(1) == 2


def test_whose_results_are_wrong_assists_in_no_picture(caplog: pytest.LogCaptureFixture) -> None:
    division, peers = _pool("a", "a", "a")
    _begin(division, 1, 0)
    division.forward(LeaseRefuted(1, 1, 2), 1)  # only a home can say so
    assert division.renderers(1) == 3 and not peers[2].leases
    division.forward(LeaseRefuted(1, 1, 1), 0)
    assert division.renderers(1) == 2 and peers[0].told[-1] == Assistants(1, (2,)) and peers[1].told[-1] == Drop(1)
    assert peers[1].leases["wrong"] == 1 and "task=1 home=0 renderer=1" in caplog.text
    division.dropped(1)
    _begin(division, 2, 2)
    assert division.renderers(2) == 2 and peers[2].told[-1] == Assistants(2, (0,))


def test_where_an_edit_fails_at_home_assistants_begin_again() -> None:
    division, peers = _pool("a", "a")
    _begin(division, 1, 0)
    peers[1].take()
    division.heard(Failed(1, 2, "too large", fallback=1))
    assert peers[1].take() == [Drop(1), Assist(1), _update(1)]


def test_a_lost_assistant_is_taken_off_the_list_and_a_lost_home_is_told_again() -> None:
    division, peers = _pool("a", "a")
    _begin(division, 1, 0)
    peers[1].driver = None
    division.assign()
    assert peers[0].told[-1] == Assistants(1, ())
    peers[1].driver = "a"
    division.assign()
    peers[0].take()
    division.replayed(1)
    assert peers[0].take() == [Assistants(1, (1,))]


def test_a_dropped_task_leaves_nothing_behind() -> None:
    division, peers = _pool("a", "a")
    _begin(division, 1, 0)
    division.dropped(1)
    assert peers[1].told[-1] == Drop(1) and division.renderers(1) == 0
