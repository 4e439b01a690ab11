"""The garbage collector rests while somebody asks for it, and no longer."""

from __future__ import annotations

import gc

import pytest

from service.system.garbage import collector_paused, loaded


def test_it_rests_until_the_last_pause_ends() -> None:
    assert gc.isenabled()
    first, second = collector_paused(), collector_paused()
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert not gc.isenabled()
    second.__exit__(None, None, None)
    assert gc.isenabled()


def test_it_goes_on_after_an_error() -> None:
    with pytest.raises(ValueError), collector_paused():
        raise ValueError
    assert gc.isenabled()


def test_who_has_turned_it_off_finds_it_so() -> None:
    gc.disable()
    try:
        with collector_paused():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_what_a_program_has_loaded_stays_out_of_its_sight() -> None:
    gc.disable()
    try:
        before, mine = gc.get_freeze_count(), list[object]([[]])
        loaded()
        assert gc.isenabled() and gc.get_freeze_count() > before
        assert all(each is not mine for each in gc.get_objects())
    finally:
        gc.unfreeze()
        gc.enable()


def test_a_collector_that_works_keeps_its_sight() -> None:
    before = gc.get_freeze_count()
    loaded()
    assert gc.get_freeze_count() == before
