"""A block of samples that several renderers trace: its bits are those of one."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from gpu import Band, Picture, Renderer, border_after
from gpu.picture import passes
from gpu.picture.blocks import FIRST, SIZE
from tests.gpu.bits import assert_same, beside, saved, seen, slice_of
from tests.gpu.conftest import SCENE, SETTINGS
from tests.rendering import picture


def bands_of(rng: np.random.Generator, first: int, count: int, top: int, height: int) -> list[Band]:
    cuts = np.unique([top, height, *rng.integers(top, height, 3)])
    bands = [Band(first, count, int(a), int(b - a)) for a, b in pairwise(cuts)]
    rng.shuffle(bands)  # type: ignore[arg-type]
    return bands


@pytest.mark.parametrize("end", [128, 150])
def test_bands_traced_elsewhere_in_random_order(made: Callable[[int], Picture], slices: None, end: int) -> None:
    """With all rows of its own, some, and none; on helpers that go on to other bands, in slices."""
    whole, home, rng = made(end), made(FIRST), np.random.default_rng(9)
    helpers = [beside(home), beside(home)]
    for rows in (0, 20, 37):
        first = home.samples
        if first >= end:
            break
        last = min(border_after(first), end)
        home.block.share(rows, last)
        assert home.block.shared and home.block.own_done == (rows == 0) and not home.at_border
        before = seen(home)
        for band in bands_of(rng, first, last - first, rows, 37) if rows < 37 else []:
            helper = home if rng.random() < 0.3 else helpers[int(rng.integers(2))]
            while not helper.block.trace_band(band, 0.0):
                if not home.block.own_done:
                    slice_of(home, 1)
            values = helper.block.read_band(band)
            assert values.shape == (band.rows, 48, 12) and (values[..., 11] == band.count).all()
            if helper is not home:
                home.block.write_band(band, values)
        while not home.block.own_done:
            home.trace(0.0, 1)
        assert home.samples == first and home.under_way == (0, 0, 0)
        assert all(np.array_equal(values, before[name]) for name, values in seen(home).items()), (
            "it shows the even one"
        )
        home.block.complete()
        assert not home.block.shared
        home.trace(600.0, last)
        assert home.samples == last
    if home.samples < end:
        home.trace(600.0, end)
    assert_same(home, whole)
    for helper in helpers:
        helper.trace(600.0, 70)  # it is a picture as any other
        assert_same(helper, made(70))
        helper.release()


def test_saved_while_a_block_is_shared(made: Callable[[int], Picture], slices: None) -> None:
    """The even state is saved, and goes on to the same bits; so does the one after `complete`, in every phase."""
    whole, home = made(130), made(64)
    even = saved(home)
    home.block.share(10, 128)
    home.trace(600.0, 128)
    assert home.block.own_done
    half = saved(home)
    assert half.samples == 64 and half.under_way == (0, 0, 0)
    for mine, theirs in zip(half.buffers, even.buffers, strict=True):
        assert np.array_equal(mine, theirs)
    helper, band = beside(home), Band(64, 64, 10, 27)
    assert helper.block.trace_band(band, 600.0)
    home.block.write_band(band, helper.block.read_band(band))
    home.block.complete()
    states = [half, saved(home)]
    while home.samples < 128:
        slice_of(home, 128)
        states.append(saved(home))
    assert len(states) > 20
    for state in states[::4] + states[-1:]:
        helper.restore(state)
        helper.trace(600.0, 130)
        assert_same(helper, whole)
    helper.release()


def test_a_band_begins_again_where_another_was_traced(made: Callable[[int], Picture]) -> None:
    home, other = made(FIRST), Band(8, 56, 5, 9)
    helper, band = beside(home), Band(8, 56, 0, 20)
    assert helper.block.trace_band(band, 600.0)
    expected = helper.block.read_band(band)
    assert not helper.block.trace_band(other, 0.0)
    with pytest.raises(ValueError, match="not complete"):
        helper.block.read_band(other)
    assert helper.block.trace_band(band, 600.0) and np.array_equal(helper.block.read_band(band), expected)
    helper.reset()
    with pytest.raises(ValueError, match="not complete"):
        helper.block.read_band(band)
    helper.release()


def test_what_was_shared_can_be_dropped(made: Callable[[int], Picture]) -> None:
    whole, home = made(70), made(FIRST)
    home.block.share(20, 64)
    home.trace(600.0, 64)
    home.block.unshare()
    assert not home.block.shared and home.samples == FIRST
    home.trace(600.0, 70)
    assert_same(home, whole)


def test_what_cannot_be_shared(gpu: Renderer, made: Callable[[int], Picture]) -> None:
    for samples in (1, 16, 65):
        with pytest.raises(ValueError, match="no block begins"):
            made(samples).block.share(3, 64)
    adaptive = picture(gpu, SCENE, 8, **SETTINGS, adaptive=True)
    with pytest.raises(ValueError, match="no block begins"):
        adaptive.block.share(3, 64)
    with pytest.raises(ValueError, match="no part"):
        adaptive.block.trace_band(Band(8, 8, 0, 1), 0.0)
    home = made(FIRST)
    for rows, end in ((-1, 64), (38, 64), (3, 65), (3, 8)):
        with pytest.raises(ValueError, match="no part of the block"):
            home.block.share(rows, end)
    with pytest.raises(ValueError, match="shares"):
        home.block.trace_band(Band(8, 56, 0, 1), 0.0)
    home.block.share(3, 64)
    for band, why in ((Band(8, 8, 5, 1), "block under way"), (Band(8, 56, 2, 5), "traces itself"),
                      (Band(8, 56, 30, 8), "no part")):  # fmt: skip
        with pytest.raises(ValueError, match=why):
            home.block.trace_band(band, 0.0)
    with pytest.raises(ValueError, match="shape"):
        home.block.write_band(Band(8, 56, 3, 2), np.zeros((3, 48, 12), np.float32))
    with pytest.raises(ValueError, match="lack samples"):
        home.block.complete()


def test_paths_that_may_be_long_are_metered_in_rounds(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """An invocation takes no more samples than the driver's loops have turns for, when a shared block is complete."""
    monkeypatch.setattr(passes, "samples_at_once", lambda *_: 3)
    whole, home = (picture(gpu, SCENE, n, **SETTINGS) for n in (64, FIRST))
    home.block.share(37, 64)
    home.trace(600.0, 64)
    home.block.complete()
    counts, run = [], home._dispatcher.run
    monkeypatch.setattr(
        home._dispatcher, "run", lambda k, frame, g: counts.append(int(frame["sample_count"])) or run(k, frame, g)
    )
    home.trace(600.0, 64)
    assert max(counts) == 3 and sum(counts) >= SIZE - FIRST
    assert_same(home, whole)


def test_the_warnings_of_helpers_are_those_of_the_picture(made: Callable[[int], Picture]) -> None:
    home = made(FIRST)
    helper = beside(home)
    helper._dispatcher.counts = 3, 5
    home._dispatcher.counts = 1, 0
    home.block.add_counts(helper.block.take_counts())
    assert home._dispatcher.counts == (4, 5) and not helper.warnings
    assert home.warnings[0].startswith("4 paths") and home.warnings[1].startswith("5 paths")
    home.block.add_counts((0, 0xFFFFFFFF))
    assert home._dispatcher.counts == (4, 0xFFFFFFFF), "a count stays where it can rise no further"
