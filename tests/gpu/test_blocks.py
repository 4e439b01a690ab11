"""A picture is defined by blocks of samples: whoever traces which rows of one, in whatever slices, the bits are the
same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gpu import Band, GpuError, OutOfMemory, Picture, Renderer, border_after
from gpu import context as contexts
from gpu.layout.pixel_layers import ACCUMULATORS
from gpu.picture import noise_meter, passes
from gpu.picture.blocks import FIRST, Sums, is_stop, merged, stop_after
from tests.gpu.bits import assert_same, beside, saved, seen, slice_of
from tests.gpu.conftest import SCENE, SETTINGS
from tests.rendering import document, picture

# What the blocks are.


def test_borders() -> None:
    assert [border_after(n) for n in (0, 7, 8, 63, 64, 127, 128)] == [8, 8, 64, 64, 128, 128, 192]
    assert [stop_after(n) for n in (0, 8, 15, 16, 31, 32, 63, 64, 130)] == [8, 16, 16, 32, 32, 64, 64, 128, 192]
    assert [n for n in range(300) if is_stop(n)] == [8, 16, 32, 64, 128, 192, 256]


@pytest.mark.parametrize(
    "values", [(0, 9, 0, 1), (8, 60, 0, 1), (60, 8, 0, 1), (-1, 2, 0, 1), (0, 0, 0, 1), (0, 8, 0, 0)]
)
def test_a_band_lies_in_one_block(values: tuple[int, int, int, int]) -> None:
    with pytest.raises(ValueError, match=r"border|empty"):
        Band(*values)


def test_passes_end_at_stops(made: Callable[[int], Picture]) -> None:
    one, stops = made(1), []
    while one.samples < 140:
        slice_of(one, 140)
        if one.at_border and one.samples not in stops:
            stops.append(one.samples)
    assert stops == [8, 16, 32, 64, 128] and not one.at_border


# The sums.


def samples_of(rng: np.random.Generator, count: int, scale: float) -> np.ndarray:
    """(count, 3, 4) float32: of three pixels, dark, bright in few samples, and constant."""
    out = rng.random((count, 3, 4)) * scale
    out[:, 1] *= rng.random((count, 1)) > 0.9
    out[:, 2] = 0.1 * scale
    return out.astype(np.float32)


def summed(values: np.ndarray, moment_scale: float) -> Sums:
    """As pathtrace.comp adds them."""
    total, lost = np.zeros(values.shape[1:], np.float32), np.zeros(values.shape[1:], np.float32)
    moments = np.zeros(values.shape[1:], np.float32)
    for n, value in enumerate(values):
        before = total[:, :3] / np.float32(max(n, 1))
        x = value - lost
        new = total + x
        lost, total = (new - total) - x, new
        after = (value[:, :3] - total[:, :3] / np.float32(n + 1)) * np.float32(moment_scale)
        moments[:, :3] += np.maximum((value[:, :3] - before) * np.float32(moment_scale) * after, 0)
        moments[:, 3] += 1
    return Sums(total, lost, moments)


@pytest.mark.parametrize("scale", [1.0, 1e-20, 1e20, 1e30])
def test_merging_agrees_with_float64(scale: float) -> None:
    values = samples_of(np.random.default_rng(5), 64 * 6, scale)
    total, first = summed(values[:8], 1 / scale), 8
    while first < len(values):
        end = border_after(first)
        total, first = merged(total, summed(values[first:end], 1 / scale), 1 / scale), end
    exact = values.astype(float)
    n = len(values)
    assert (total.moments[:, 3] == n).all()
    assert total.sum.astype(float) - total.lost == pytest.approx(exact.sum(axis=0), rel=1e-8)
    assert total.sum == pytest.approx(exact.sum(axis=0), rel=6e-8)
    expected = exact[..., :3].var(axis=0) * n / scale**2
    assert total.moments[:2, :3] == pytest.approx(expected[:2], rel=2e-6)
    assert total.moments[2, :3] == pytest.approx(0, abs=n * 1e-16), "a constant has no spread but of rounding"


def test_a_million_samples_do_not_drift() -> None:
    """Blocks of which each has rounded; Kahan's sum of all has 4e-8."""
    block = summed(np.full((64, 1, 4), 0.1, np.float32), 1.0)
    total, count = block, 1_000_000 // 64
    for _ in range(count - 1):
        total = merged(total, block, 1.0)
    assert total.sum[0, 0] / np.float32(64 * count) == pytest.approx(float(np.float32(0.1)), rel=6e-8)
    assert total.moments[0, 0] == 0


