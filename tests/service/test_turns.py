"""FairSemaphore of threads go round the callers that they work for."""

from __future__ import annotations

import threading

from service.system.shares import CALLER, FairSemaphore

PATIENCE_S = 30.0


class Worker:
    """A thread that takes a turn for a caller, and has it until `end`."""

    def __init__(self, turns: FairSemaphore, caller: str) -> None:
        self._turns, self._caller = turns, caller
        self.has_turn, self._ended = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._work)
        self._thread.start()

    def _work(self) -> None:
        CALLER.set(self._caller)
        with self._turns.one():
            self.has_turn.set()
            self._ended.wait(PATIENCE_S)

    def end(self) -> None:
        self._ended.set()
        self._thread.join(PATIENCE_S)


def test_one_caller_leaves_a_turn_for_others() -> None:
    turns = FairSemaphore(3)
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
    turns, most, now = FairSemaphore(1), [0], [0]
    lock = threading.Lock()

    def work() -> None:
        for _ in range(50):
            with turns.one():
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
