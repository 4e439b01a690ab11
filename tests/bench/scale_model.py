"""A model of a divided render: N renderers, the links between them, and the front door that hands messages on.

The home's policy is not modelled but run: the simulation asks the same `Ledger` that the renderers use. Time is
simulated, event by event. The model leaves out other clients, renderers of different speeds, lost and overdue leases,
and the differences in cost between the pixels of a picture.
"""

from __future__ import annotations

import heapq
import itertools
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from gpu import Band, border_after
from service.worker.division.home import EACH
from service.worker.division.ledger import AHEAD_BYTES, LEASE_S, MOST_BYTES, PIXEL_BYTES, Ledger
from service.worker.view.frames import SLICE_S

BLOCK = 64  # samples of all blocks but the first two
_NOTHING = np.zeros(0, np.float32)


@dataclass(frozen=True)
class Costs:
    """Seconds for each pixel, and the pixels that the home traces twice."""

    sample_s: float  # of one sample
    write_s: float  # to write a result into the home's picture
    merge_s: float  # to merge a block
    meter_pixels: int = 2048  # of the noise meter, which gets its samples when the picture has its own

    def ending_s(self, pixels: int, samples: int = BLOCK) -> float:
        """Seconds for each of a picture's pixels in which the home ends a block of that many samples."""
        return self.merge_s + samples * self.sample_s * min(1.0, self.meter_pixels / pixels)


@dataclass(frozen=True)
class Network:
    """Each host has one link, as fast in both directions. The front door is a host of its own."""

    bytes_per_s: float
    latency_s: float = 0.0  # one way
    door_byte_s: float = 0.0  # processor time of the front door
    door_message_s: float = 0.0


@dataclass(frozen=True)
class Work:
    width: int
    height: int
    samples: int

    @property
    def pixels(self) -> int:
        return self.width * self.height


@dataclass
class Outcome:
    seconds: float
    busy: dict[str, float]  # share of the time that each has to do


def limits(costs: Costs, network: Network, work: Work) -> dict[str, float]:
    """The highest speed-up that each part allows, were the others infinitely fast: one renderer's time for a block
    over the time that this part takes for its results."""
    block_s = BLOCK * costs.sample_s + costs.ending_s(work.pixels)
    message_pixels = min(MOST_BYTES / PIXEL_BYTES, LEASE_S / (BLOCK * costs.sample_s))
    door_s = PIXEL_BYTES * network.door_byte_s + 2 * network.door_message_s / message_pixels
    needs = {
        "home": costs.write_s + costs.ending_s(work.pixels),
        "link": PIXEL_BYTES / network.bytes_per_s,
        "front door": door_s,
    }
    return {name: block_s / s if s else np.inf for name, s in needs.items()}


def steady_speedup(costs: Costs, network: Network, work: Work, renderers: int) -> float:
    """The speed-up in the middle of a render in closed form, with no regard to latency.

    All renderers work all the time, and the home also writes the results of the others and ends the blocks: n T =
    64 c + m + w (n - 1) T / (64 c) for each pixel, where T is the time of a block.
    """
    free = renderers - (renderers - 1) * costs.write_s / (BLOCK * costs.sample_s)
    return min(free, *limits(costs, network, work).values()) if renderers > 1 else 1.0


