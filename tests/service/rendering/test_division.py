"""A divided picture: every band of every block is traced, written once and merged in order, whatever happens."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from gpu import Band, OutOfMemory, Renderer, RenderSettings, Saved, Steps, border_after
from gpu.picture.accumulators import Accumulators
from service.ipc.leases import Lease, LeaseDone, LeaseRefuted
from service.ipc.messages import Failed, Progress, Restore, StopRule, Update, driver_of
from service.server.renders.store.pictures import PictureFiles
from service.worker.context import WorkerContext
from service.worker.division.assistant import Assistant
from service.worker.division.home import Home
from service.worker.division.ledger import MOST_BYTES, PIXEL_BYTES, Ledger
from service.worker.helpers.denoise_client import DenoiseClient
from service.worker.payloads import saved_bands, saved_picture, sent_picture
from service.worker.task import Task
from tests.supervisors import arrays_of

FIRST, SIZE = 8, 64  # samples: the first border, and the distance of the others
WIDTH, HEIGHT = 512, 300


@dataclass
class _Picture:
    """Counts the samples of each row, and complains of what would change a real picture's bits."""

    samples: int = FIRST
    shared: bool = False
    cost_s: float = 1e-7
    short: int = 0  # how many times there is no memory for a block
    settings: RenderSettings = field(default_factory=lambda: RenderSettings(WIDTH, HEIGHT))

    def __post_init__(self) -> None:
        self.done = np.zeros(HEIGHT, int)
        self.own, self.end, self.at = 0, 0, 0
        self.counts = (0, 0)
        self.under_way = (0, 0, 0)  # samples: of a pass that merges

    @property
    def block(self) -> _Picture:
        """It is its own shared block."""
        return self

    @property
    def own_done(self) -> bool:
        return bool((self.done[: self.own] == self.end - self.samples).all())

    def allocate(self) -> None:
        self.short -= 1
        if self.short >= 0:
            raise OutOfMemory("the device has no 1 MiB left")

    def share(self, rows: int, end: int) -> None:
        assert self.short < 0, "no memory, and nobody asked for it"
        assert border_after(self.samples - 1) == self.samples and not self.shared and not self.under_way[0]
        assert self.samples < end <= border_after(self.samples)
        self.shared, self.own, self.end = True, rows, end
        self.done[:] = 0

    def trace(self, budget_s: float, most: int) -> None:
        if self.under_way[0]:
            self.samples, self.under_way = self.end, (0, 0, 0)
        elif not self.shared:
            self.samples = min(self.samples + 8, most, border_after(self.samples))
        else:
            self.done[: self.own] = np.minimum(self.done[: self.own] + 20, self.end - self.samples)

    def trace_band(self, band: Band, budget_s: float) -> bool:
        self.at += 1
        if self.at % 3:
            return False
        self.write_band(band, np.zeros(0))
        return True

    def write_band(self, band: Band, values: Any) -> None:
        rows = slice(band.top, band.top + band.rows)
        assert self.shared and band.first == self.samples and band.first + band.count == self.end
        assert (self.done[rows] == 0).all(), "written twice, or traced here as well"
        self.done[rows] = band.count

    def read_band(self, band: Band) -> Any:
        return np.zeros(0)

    def add_counts(self, counts: tuple[int, int]) -> None:
        self.counts = self.counts[0] + counts[0], self.counts[1] + counts[1]

    def unshare(self) -> None:
        self.shared = False

    def complete(self) -> None:
        assert (self.done == self.end - self.samples).all() and self.shared
        self.shared, self.under_way = False, (self.end - self.samples, 0, 0)


def _home(picture: _Picture, ids: tuple[int, ...]) -> tuple[Home, list[Lease]]:
    leases: list[Lease] = []
    home = Home(1, cast(Callable[[Any], None], leases.append))
    home.assist(ids)
    return home, leases


def _turn(home: Home, picture: _Picture, end: int, progressive: bool = False) -> None:
    cap = home.cap(cast(Any, picture), end, 1, FIRST, progressive)
    if picture.block.shared:
        if not home.waiting:
            home.trace(0.01)
    else:
        picture.trace(0.01, cap)


@pytest.mark.parametrize("progressive", [False, True])
@pytest.mark.parametrize("seed", range(8))
def test_all_rows_come_once_and_in_order(seed: int, progressive: bool) -> None:
    """Results in any order, doubled, of unknown leases; renderers that come and go."""
    chance, picture, end = random.Random(seed), _Picture(), 300
    home, leases = _home(picture, (7, 8))
    had: list[Lease] = []
    for _ in range(10_000):
        if picture.samples == end:
            break
        _turn(home, picture, end, progressive)
        if leases and chance.random() < 0.7:
            lease = leases.pop(chance.randrange(len(leases)))
            had.append(lease)
            for each in (lease, chance.choice(had)):
                home.heard(LeaseDone(1, chance.choice((1, 0)), each.number, np.zeros(0)))
                home.heard(LeaseDone(1, 1, each.number, np.zeros(0)))
        if chance.random() < 0.05:
            ids = chance.choice([(7, 8), (7,), (), (9,)])
            leases[:] = [lease for lease in leases if lease.assistant in ids]
            home.assist(ids)
    assert picture.samples == end


