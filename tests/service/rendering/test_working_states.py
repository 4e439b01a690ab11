"""To which states a task may go back."""

from __future__ import annotations

from service.renderers.replay_log import MOST, WorkingStates


def pushed(*generations: int) -> tuple[WorkingStates[str], list[str]]:
    """States, and the list of those that are forgotten."""
    forgotten: list[str] = []
    states = WorkingStates[str](forgotten.append)
    for generation in generations:
        states.push(generation, f"state {generation}")
    return states, forgotten


def generations(states: WorkingStates[str]) -> list[int]:
    return [generation for generation, _ in states.items()]


def test_the_first_and_the_newest_are_stored() -> None:
    states, forgotten = pushed(*range(1, 50))
    assert generations(states) == [1, *range(50 - MOST + 1, 50)] and states.newest == "state 49"
    assert forgotten[0] == "state 2" and len(forgotten) == 49 - MOST
    assert states.at(1) == "state 1" and states.at(2) is None


def test_what_works_makes_older_ones_useless() -> None:
    states, forgotten = pushed(2, 5, 8)
    states.works(1)
    assert generations(states) == [2, 5, 8]
    states.works(6)  # an edit of the state that began with 5
    assert generations(states) == [5, 8] and forgotten == ["state 2"]
    states.works(8)
    states.works(9)
    assert generations(states) == [8]


def test_failed_ones_are_forgotten() -> None:
    states, forgotten = pushed(1, 4, 6)
    states.keep(lambda generation: generation != 4)
    assert generations(states) == [1, 6] and forgotten == ["state 4"]
    states.keep()
    assert generations(states) == [] and states.newest is None and len(forgotten) == 3
