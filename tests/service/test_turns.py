"""One order of callers for all that they share: `service.system.turns`."""

from __future__ import annotations

import re
import threading
from collections import Counter
from pathlib import Path

from service.system.shares import CALLER
from service.system.turns import REMEMBERED, FairQueue, FairRoom, Turns

PATIENCE_S = 30.0
SERVICE = Path(__file__).parents[2] / "service"


class Worker:
    """A thread that takes a turn for a caller, and has it until `end`."""

    def __init__(self, turns: FairRoom, caller: str) -> None:
        self._turns, self._caller = turns, caller
        self.has_turn, self._ended = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def _work(self) -> None:
        CALLER.set(self._caller)
        with self._turns.taken():
            self.has_turn.set()
            self._ended.wait(PATIENCE_S)

    def end(self) -> None:
        self._ended.set()
        self._thread.join(PATIENCE_S)


def test_one_caller_leaves_a_turn_for_others() -> None:
    turns = FairRoom(3)
    crowd = [Worker(turns, "crowd") for _ in range(5)]
    other = Worker(turns, "other")
    assert other.has_turn.wait(PATIENCE_S), "the crowd has all"
    assert sum(each.has_turn.is_set() for each in crowd) <= 2
    late = Worker(turns, "late")  # there is none left
    for each in [each for each in crowd if each.has_turn.is_set()][:1]:
        each.end()
    assert late.has_turn.wait(PATIENCE_S), "the next turn is that of a caller with none"
    for each in (other, late, *crowd):
        each.end()


def test_with_one_turn_they_come_one_after_the_other() -> None:
    turns, most, now = FairRoom(1), [0], [0]
    lock = threading.Lock()

    def work() -> None:
        for _ in range(50):
            with turns.taken():
                with lock:
                    now[0] += 1
                    most[0] = max(most[0], now[0])
                with lock:
                    now[0] -= 1

    threads = [threading.Thread(target=work) for _ in range(4)]
    for each in threads:
        each.start()
    for each in threads:
        each.join(PATIENCE_S)
    assert most == [1] and not any(each.is_alive() for each in threads)


def test_the_order_of_callers() -> None:
    """Who has least, then whose turn is the longest ago, then who came first; one caller's own by their places."""
    queue = FairQueue[tuple[str, int]](lambda item: item[0], lambda item: item[1])
    for item in (("a", 2), ("b", 1), ("a", 1), ("c", 1), ("a", 1), ("a", 3)):
        queue.add(item)
    has = Counter({"b": 1})
    taken = list[tuple[str, int]]()
    while (item := queue.first(has.__getitem__)) is not None:
        queue.take(item)
        taken.append(item)
    assert taken == [("a", 1), ("c", 1), ("a", 1), ("a", 2), ("a", 3), ("b", 1)] and not len(queue)
    for item in (("b", 1), ("a", 1), ("d", 1), ("c", 1)):
        queue.add(item)
    order = list[str]()
    while (item := queue.first(lambda caller: 0)) is not None:
        queue.take(item)
        order.append(item[0])
    assert order == ["d", "c", "a", "b"], "d had no turn; c had its one before a's last, and a before b"


def test_who_may_not_and_what_does_not_fit_is_passed() -> None:
    queue = FairQueue[tuple[str, int]](lambda item: item[0])
    items = [("a", 5), ("a", 1), ("b", 1)]
    for item in items:
        queue.add(item)
    assert queue.first(lambda caller: 0, fits=lambda item: item[1] < 5) is items[1]
    assert queue.first(lambda caller: 0, may=lambda caller: caller != "a") is items[2]
    assert queue.first(lambda caller: 0, may=lambda caller: False) is None
    assert items[1] in queue and queue.remove(items[1]) and not queue.remove(items[1])
    assert list(queue) == [("a", 5), ("b", 1)] and set(queue.callers) == {"a", "b"} and queue.line("c") == []


def test_turns_of_long_ago_are_forgotten() -> None:
    turns = Turns()
    for caller in range(REMEMBERED + 10):
        turns.had(str(caller))
    assert turns.last("0") == 0 < turns.last("10")
    turns.had("x", "y")
    assert turns.last("x") == turns.last("y") > turns.last(str(REMEMBERED + 9))


def test_there_is_no_other_order() -> None:
    """Nothing else in the service remembers whose turn was when; the scheduler divides a renderer's measured time."""
    kept = re.compile(r"\b_?last\w*\b.*\bturn|# .*last turn (counts|is)")
    found = {
        str(path.relative_to(SERVICE))
        for path in SERVICE.rglob("*.py")
        if any(kept.search(line) for line in path.read_text().splitlines())
    }
    assert found == {"system/turns.py"}
