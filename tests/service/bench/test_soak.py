"""What a soak makes of what it saw. The soak itself takes an hour: `make soak`."""

from __future__ import annotations

import threading
import time

from service.bench.soak_tally import Tally


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