def speedup(costs: Costs, network: Network, work: Work, renderers: int) -> float:
    """The speed-up of a whole render in closed form, with no regard to latency and to waiting at its end.

    The home traces the first block alone. Meanwhile the others trace ahead, until their results fill the memory that
    the home has for them; it writes and merges these later, as all others.
    """
    if renderers == 1:
        return 1.0
    steady, most = steady_speedup(costs, network, work, renderers), limits(costs, network, work)
    first = min(border_after(0), work.samples)
    first_s = first * costs.sample_s  # of a pixel, as all below
    ends_s = -(-work.samples // BLOCK) * costs.ending_s(work.pixels)
    alone_s = work.samples * costs.sample_s + ends_s
    ahead_s = BLOCK * costs.sample_s * AHEAD_BYTES / PIXEL_BYTES / work.pixels
    ahead_s = min(ahead_s, first_s * min(renderers - 1, most["link"], most["front door"]), alone_s - first_s)
    rest_s = alone_s - first_s
    return alone_s / (first_s + max((rest_s - ahead_s) / steady, rest_s / most["home"]))


def simulate(costs: Costs, network: Network, work: Work, renderers: int) -> Outcome:
    """The time of one render that has all renderers to itself."""
    return _Simulation(costs, network, work, renderers).run()


@dataclass
class _Queue:
    """Something that does one thing after the other, in the order in which they come."""

    free_at: float = 0.0
    busy_s: float = 0.0

    def take(self, now: float, seconds: float) -> float:
        """When it will have done a thing that takes `seconds`, and comes now."""
        self.free_at = max(now, self.free_at) + seconds
        self.busy_s += seconds
        return self.free_at


@dataclass
class _Assistant:
    link: _Queue = field(default_factory=_Queue)
    leases: deque[tuple[int, Band]] = field(default_factory=deque)
    tracing: bool = False
    busy_s: float = 0.0


class _Clock:
    """Simulated time, and what is to happen when; at one time in the order in which it was planned."""

    def __init__(self) -> None:
        self.now = 0.0
        self._planned: list[tuple[float, int, Callable[[], None]]] = []
        self._order = itertools.count()

    def at(self, when: float, act: Callable[[], None]) -> None:
        heapq.heappush(self._planned, (when, next(self._order), act))

    def advance(self) -> bool:
        """Have the next thing happen; False where nothing is planned."""
        if not self._planned:
            return False
        self.now, _, act = heapq.heappop(self._planned)
        act()
        return True


class _FrontDoor:
    """The host through which all messages go. Those that hold no result take no time on the links."""

    def __init__(self, network: Network, clock: _Clock) -> None:
        self._network, self._clock = network, clock
        self.into, self.processor, self.out = _Queue(), _Queue(), _Queue()

    def pass_lease(self, then: Callable[[], None]) -> None:
        """From the home to an assistant, where `then` happens."""
        net, clock = self._network, self._clock

        def at_door() -> None:
            clock.at(self.processor.take(clock.now, net.door_message_s) + net.latency_s, then)

        clock.at(clock.now + net.latency_s, at_door)

    def pass_result(self, link: _Queue, size: int, then: Callable[[], None]) -> None:
        """From the assistant's link into the door's, through the door, out of it, and into the home's, where `then`
        happens. The parts of a message follow each other, so that two links with nothing else to do take the time of
        one."""
        net, clock = self._network, self._clock
        link_s = size / net.bytes_per_s

        def at_door() -> None:
            clock.at(self.into.take(clock.now - link_s, link_s), in_door)

        def in_door() -> None:
            clock.at(self.processor.take(clock.now, net.door_message_s + size * net.door_byte_s), out_of_door)

        def out_of_door() -> None:
            clock.at(self.out.take(clock.now, link_s) + net.latency_s, then)

        clock.at(link.take(clock.now, link_s) + net.latency_s, at_door)


class _Simulation:
    """The home's policy and what the assistants do with their leases."""

    def __init__(self, costs: Costs, network: Network, work: Work, renderers: int) -> None:
        self._costs, self._work = costs, work
        self._clock = _Clock()
        self._door = _FrontDoor(network, self._clock)
        self._renderers = renderers
        self._assistants = [_Assistant() for _ in range(renderers - 1)]
        self._ledger = Ledger(work.width, work.height, work.samples, itertools.count())
        self._since = min(border_after(0), work.samples)  # the home traces the first block alone
        self._left_s = self._since * work.pixels * costs.sample_s  # of what the home traces now
        self._band: Band | None = None
        self._inbox: deque[int] = deque()
        self._working = self._ended = False
        self._traced_s = self._written_s = self._merged_s = 0.0

    def run(self) -> Outcome:
        self._give()
        self._wake()
        while not self._ended and self._clock.advance():
            pass
        assert self._ended, "the simulated render has come to a standstill"
        busy = {
            "tracing": self._traced_s + sum(each.busy_s for each in self._assistants),
            "home": self._traced_s + self._written_s + self._merged_s,
            "home's merging": self._written_s + self._merged_s,
            "link": max(self._door.into.busy_s, self._door.out.busy_s),
            "front door": self._door.processor.busy_s,
        }
        busy["tracing"] /= self._renderers
        return Outcome(self._clock.now, {name: seconds / self._clock.now for name, seconds in busy.items()})

    # The home.

    def _wake(self) -> None:
        if not self._working:
            self._step()

    def _spend(self, seconds: float, then: Callable[[], None]) -> None:
        def done() -> None:
            self._working = False
            then()
            self._give()
            self._wake()

        self._working = True
        self._clock.at(self._clock.now + seconds, done)

    def _step(self) -> None:
        """What the home does next: take a result, trace a slice, merge, or wait."""
        ledger, costs = self._ledger, self._costs
        while self._inbox:
            result = ledger.delivered(self._inbox.popleft(), _NOTHING)
            self._give()
            if result is not None:
                self._write(result[0].rows)
                return
        if self._left_s > 0.0:
            self._trace()
        elif ledger.current is None:
            parked = [band.rows for band, _ in ledger.begin(self._since)]
            self._spend_writing(sum(parked), lambda: None)
        elif ledger.complete:
            samples = ledger.current.end - ledger.current.first
            ending_s = costs.ending_s(self._work.pixels, samples) * self._work.pixels
            self._merged_s += ending_s
            self._spend(ending_s, self._finish_block)
        else:
            self._band = ledger.take(costs.sample_s, self._renderers)
            if self._band is not None:
                self._left_s = self._seconds(self._band)
                self._trace()

    def _trace(self) -> None:
        slice_s = min(SLICE_S, self._left_s)
        self._traced_s += slice_s

        def traced() -> None:
            self._left_s = 0.0 if self._left_s - slice_s < 1e-12 else self._left_s - slice_s
            if self._left_s == 0.0 and self._band is not None:
                self._ledger.did(self._band.rows)
                self._band = None
            if self._since >= self._work.samples and self._left_s == 0.0:
                self._ended = True  # of one block only

        self._spend(slice_s, traced)

    def _write(self, rows: int) -> None:
        self._spend_writing(rows, lambda: self._ledger.did(rows))

    def _spend_writing(self, rows: int, then: Callable[[], None]) -> None:
        seconds = self._costs.write_s * rows * self._work.width
        self._written_s += seconds
        self._spend(seconds, then)

    def _finish_block(self) -> None:
        assert self._ledger.current is not None
        self._since = self._ledger.current.end
        self._ledger.finished()
        self._ended = self._since >= self._work.samples

    def _give(self) -> None:
        """As `division.home.Home._give`."""
        for _ in range(EACH):
            for number, assistant in enumerate(self._assistants):
                if self._ledger.count(number) >= EACH:
                    continue
                given = self._ledger.lease(
                    number, self._since, self._costs.sample_s, self._renderers, self._clock.now
                )
                if given is None:
                    return
                self._door.pass_lease(partial(self._hear_lease, assistant, given))

    # The assistants.

    def _hear_lease(self, assistant: _Assistant, lease: tuple[int, Band]) -> None:
        assistant.leases.append(lease)
        self._assist(assistant)

    def _assist(self, assistant: _Assistant) -> None:
        if assistant.tracing or not assistant.leases:
            return
        number, band = assistant.leases.popleft()
        assistant.tracing = True
        seconds = self._seconds(band)
        assistant.busy_s += seconds

        def traced() -> None:
            assistant.tracing = False
            size = PIXEL_BYTES * self._work.width * band.rows
            self._door.pass_result(assistant.link, size, lambda: self._hear_result(number))
            self._assist(assistant)

        self._clock.at(self._clock.now + seconds, traced)

    def _hear_result(self, number: int) -> None:
        self._inbox.append(number)
        self._wake()

    def _seconds(self, band: Band) -> float:
        return band.rows * band.count * self._work.width * self._costs.sample_s
