"""Division of tasks: which renderers assist which; leases and their results are handed on between them."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from service.ipc.channel import Encoded
from service.ipc.leases import Assist, Assistants, Lease, LeaseDone, LeaseFailed, LeaseRefuted, undivided
from service.ipc.messages import Done, Failed, Heard, ToRenderer, Update
from service.ipc.task_control import Drop, Pause, Resume, Stop

log = logging.getLogger(__name__)


class Peer(Protocol):
    """One renderer of the pool."""

    @property
    def driver(self) -> str | None:
        """The driver, which decides about equal bits; None while it cannot render."""

    @property
    def leases(self) -> Counter[str]:
        """How many leases it was given, has done, has failed to do, and has done wrong."""

    def relay(self, message: ToRenderer) -> None:
        """Send a message as it is, past the records of this renderer's own tasks."""

    def relay_encoded(self, encoded: Encoded) -> None: ...

    def scene_of(self, task: int) -> Iterable[Encoded | ToRenderer]:
        """Messages that give another renderer the scene and the settings of this one's task."""


@dataclass
class _Task:
    most: int | None  # renderers that may trace it; None: all that are free
    home: int
    adaptive: bool = False
    time_limit: float | None = None
    active: bool = False  # there are samples to be traced
    ended: bool = False
    assistants: tuple[int, ...] = ()
    unfit: frozenset[int] = frozenset()  # renderers that have failed with its scene


