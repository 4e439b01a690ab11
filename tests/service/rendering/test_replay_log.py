"""What a new renderer is sent of a task whose renderer was lost."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from service.ipc import channel
from service.ipc.messages import Failed, Loaded, StopRule, Update
from service.ipc.task_control import ApplyNow
from service.renderers.replay_log import MOST, ReplayLog


@pytest.fixture
def log() -> Iterator[ReplayLog]:
    log = ReplayLog(1)
    yield log
    log.close()


def send_scene(log: ReplayLog, generation: int) -> None:
    """A whole scene, which may turn out to be too much for the renderer."""
    update = Update(1, generation, settings={"width": generation}, stop=StopRule())
    encoded = channel.encode(update)
    log.note_scene(update, encoded)
    channel.discard(encoded)


def works(log: ReplayLog, generation: int) -> None:
    log.heard(Loaded(1, generation, 0.0, 0.0, (), (), []))


def generations(log: ReplayLog) -> list[int]:
    """Those of the scenes that a new renderer gets, one after the other."""
    out: list[int] = []
    for message in log.scenes():
        sent: Any = channel.decode(*message) if isinstance(message, tuple) else message
        if not isinstance(sent, ApplyNow):
            out.append(sent.generation)
    return out


def test_of_many_scenes_that_wait_the_one_that_works_and_the_newest_stay(log: ReplayLog) -> None:
    """The first is what the renderer goes back to, the last what the client asked for."""
    send_scene(log, 1)
    works(log, 1)
    for generation in range(2, 10):
        send_scene(log, generation)
    assert generations(log) == [1, *range(10 - (MOST - 1), 10)]
    log.heard(Failed(1, 9, "too large", fallback=1))
    assert generations(log) == [1]


def test_what_was_seen_to_work_is_what_is_gone_back_to(log: ReplayLog) -> None:
    for generation in (1, 2, 3):
        send_scene(log, generation)
    works(log, 2)
    assert generations(log) == [2, 3]


def test_a_scene_that_was_sent_later_outlives_a_failure(log: ReplayLog) -> None:
    for generation in (1, 2, 3):
        send_scene(log, generation)
    log.heard(Failed(1, 2, "too large", fallback=1))
    assert generations(log) == [1, 3]
