"""Shares: one caller alone never refuses another one's small request."""

from __future__ import annotations

import random

import pytest

from service.problems import TooLarge, TooManyRequests, Unavailable
from service.system.shares import Shares


def test_one_caller_leaves_a_quarter_to_each_other() -> None:
    """Whatever it takes, and in whatever pieces."""
    pieces = random.Random(4)
    for most in (4, 64, 1000, 1 << 30):
        shares = Shares(most, "questions")
        for _ in range(1000):
            try:
                shares.take("greedy", pieces.randint(1, max(1, most // 8)))
            except TooManyRequests:
                continue
        with shares.taken("other", most // 4):
            assert shares.total <= most


def test_nobody_has_more_than_is_left_free() -> None:
    """The rule itself, over any order of taking and releasing."""
    chance, names, most = random.Random(7), "abcd", 100
    shares, taken = Shares(most, "questions"), dict.fromkeys("abcd", 0)
    refused = 0
    for _ in range(10_000):
        name, n = chance.choice(names), chance.randint(1, 9)
        if chance.random() < 0.4:
            n = min(n, taken[name])
            shares.release(name, n)
            taken[name] -= n
        else:
            free = most - sum(taken.values()) - n
            last = n == 1 and not taken[name] and free >= 0  # a single unit, for one that has none
            try:
                shares.take(name, n)
                taken[name] += n
                assert taken[name] <= free or last
            except (TooManyRequests, Unavailable):
                refused += 1
                assert taken[name] + n > free and not last
        assert {name: shares.of(name) for name in names} == taken and shares.total == sum(taken.values())
    assert refused > 100


def test_greedy_callers_end_with_equal_shares() -> None:
    """Each takes what it gets, and one unit at a time ends: as much is left free as one of them has."""
    shares, names, chance = Shares(80, "questions"), "abc", random.Random(1)
    for _ in range(5000):
        for name in chance.sample(names, 3):
            try:
                shares.take(name)
            except (TooManyRequests, Unavailable):
                continue
        whose = chance.choice([name for name in names if shares.of(name)])
        shares.release(whose)
    assert all(abs(shares.of(name) - 20) <= 3 for name in names)


@pytest.mark.parametrize("most", [1, 2, 3, 7, 64])
def test_the_last_unit_is_for_somebody_who_has_none(most: int) -> None:
    """Of a few requests at a time, all are in use at last, and a caller alone has half of them, or the only one."""
    shares = Shares(most, "streams")
    alone = 0
    while True:
        try:
            shares.take("a")
            alone += 1
        except TooManyRequests:
            break
    assert alone == max(1, most // 2)
    for number in range(most - alone):
        shares.take(f"other {number}")
    with pytest.raises(Unavailable):
        shares.take("late")
    with pytest.raises(TooLarge):
        Shares(0, "nothing").take("a", 2)


def test_the_error_says_whose_units_are_the_cause() -> None:
    shares = Shares(100, "uploads (SUNBOX_MAX_BODIES)", retry_s=7)
    shares.take("a", 50)
    with pytest.raises(TooManyRequests, match=r"uploads \(SUNBOX_MAX_BODIES\)") as beyond:
        shares.take("a")
    assert beyond.value.retry_after == 7
    shares.take("b", 25)
    with pytest.raises(Unavailable, match=r"uploads \(SUNBOX_MAX_BODIES\)") as full:
        shares.take("c", 20)
    assert full.value.retry_after == 7
    with pytest.raises(TooLarge):
        shares.take("c", 51)
    assert shares.total == 75, "what is refused takes nothing"


def test_a_caller_has_a_bound_of_its_own_where_there_is_room() -> None:
    shares = Shares(1000, "open requests", each=3)
    for _ in range(3):
        shares.take("a")
    with pytest.raises(TooManyRequests):
        shares.take("a")
    shares.take("b")


def test_what_is_there_already_counts() -> None:
    shares = Shares(10, "waiting renders")
    shares.count("a", 9)
    with pytest.raises(TooManyRequests):
        shares.take("a")
    shares.release("a", 9)
    assert shares.total == shares.of("a") == 0
    with pytest.raises(ZeroDivisionError), shares.taken("a", 5):
        raise ZeroDivisionError
    assert shares.total == 0