def test_an_empty_part_changes_no_bit() -> None:
    some = summed(samples_of(np.random.default_rng(6), 20, 1.0), 1.0)
    none = Sums(*(np.zeros_like(part) for part in some))
    for both in (merged(some, none, 1.0), merged(none, some, 1.0)):
        assert all(np.array_equal(a, b) for a, b in zip(both, some, strict=True))


@pytest.mark.llvmpipe
@pytest.mark.parametrize("radiance", [1.0, 1e-20, 1e20])
def test_the_device_merges_as_numpy_does(gpu: Renderer, radiance: float) -> None:
    lit = {"type": "constant", "radiance": radiance}
    shapes = [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}]
    one = picture(gpu, document(shapes, environment=lit), 60, sampler="independent")
    one.trace(600.0, 63)
    sums, count = one._sums, 32 * 32
    slice_of_block = [one._sums.block[slot].read() for slot in ACCUMULATORS]
    expected = sums.read(0, count)
    sums.merge(0, count)
    found = [np.frombuffer(buffer.read(), np.float32).reshape(count, 4) for buffer in sums.total.values()]
    assert any(any(data) for data in slice_of_block) and expected.moments[0, 3] == 63
    for mine, theirs in zip(expected, found, strict=True):
        assert np.array_equal(mine, theirs)
    assert not any(np.frombuffer(buffer.read(), np.uint8).any() for buffer in sums.block.values())


def test_means_and_variances_are_those_of_the_samples(gpu: Renderer) -> None:
    """Of each sample, which differences of first pictures give; at counts around every kind of border."""
    one = picture(gpu, SCENE, 1, **{**SETTINGS, "width": 8, "height": 8, "sampler": "independent"})
    values, before = [], np.zeros((8, 8, 4))
    for n in range(1, 141):
        one.trace(600.0, n)
        block = [_vectors(one, each) for each in (one._sums.total, one._sums.block)]
        total = sum((part[0].astype(float) - part[1] for part in block if part is not None), np.zeros((8, 8, 4)))
        values.append(total - before)
        before = total
        if n in (2, 7, 8, 9, 63, 64, 65, 128, 140):
            samples = np.array(values)
            assert one.read() == pytest.approx(samples.mean(axis=0), rel=2e-6)
            spread = samples[..., :3].var(axis=0, ddof=1) / n
            assert one.read("variance") == pytest.approx(spread, rel=1e-4, abs=1e-7 * spread.max())


def _vectors(made: Picture, buffers: dict[Any, Any]) -> list[np.ndarray] | None:
    if not buffers or (buffers is made._sums.block and not made._sums.open):
        return None
    return [np.frombuffer(buffer.read(), np.float32).reshape(8, 8, 4) for buffer in buffers.values()]


# One renderer, in whatever slices.


def test_the_cut_does_not_show(made: Callable[[int], Picture], slices: None) -> None:
    whole, cut = made(200), made(1)
    rng = np.random.default_rng(7)
    for end in (5, 9, 64, 65, 100, 128, 200):
        while cut.samples < end:
            cut.trace(float(rng.choice([0.0, 0.001, 0.01])), end)
    assert_same(cut, whole)


def test_an_end_within_a_block_is_no_end(made: Callable[[int], Picture]) -> None:
    whole, halves = made(200), made(100)
    assert_same(halves, made(100))
    seen(halves)  # looking changes nothing
    halves.trace(600.0, 200)
    assert_same(halves, whole)


def test_reading_while_a_block_is_merged(made: Callable[[int], Picture], slices: None) -> None:
    """It shows the same, but for the last bit: as the block's rows are merged, so are their rounding errors."""
    one, looks = made(63), list[dict[str, np.ndarray]]()
    while one.samples < 64:
        slice_of(one, 64)
        if one.under_way[1] > 37 + one._meter.lines:
            looks.append(seen(one))
    looks.append(seen(one))
    assert len(looks) > 10
    for name, values in looks[-1].items():
        bounds = {"color": 2e-7, "variance": 0.0, "noise": 1e-6}
        for look in looks:
            if name == "display":
                assert np.abs(look[name].astype(int) - values).max() <= 1
            else:
                np.testing.assert_allclose(look[name], values, rtol=bounds[name], err_msg=name)


