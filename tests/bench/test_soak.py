"""What a soak makes of what it saw. The soak itself takes an hour: `make soak`."""

from __future__ import annotations

import random
import threading
import time
from pathlib import Path

import pytest

from gpu import Renderer
from tests.bench import soak_restarts
from tests.bench.soak_tally import Tally


def test_recovery_is_from_a_kill_to_the_next_frame_that_begins_again() -> None:
    tally = Tally()
    tally.kill()  # nobody watched yet
    tally.frame("a", began_again=False)
    tally.frame("a", began_again=True)
    assert not tally.recoveries_s
    tally.kill()
    tally.frame("a", began_again=False)  # was on its way
    tally.frame("a", began_again=True)
    tally.frame("a", began_again=True)
    assert len(tally.recoveries_s) == 1 and tally.kills == 2 and tally.frames == 5


def test_what_is_not_good_enough() -> None:
    tally = Tally()
    for growth in (1, 1, 1, 2):
        tally.seen(growth << 20, 1, 10, settled=True)
    assert tally.good(growth=1.6, fair=0.95, page_growth=1.25) and not tally.good(
        growth=1.4, fair=0.95, page_growth=1.25
    )
    tally.jain = 0.9
    assert not tally.good(growth=1.6, fair=0.95, page_growth=1.25)
    tally.jain = 0.99
    tally.lose("render failed")
    assert not tally.good(growth=1.6, fair=0.95, page_growth=1.25)
    assert "render failed 1" in tally.table() and "0.990" in tally.table()


def test_a_page_that_grows_is_not_good_enough() -> None:
    tally = Tally()
    for heap in (900, 4, 4, 5, 5):
        tally.weighed(heap << 20, 1000, settled=heap < 900)
    assert tally.good(growth=1.5, fair=0.95, page_growth=1.3)
    assert not tally.good(growth=1.5, fair=0.95, page_growth=1.2)
    assert "4.0 / 5.0" in tally.table()


def test_who_gets_further_is_not_stuck() -> None:
    tally, began = Tally(), time.monotonic() - 100.0
    assert tally.still_s(threading.get_ident(), began) >= 100.0
    tally.advance()
    assert tally.still_s(threading.get_ident(), began) < 100.0 <= tally.still_s(None, began)


@pytest.mark.bench
def test_a_short_soak_with_restarts(gpu: Renderer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The long form has 20 restarts and 1 000 renders."""
    monkeypatch.setattr(soak_restarts, "LONG_SIDE", 256)
    monkeypatch.setattr(soak_restarts, "LONG_SAMPLES", 200)
    monkeypatch.setattr(soak_restarts, "LOOK_S", 0.2)
    outcome = soak_restarts.restart(tmp_path, restarts=2, renders=12, seconds=4.0, chance=random.Random(3))
    assert outcome.good, outcome
    assert outcome.restarts == 2 and outcome.done == 13 and outcome.compared == 12 and outcome.checked


def test_a_soak_that_lost_something_is_not_good() -> None:
    outcome = soak_restarts.Outcome(restarts=1, accepted=2, done=2, starts_s=[0.5, 2.0])
    assert outcome.good and ("kill to first answer, median / longest (s)", "2.0 / 2.0") in outcome.rows()
    outcome.done = 1
    assert not outcome.good
    outcome.done, outcome.orphans = 2, 1
    assert not outcome.good
    outcome.orphans, outcome.wrong = 0, ["image 404"]
    assert not outcome.good and ("lost or wrong", "image 404") in outcome.rows()