def test_assistants_do_most_of_it_where_they_answer_at_once() -> None:
    picture = _Picture()
    home, leases = _home(picture, (1, 2, 3))
    rows = 0
    while picture.samples < 256:
        _turn(home, picture, 256)
        while leases:
            rows += leases[0].rows * leases[0].count
            home.heard(LeaseDone(1, 1, leases.pop(0).number, np.zeros(0)))
    assert rows > 0.6 * HEIGHT * (256 - FIRST)


def test_a_lease_that_never_comes_back_is_traced_at_home(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr("service.worker.division.home.time.monotonic", lambda: now[0])
    picture = _Picture()
    home, leases = _home(picture, (1,))
    for _ in range(1000):
        _turn(home, picture, SIZE)
    assert home.waiting and picture.samples == FIRST
    assert 0 < home.left_s < 10
    now[0] += home.left_s + 0.01
    for _ in range(100):
        _turn(home, picture, SIZE)
        now[0] += 10
    assert picture.samples == SIZE
    home.heard(LeaseDone(1, 1, leases[0].number, np.zeros(0)))  # late, and dropped


def test_while_somebody_looks_on_an_untouched_block_is_traced_at_once_here() -> None:
    picture = _Picture(samples=SIZE)
    home, leases = _home(picture, (1,))
    _turn(home, picture, 1000, progressive=True)
    assert not picture.block.shared and picture.samples == SIZE + 8
    assert {lease.first for lease in leases} == {2 * SIZE}


def test_without_assistants_nothing_is_shared() -> None:
    picture = _Picture()
    home, leases = _home(picture, ())
    assert home.cap(cast(Any, picture), 1000, 1, FIRST, False) == 1000
    assert not picture.block.shared and not leases


def test_what_was_leased_before_an_edit_is_dropped() -> None:
    picture = _Picture()
    home, leases = _home(picture, (1,))
    _turn(home, picture, 1000)
    old = leases[0]
    edited = _Picture()
    home.cap(cast(Any, edited), 1000, 2, FIRST, False)
    home.heard(LeaseDone(1, 1, old.number, np.zeros(0)))
    home.heard(LeaseDone(1, 2, old.number, np.zeros(0)))
    assert not edited.done.any()


def test_a_render_that_is_to_end_earlier_does_not_go_past_its_end() -> None:
    picture = _Picture(samples=SIZE)
    home, leases = _home(picture, (1,))
    _turn(home, picture, 1000)
    assert picture.block.shared
    old = leases[0].number
    for _ in range(100):
        _turn(home, picture, 70)
        for lease in leases[1:]:
            home.heard(LeaseDone(1, 1, lease.number, np.zeros(0)))
    assert picture.samples == 70
    home.heard(LeaseDone(1, 1, old, np.zeros(0)))


def test_what_was_done_of_a_long_block_is_saved_and_not_traced_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr("service.worker.division.home.time.monotonic", lambda: now[0])
    picture = _Picture(samples=SIZE)
    home, leases = _home(picture, (1,))
    for _ in range(20):
        _turn(home, picture, 1000)
    assert not home.bands(), "a block that has just begun is not worth it"
    later = [lease for lease in leases if lease.first > SIZE]
    for lease in leases[:2] + later[:1]:
        home.heard(LeaseDone(1, 1, lease.number, np.zeros(0)))
    now[0] += 10
    bands = home.bands()
    assert bands and {band.first for band, _ in bands} <= {SIZE, 2 * SIZE}
    again = _Picture(samples=SIZE)
    second, _ = _home(again, ())
    second.resume(bands)
    _turn(second, again, 1000)
    assert again.block.shared
    for band, _ in bands:
        if band.first == SIZE:
            assert (again.done[band.top : band.top + band.rows] == SIZE).all()
    while again.samples < 3 * SIZE:  # the picture complains where rows come twice
        _turn(second, again, 1000)


def test_paths_that_were_cut_elsewhere_are_counted_once() -> None:
    picture = _Picture()
    home, leases = _home(picture, (1,))
    _turn(home, picture, 1000)
    for _ in range(2):
        home.heard(LeaseDone(1, 1, leases[0].number, np.zeros(0), (3, 2)))
    assert picture.counts == (3, 2)


@pytest.mark.parametrize("progressive", [False, True])
def test_a_block_without_memory_is_begun_again_and_lacks_nothing(progressive: bool) -> None:
    picture = _Picture(short=2)
    home, leases = _home(picture, (1,))
    for _ in range(2):
        with pytest.raises(OutOfMemory):
            _turn(home, picture, 200, progressive)
    answered = 0
    for _ in range(3000):
        _turn(home, picture, 200, progressive)
        for lease in leases[answered:]:
            home.heard(LeaseDone(1, 1, lease.number, np.zeros(0)))
            answered += 1
    assert picture.samples == 200 and answered


def test_an_idle_picture_makes_room_for_a_block_that_is_shared(
    gpu: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the driver has less memory than is allowed, at home, at an assistant and where a picture comes back."""
    sent: list[Any] = []
    context = WorkerContext(gpu, sent.append, DenoiseClient())
    arrays = arrays_of("plain")

    def begun(number: int) -> Update:
        return Update(number, 1, arrays, {"width": 32, "height": 32}, StopRule(1 if number == 9 else 72))

    def resting() -> Task:
        idle = Task(context, 9)
        idle.update(begun(9))
        while idle.ready:
            idle.turn()
        context.memory._holders = lambda: [idle]
        assert idle.bytes and idle.idle
        return idle

    def scarce(self: Accumulators) -> None:
        if idle.bytes and not self.block:
            raise OutOfMemory("the device has no 1 MiB left")
        allocate(self)

    allocate, idle = Accumulators.allocate_block, resting()
    home = Task(context, 1)
    home.update(begun(1))
    home.picture.home.assist((7,))
    monkeypatch.setattr(Accumulators, "allocate_block", scarce)
    while not home.picture.home.sharing and home.ready:
        home.turn()
    assert home.picture.home.sharing and not idle.bytes

    lease = next(message for message in sent if isinstance(message, Lease))
    idle, helper = resting(), Assistant(context, 1)
    helper.update(begun(1))
    helper.lease(lease)
    while helper.ready:
        helper.turn()
    assert isinstance(sent[-1], LeaseDone) and not idle.bytes

    full = home.picture.residency.full
    full.block.unshare()
    full.trace(600.0, 16)
    picture = sent_picture(Steps(full.save()).finish(), driver_of(gpu.info))
    idle, back = resting(), Task(context, 2)
    back.update(begun(2))
    back.turn()
    back.picture.restore(Restore(2, 1, picture, None, Progress(16, None, 0.0, None)))
    assert back.picture.residency.full.samples == 16 and not idle.bytes
    assert not any(isinstance(message, Failed) for message in sent)
    for each in (home, helper, idle, back):
        each.release()


@pytest.mark.parametrize("wrong", [None, 1])
def test_results_are_traced_again_and_compared(wrong: int | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """The picture has the home's bits then; whoever sends others assists no more, and its results are dropped."""
    monkeypatch.setattr("service.worker.division.home.CHECKED", 1.0)
    monkeypatch.setattr(_Picture, "read_band", lambda self, band: np.full(3, band.top, np.float32))
    picture = _Picture()
    home, sent = _home(picture, (1, 2))
    answered, refuted = 0, 0
    for _ in range(4000):
        _turn(home, picture, 200)
        for message in list(sent[answered:]):
            answered += 1
            if isinstance(message, LeaseRefuted):
                assert message == LeaseRefuted(1, 1, 1) and wrong
                refuted = answered
            else:
                assert not refuted or message.assistant != wrong
                values = np.full(3, message.top + (message.assistant == wrong), np.float32)
                home.heard(LeaseDone(1, 1, message.number, values))
    assert picture.samples == 200 and bool(refuted) == bool(wrong)


def test_a_result_is_never_too_large() -> None:
    for width in (1, 16, 4096, 16384, 65536):
        ledger = Ledger(width, 4096, 1000, count(1))
        given = ledger.lease(1, SIZE, 1e-12, 2, 0.0)
        assert given is not None
        assert given[1].rows * width * PIXEL_BYTES <= max(MOST_BYTES, width * PIXEL_BYTES)


def test_what_waits_for_its_turn_has_a_bound() -> None:
    ledger = Ledger(4096, 4096, 1 << 24, count(1))
    ledger.begin(SIZE)
    ledger.window()
    while ledger.lease(1, SIZE, 1e-9, 2, 0.0) is not None:
        pass
    assert sum(lease.band.rows for lease in ledger.outstanding.values()) * 4096 * PIXEL_BYTES <= 256 << 20


def test_bands_travel_with_a_checkpoint_and_through_its_file(tmp_path: Path) -> None:
    rng, size = np.random.default_rng(3), RenderSettings(16, 24)
    state = [np.arange(5, dtype=np.uint8), np.zeros(0, np.uint8)]
    done = [
        (Band(64, 64, top, rows), rng.random((rows, 16, 12)).astype(np.float32)) for top, rows in ((0, 8), (20, 4))
    ]
    sent = sent_picture(Saved(size, 64, (0, 0, 0), state), "a driver", done)
    files = PictureFiles(tmp_path)
    files.write("id", "checkpoint", Restore(3, 1, sent, None, Progress(64)))
    read = files.read("id", "checkpoint", 3).saved
    for each in (sent, read):
        bands = saved_bands(each, size)
        assert [band for band, _ in bands] == [band for band, _ in done] and each.driver == "a driver"
        assert all(np.array_equal(a, b) for (_, a), (_, b) in zip(bands, done, strict=True))
        assert [part.tolist() for part in saved_picture(each, size).buffers] == [part.tolist() for part in state]