@pytest.mark.parametrize("settings", [{}, {"adaptive": True}])
def test_saved_in_every_phase(gpu: Renderer, monkeypatch: pytest.MonkeyPatch, settings: dict[str, Any]) -> None:
    """Between two slices, of the first block, the second, its merging, and the third."""
    monkeypatch.setattr(passes, "_MERGED", 30)
    size = {**SETTINGS, "width": 16, "height": 9}
    whole, one = (picture(gpu, SCENE, n, **size, **settings) for n in (70, 1))
    states, rng = [], np.random.default_rng(8)
    while one.samples < 70:
        slice_of(one, 70)
        if one.samples < 12 or one.samples + one.under_way[0] >= 64 or rng.random() < 0.1:
            states.append(saved(one))
    merging = [s for s in states if s.under_way[0] and s.under_way[1] > 9 + one._meter.lines]
    assert settings or len(merging) > 3
    again = beside(one)
    for state in states[:: max(1, len(states) // 25)] + merging[:5] + states[-1:]:
        assert again.fits(state) and (again.samples == 0 or again.fits(state, goes_on=False))
        again.restore(state)
        assert [data.nbytes for data in saved(again).buffers] == again.state_sizes
        again.trace(600.0, 70)
        assert_same(again, whole)
    again.release()


def test_a_finished_picture_at_a_border_has_no_block(made: Callable[[int], Picture]) -> None:
    even, odd = saved(made(64)), saved(made(65))
    size = 16 * 48 * 37
    assert [data.nbytes for data in even.buffers].count(size) == 3
    assert [data.nbytes for data in odd.buffers].count(size) == 6


def test_pictures_of_earlier_versions(made: Callable[[int], Picture]) -> None:
    """They had no blocks: such a picture can be looked at, and goes on only where its samples are of the first."""
    one = made(64)
    state = saved(one)
    old = replace(state, buffers=state.buffers[:-1])
    assert one.fits(old, goes_on=False) and not one.fits(old)
    assert one.fits(replace(old, samples=5, under_way=(3, 2, 0)))
    assert not one.fits(replace(old, samples=8, under_way=(1, 2, 0)))
    assert not one.fits(replace(old, buffers=old.buffers[:-1]), goes_on=False)
    looked = beside(one)
    looked.restore(old)
    assert_same(looked, one)
    looked.release()


def test_no_memory_for_a_block(made: Callable[[int], Picture], monkeypatch: pytest.MonkeyPatch) -> None:
    """It is an error as any other, and the picture is as it was: with memory it goes on."""
    whole, one, taken = made(70), made(FIRST), 0

    def allocate(context: Any, contents: np.ndarray | int) -> Any:
        nonlocal taken
        taken += 1
        if taken == 3:
            raise OutOfMemory("the device has no 1 MiB left")
        return true_allocate(context, contents)

    true_allocate, before = contexts.allocate, seen(one)
    with monkeypatch.context() as patch:
        patch.setattr(contexts, "allocate", allocate)
        with pytest.raises(GpuError, match="MiB"):
            one.trace(600.0, 70)
    assert one.samples == FIRST and one.under_way == (0, 0, 0)
    assert all(np.array_equal(values, before[name]) for name, values in seen(one).items())
    one.trace(600.0, 70)
    assert_same(one, whole)


def test_memory_is_taken_when_the_second_block_begins(made: Callable[[int], Picture]) -> None:
    one = made(FIRST)
    assert not one._sums.block and one.state_sizes == [buffer.size for buffer in one.state]
    one.trace(600.0, FIRST + 1)
    assert len(one._sums.block) == 3
    one.reset()
    one.trace(600.0, 70)
    assert_same(one, made(70))


def test_the_first_block_is_the_meter_s_beginning() -> None:
    """The meter's pixels are drawn by what the total has then."""
    assert noise_meter.FROM == FIRST