class Division:
    """For the event loop. Renderers are numbered by their place in `peers`."""

    def __init__(self, peers: Sequence[Peer]) -> None:
        self._peers = peers
        self._tasks: dict[int, _Task] = {}
        self._wrong: set[int] = set()  # renderers whose results were refuted: they assist nobody any more

    def opened(self, task: int, home: int, most: int | None) -> None:
        self._tasks[task] = _Task(most, home)

    def leave(self, task: int) -> None:
        """End all assistance for a task that is about to move: one of its assistants may be its next home."""
        if (entry := self._tasks.get(task)) is not None:
            self._leave(task, entry)

    def moved(self, task: int, home: int) -> None:
        """Another renderer goes on with this task, after `leave`."""
        if (entry := self._tasks.get(task)) is not None:
            entry.home = home
            self.assign()

    def dropped(self, task: int) -> None:
        entry = self._tasks.pop(task, None)
        if entry is not None:
            for each in entry.assistants:
                self._peers[each].relay(Drop(task))
            self.assign()

    def divide(self, task: int, most: int | None) -> None:
        """Let at most so many renderers trace the task; None: all that are free."""
        if (entry := self._tasks.get(task)) is not None and entry.most != most:
            entry.most = most
            self.assign()

    def renderers(self, task: int) -> int:
        """How many trace this task."""
        entry = self._tasks.get(task)
        return 1 + len(entry.assistants) if entry is not None and entry.active else 0

    def sent(self, message: ToRenderer) -> None:
        """Note what was sent to a task's home, and tell those that assist it."""
        entry = self._tasks.get(message.task)
        if entry is None:
            return
        if isinstance(message, Update):
            self._updated(message, entry)
            for each in entry.assistants:
                self._peers[each].relay(message)
            self.assign()
        elif isinstance(message, Pause | Resume | Stop):
            entry.active = isinstance(message, Resume) and not entry.ended
            self.assign()

    def scene_sent(self, update: Update, ended: bool = False) -> None:
        """The home was sent a whole scene: so are the others. `ended`: with its finished picture."""
        if (entry := self._tasks.get(update.task)) is not None:
            entry.unfit = frozenset()
            self._updated(update, entry)
            entry.active, entry.ended = not ended, ended
            for each in entry.assistants:
                self._tell_scene(update.task, entry, each)
            self.assign()

    def _updated(self, update: Update, entry: _Task) -> None:
        entry.active, entry.ended = True, False
        if update.settings is not None:
            entry.adaptive = bool(update.settings.get("adaptive"))
        if update.stop is not None:
            entry.time_limit = update.stop.time_limit

    def heard(self, message: Heard) -> None:
        """Note what a task's home has said."""
        entry = self._tasks.get(message.task)
        if entry is None:
            return
        if isinstance(message, Done):
            entry.active, entry.ended = False, True
            self.assign()
        elif isinstance(message, Failed) and message.serial is None:
            entry.active = message.fallback is not None
            self._leave(message.task, entry)  # assistants may hold a newer scene
            self.assign()

    def replayed(self, task: int) -> None:
        """A new process of the home has been told of the task: what the old one leased is forgotten there."""
        entry = self._tasks.get(task)
        if entry is not None and entry.assistants:
            self._peers[entry.home].relay(Assistants(task, entry.assistants))

    def forward(self, message: Lease | LeaseDone | LeaseFailed | LeaseRefuted, sender: int) -> None:
        """Hand on what the home and its assistants say to each other."""
        entry = self._tasks.get(message.task)
        if entry is None:
            return
        if isinstance(message, Lease):
            if message.assistant in entry.assistants:
                self._peers[message.assistant].leases["given"] += 1
                self._peers[message.assistant].relay(message)
        elif isinstance(message, LeaseRefuted):
            if sender == entry.home:
                self._refuted(message)
        elif sender not in entry.assistants:
            return
        elif isinstance(message, LeaseDone):
            self._peers[sender].leases["done"] += 1
            self._peers[entry.home].relay(message)
        else:
            self._peers[sender].leases["failed"] += 1
            log.warning(
                "a renderer cannot assist", {"task": message.task, "renderer": sender, "error": message.detail}
            )
            entry.unfit |= {sender}
            self.assign()

    def _refuted(self, message: LeaseRefuted) -> None:
        self._peers[message.assistant].leases["wrong"] += 1
        log.error(
            "two renderers got different bits for the same part of a picture: check their memory; the second one "
            "assists in no other picture",
            {"task": message.task, "home": self._tasks[message.task].home, "renderer": message.assistant},
        )
        self._wrong.add(message.assistant)
        self.assign()

    def assign(self) -> None:
        """Choose anew which renderer assists which; to be called when one has come, gone or changed."""
        active = [entry for entry in self._tasks.values() if entry.active]
        tasks = [entry for entry in active if undivided(entry.adaptive, entry.time_limit) is None]
        busy = {entry.home for entry in active}
        free = [n for n, peer in enumerate(self._peers) if n not in busy | self._wrong and peer.driver is not None]
        chosen: dict[int, list[int]] = {id(entry): [] for entry in tasks}
        share = -(-len(free) // max(1, len(tasks)))
        for entry in tasks:  # assistants go on, as far as they are still wanted
            for each in entry.assistants[:share]:
                if each in free and self._wants(entry, each, chosen[id(entry)]):
                    chosen[id(entry)].append(each)
                    free.remove(each)
        for each in free:
            wanting = [entry for entry in tasks if self._wants(entry, each, chosen[id(entry)])]
            if wanting:
                chosen[id(min(wanting, key=lambda entry: len(chosen[id(entry)])))].append(each)
        for task, entry in self._tasks.items():
            self._set(task, entry, tuple(chosen.get(id(entry), [])))

    def _wants(self, entry: _Task, renderer: int, others: Sequence[int]) -> bool:
        same = self._peers[entry.home].driver == self._peers[renderer].driver
        return same and renderer not in entry.unfit and (entry.most is None or 1 + len(others) < entry.most)

    def _set(self, task: int, entry: _Task, assistants: tuple[int, ...]) -> None:
        if assistants == entry.assistants:
            return
        before, entry.assistants = entry.assistants, assistants
        for each in before:
            if each not in assistants:
                self._peers[each].relay(Drop(task))
        for each in assistants:
            if each not in before:
                self._peers[each].relay(Assist(task))
                self._tell_scene(task, entry, each)
        self._peers[entry.home].relay(Assistants(task, assistants))

    def _leave(self, task: int, entry: _Task) -> None:
        self._set(task, entry, ())

    def _tell_scene(self, task: int, entry: _Task, assistant: int) -> None:
        for message in self._peers[entry.home].scene_of(task):
            if isinstance(message, tuple):
                self._peers[assistant].relay_encoded(message)
            else:
                self._peers[assistant].relay(message)
