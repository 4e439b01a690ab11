"""Decides whose turn it is: clients share the GPU equally, and a picture that nobody has seen yet goes first, or one
that has not been seen for long."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Hashable
from dataclasses import dataclass
from typing import NamedTuple, Protocol, TypeVar
from weakref import WeakKeyDictionary

# How much more than the least served a client may have had and still be preferred for its first frame (s). Without a
# bound, a slider that never rests starves the others; below some frames' worth, every drag stutters beside a render.
FIRST_FRAME_LEAD_S = 0.5
# The seconds that a client waits at most for all others to catch up with it. A turn that can't be interrupted, as one
# that loads a kernel, takes as long as ten others, and 32 clients would take 32 times that to catch up in full.
CATCH_UP_S = 0.5
TURN_S = 0.03  # no lead: the length of an ordinary turn, a slice and the tile that is under way at its end
# What a client had beyond that lead it owes, and pays back as a surcharge on its turns: this share of each. It owes
# no more than so many seconds; for the rest of a longer turn it waits until each of the others has had as much.
SURCHARGE, MOST_OWED_S = 0.125, 1.0
# A task that has waited for a frame for longer than this (s) goes first, up to this share of the device. With equal
# time alone the costliest scenes of a crowd wait twice as long as the mean one.
LATE_S, LATE_SHARE = 2.0, 1 / 16


@dataclass
class Account:
    """The use of the device by a client, or by a task of its client's part, in seconds of virtual time."""

    used_s: float = 0.0
    counted_s: float = 0.0  # without what is owed; the account with the least goes next

    def charge(self, seconds: float) -> None:
        self.counted_s += seconds + min(self.used_s - self.counted_s, SURCHARGE * seconds)
        self.used_s += seconds

    def level(self, now_s: float) -> None:
        """Start level with the others after a rest. This gives no credit for the rest, which pays what was owed."""
        self.counted_s = max(self.counted_s, now_s)
        self.used_s = max(self.used_s, self.counted_s)

    def defer(self, most_s: float) -> None:
        """Owe what counts beyond `most_s`, as far as more can be owed."""
        self.counted_s = max(min(self.counted_s, most_s), self.used_s - MOST_OWED_S)


class Seen(NamedTuple):
    """The use of the device by everybody, a task's client and the task when the task's last frame was sent (s)."""

    all_s: float
    client_s: float
    task_s: float


class Turn(Protocol):
    account: Account  # within its client
    client: str

    @property
    def ready(self) -> bool:
        """True if it has something to do."""

    @property
    def unseen(self) -> bool:
        """True if somebody waits for its first frame."""

    @property
    def wanted(self) -> bool:
        """True if somebody waits for its next frame."""


T = TypeVar("T", bound=Turn)


class Scheduler:
    """Virtual time: the client served least goes next, and of its tasks the one served least.

    A client that was idle starts level with the others and gets no credit for its rest. Time beyond its share is
    remembered until the others have caught up, or until the client has paid it back.
    """

    def __init__(self) -> None:
        self._accounts: dict[str, Account] = defaultdict(Account)
        self._now_s = 0.0
        self._waiting: set[Hashable] = set()
        self._ready: dict[str, int] = {}  # tasks, by client, at the last choice
        self._all_s = 0.0  # that everybody has used
        self._seen = WeakKeyDictionary[Turn, Seen]()

    def choose(self, tasks: Collection[T]) -> T | None:
        ready: dict[str, list[T]] = defaultdict(list)
        for task in tasks:
            if task.ready:
                ready[task.client].append(task)
        self._ready = {client: len(tasks) for client, tasks in ready.items()}
        self._level(ready)
        if not ready:
            return None
        accounts = self._accounts
        within = self._now_s + FIRST_FRAME_LEAD_S
        first = [task for tasks in ready.values() for task in tasks if task.unseen]
        eager = {task.client for task in first if accounts[task.client].used_s <= within}
        late = {} if eager else {name: max(map(self._late_s, tasks)) for name, tasks in ready.items()}
        client = min(eager or ready, key=lambda name: (-late.get(name, 0.0), accounts[name].counted_s))
        candidates = [task for task in ready[client] if task.unseen] if eager else ready[client]
        return min(candidates, key=lambda task: (-self._late_s(task, within=True), task.account.counted_s))

    def shown(self, task: Turn) -> None:
        """Somebody has got a frame of it."""
        self._seen[task] = Seen(self._all_s, self._accounts[task.client].used_s, task.account.used_s)

    def _late_s(self, task: Turn, within: bool = False) -> float:
        """Seconds that a task has waited for its next frame; 0 where these are few, and 0 once its client's share
        since the last frame is used up (`within` the client: the task's share)."""
        seen = self._seen.get(task)
        if seen is None or not task.wanted:
            return 0.0
        waited_s = self._all_s - seen.all_s
        used_s = task.account.used_s - seen.task_s if within else self._accounts[task.client].used_s - seen.client_s
        return waited_s if waited_s > LATE_S and used_s < LATE_SHARE * waited_s else 0.0

    def sharers(self, client: str) -> int:
        """The number of equal shares into which the last choice parted the device, for a task of this client."""
        return max(1, len(self._ready) * self._ready.get(client, 1))

    def charge(self, task: Turn, seconds: float) -> None:
        self._all_s += seconds
        task.account.charge(seconds)
        self._accounts[task.client].charge(seconds)

    def _level(self, ready: dict[str, list[T]]) -> None:
        """Raise the virtual time of clients that have just become ready to that of the others, and have nobody too
        far ahead. The same among the tasks of each client."""
        waiting: set[Hashable] = {*ready, *(id(task) for tasks in ready.values() for task in tasks)}
        clients = [(self._accounts[client], client in self._waiting) for client in ready]
        self._now_s = _level(clients, self._now_s, len(ready))
        for client, tasks in ready.items():
            _level([(task.account, id(task) in self._waiting) for task in tasks], 0.0, self.sharers(client))
        self._waiting = waiting
        for client in [name for name in self._accounts if name not in ready]:
            if self._accounts[client].used_s <= self._now_s:
                del self._accounts[client]


def _level(accounts: Collection[tuple[Account, bool]], now_s: float, sharers: int) -> float:
    """Level accounts, each with whether it was waiting before. Returns what the least served has had; where nobody
    was waiting that is at least `now_s`."""
    now_s = min((account.counted_s for account, waited in accounts if waited), default=now_s)
    for account, waited in accounts:
        if not waited:
            account.level(now_s)
    now_s = min((account.counted_s for account, _ in accounts), default=now_s)
    for account, _ in accounts:
        account.defer(now_s + max(TURN_S, CATCH_UP_S / sharers))
    return now_s
