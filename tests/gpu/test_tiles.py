"""A picture is cut by cost, and bound in parts: neither shows in a bit."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from gpu import Renderer
from gpu import context as contexts
from gpu.picture.first_hit import FirstHit
from gpu.picture.schedule import Tile, group_stride
from gpu.picture.tiles import BAND, LEAST_A_PASS, ROUND_S, SLICE_S, Tiles
from tests.extremes.scenes import everything
from tests.rendering import picture

SIZES = [(1, 1), (8, 8), (33, 17), (512, 512), (1000, 3), (3, 1000), (4096, 4096), (1 << 24, 1), (1, 1 << 24)]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("most", [1 << 30, (128 << 20) // 16 - 32])
@pytest.mark.parametrize("cost_s", [1e-9, 1e-6, 1e-2])
def test_tiles_cover_every_pixel_once(size: tuple[int, int], most: int, cost_s: float) -> None:
    tiles = Tiles(*size, most)
    row = column = covered = 0
    while row < size[1] and covered < 1 << 20:  # of the large ones a part
        x, y, width, height = tile = tiles.tile(row, column, 1)
        assert (x, y) == (column, row) and width > 0 and height > 0
        assert x + width <= size[0] and y + height <= size[1]
        assert (height - 1) * size[0] + width <= most
        tiles.took(tile, 1, cost_s * width * height)
        covered += width * height
        column = x + width
        if column == size[0]:
            column, row = 0, y + height
    assert covered == size[0] * size[1] or covered >= 1 << 20


def test_a_dear_band_gets_small_tiles_and_its_cheap_neighbours_large_ones() -> None:
    tiles = Tiles(512, 512, 1 << 30)
    for band in range(32):
        rate = 1e-4 if band == 20 else 1e-8
        tiles.took((0, 16 * band, 512, 16), 1, rate * 512 * 16)
    for _ in range(20):  # what is late is cheap
        tiles.took((0, 0, 512, 16), 1, 1e-8 * 512 * 16)
    assert tiles.tile(0, 0, 1) == (0, 0, 512, 320)  # up to the dear one
    _, _, width, height = tiles.tile(320, 0, 1)
    assert width * height * 1e-4 < 2 * SLICE_S
    assert tiles.pass_samples(1000) == 1


def test_a_picture_that_begins_with_the_sky_knows_from_a_smaller_one_what_is_below() -> None:
    small, large, blind = Tiles(64, 64, 1 << 30), Tiles(512, 512, 1 << 30), Tiles(512, 512, 1 << 30)
    for band in range(4):
        small.took((0, 16 * band, 64, 16), 1, (1e-8 if band < 2 else 4e-6) * 64 * 16)
    large.expect(small.rates)
    worst = {}
    for name, tiles in (("large", large), ("blind", blind)):
        row = column = 0
        worst[name] = 0.0
        while row < 512:
            x, y, width, height = tile = tiles.tile(row, column, 1)
            below = max(0, y + height - max(y, 256)) * width
            seconds = 4e-6 * below + 1e-8 * (width * height - below)
            worst[name] = max(worst[name], seconds)
            tiles.took(tile, 1, seconds)
            column = (x + width) % 512
            row = y if column else y + height
    assert worst["large"] < 2 * SLICE_S < 10 * SLICE_S < worst["blind"]


@pytest.mark.parametrize("count", [1, 3, 32])
def test_rates_of_another_size(count: int) -> None:
    tiles = Tiles(512, 16 * count, 1 << 30)
    tiles.expect(np.array([1e-6, 0.0, 3e-6]))  # the middle is unknown: as the mean
    assert tiles.cost_s == pytest.approx(2e-6) and tiles.rates.min() >= 1e-6 and tiles.rates.max() <= 3e-6
    tiles.expect(np.zeros(3))
    assert tiles.cost_s == 0


def test_what_a_picture_costs_is_the_mean_of_its_rows() -> None:
    """And not what was traced last, which may be its sky."""
    tiles = Tiles(64, 64, 1 << 30)
    for band in (3, 2, 1, 0):
        tiles.took((0, 16 * band, 64, 16), 1, (1e-8 if band < 2 else 4e-6) * 64 * 16)
    assert tiles.cost_s == pytest.approx(2e-6, rel=0.01)


@pytest.mark.parametrize("size", [256, 512, 1024, 2048, 4096])
def test_large_pictures_get_several_samples_a_pass_as_small_ones_do(size: int) -> None:
    """Beginning and ending an invocation costs as much as a third of a sample: a pixel would cost more in those."""
    tiles = Tiles(size, size, 1 << 30)
    for band in range(0, size, BAND):
        tiles.took((0, band, size, BAND), 1, 1e-7 * size * BAND)
    passes = [tiles.pass_samples(samples) for samples in range(65)]
    assert passes[:2] == [1, 1]
    assert min(passes[8:]) >= LEAST_A_PASS
    assert all(each <= max(1, samples) for samples, each in enumerate(passes))


@pytest.mark.parametrize("size", [64, 256, 512, 1024])
@pytest.mark.parametrize("sharers", [2, 4, 32, 500])
def test_passes_of_those_who_share_come_round_soon(size: int, sharers: int) -> None:
    """Each gets a pass within ROUND_S, unless passes of one sample take longer; none is shorter than it must be."""
    tiles, sample_s = Tiles(size, size, 1 << 30), 2e-7 * size * size
    tiles.took((0, 0, size, size), 1, sample_s)
    taken = tiles.pass_samples(1000, sharers)
    assert taken == 1 or taken * sample_s * sharers <= ROUND_S
    assert taken >= min(LEAST_A_PASS, int(0.99 * ROUND_S / (sample_s * sharers)))
    assert taken <= tiles.pass_samples(1000, 1)


def test_paths_that_may_be_long_begin_with_small_tiles() -> None:
    assert np.prod(Tiles(512, 512, 1 << 30, 1024).tile(0, 0, 1)[2:]) <= 1024
    assert np.prod(Tiles(512, 512, 1 << 30, 8).tile(0, 0, 1)[2:]) > 16_000


@pytest.mark.parametrize("known", [True, False])
def test_first_hits_are_traced_in_slices_of_what_they_cost(
    gpu: Renderer, monkeypatch: pytest.MonkeyPatch, known: bool
) -> None:
    """By a simulated clock: behind thousands of layers a camera ray takes as long as a whole path. Of a picture that
    was restored nothing is known."""
    now, tiles, pixel_s = [0.0], [], 5e-4
    monkeypatch.setattr("gpu.picture.first_hit.time", SimpleNamespace(perf_counter=lambda: now[0]))
    first = FirstHit(None, (512, 256), 1 << 30)

    def dispatch(tile: Tile, sample: int) -> None:
        tiles.append(tile)
        now[0] += pixel_s * tile[2] * tile[3]

    first.trace(dispatch, 1, math.inf, np.array([pixel_s if known else 0.0]))
    sizes = [width * height for _, _, width, height in tiles]
    assert sum(sizes) == 512 * 256 and first.samples == 1
    assert max(sizes) <= (8 * BAND if known else 1024)
    pixel_s = 1e-9
    for _ in range(40):
        tiles.clear()
        first.trace(dispatch, first.samples + 1, math.inf, np.zeros(1))
    assert len(tiles) < 8, "and large ones where it costs little"


@pytest.mark.parametrize("limit", [32 << 10, 100_000])
def test_a_picture_of_many_parts_is_the_same(gpu: Renderer, monkeypatch: pytest.MonkeyPatch, limit: int) -> None:
    """As on a driver that binds no more; llvmpipe drops what is written outside of a bound part."""
    whole = picture(gpu, everything(), 3, width=150, height=90)
    monkeypatch.setattr(contexts, "storage_block_bytes", lambda _: limit)
    parts = picture(gpu, everything(), 3, width=150, height=90)
    for aov in ("color", "variance", "albedo", "normal", "depth", "shape_id", "material_id", "incidence"):
        assert np.array_equal(parts.read(aov), whole.read(aov)), aov
    assert np.array_equal(parts.display(), whole.display())
    assert np.array_equal(parts.display(dtype="f4"), whole.display(dtype="f4"))
    assert parts.noise() == pytest.approx(whole.noise(), rel=1e-6)  # of its parts the sums are rounded
    for made in (whole, parts):
        made.release()
        made.scene.release()


def test_sixteen_megapixels(gpu: Renderer) -> None:
    """Accumulators of 256 MiB each, where a kernel may see 128 MiB at once: every pixel gets its sample."""
    sky = {"type": "constant", "radiance": 0.5}
    scene = {"version": 1, "camera": {"position": [0, 0, 4], "target": [0, 0, 0]}, "environment": sky,
             "materials": {}, "shapes": []}  # fmt: skip
    made = picture(gpu, scene, 1, width=4096, height=4096)
    assert (made.read() == np.float32([0.5, 0.5, 0.5, 1])).all()
    assert (made.display()[..., 3] == 255).all()
    made.release()
    made.scene.release()


@pytest.mark.parametrize("size", [(1, 1), (1, 2), (22, 2), (64, 2), (32, 17), (64, 64), (1 << 8, 1 << 8)])
def test_every_stretch_of_work_groups_comes_to_all_parts_of_a_tile(size: tuple[int, int]) -> None:
    columns, rows = size
    count = columns * rows
    stride = group_stride(count)
    places = np.arange(count, dtype=np.uint32) * np.uint32(stride) % np.uint32(count)
    assert stride * count < 1 << 32 and len(np.unique(places)) == count
    for threads in (2, 3, 16):
        for part in np.array_split(places, threads):
            for where, parts in ((part // columns, rows), (part % columns, columns)):
                upper = np.count_nonzero(2 * where >= parts) / max(len(part), 1)
                assert len(part) < 20 or abs(upper - (parts // 2) / parts) < 0.2


def test_more_work_groups_than_a_stride_can_count_keep_their_order() -> None:
    assert group_stride(1 << 16) > 1 and group_stride((1 << 16) + 1) == 1


def coprime(stride: int, groups: int) -> int:
    """The stride where it visits all groups; on a busy machine a picture is cut into tiles of any number."""
    return stride if math.gcd(stride, groups) == 1 else 1


def test_the_order_of_work_groups_never_shows(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    def pixels(stride: int | None) -> bytes:
        if stride is not None:
            monkeypatch.setattr("gpu.picture.dispatcher.group_stride", lambda groups: coprime(stride, groups))
        made = picture(gpu, everything(), 3, width=100, height=50)  # 13 x 7 work groups, the last ones in part
        return made.read().tobytes()

    assert pixels(None) == pixels(1) == pixels(45)
