"""A task as the server has it, and the messages that a new renderer needs in order to go on with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from service.ipc import channel
from service.ipc.channel import Encoded
from service.ipc.messages import (
    Checkpoint,
    Done,
    EvaluateBsdf,
    Failed,
    Frame,
    Heard,
    Image,
    Loaded,
    Progressed,
    Read,
    Restore,
    SavedPicture,
    StopRule,
    ToRenderer,
    Update,
    Want,
)
from service.ipc.task_control import ApplyNow, Pause, Resume, Stop
from service.renderers.protocol import Listener
from service.renderers.statistics import Kind

# A picture that the server has in memory, or can read from where it was stored; that is not for an event loop.
StoredPicture = Restore | Callable[[], Restore]


@dataclass
class _State:
    """A scene as it was sent, in the memory that the renderer maps too, and what was changed of it since. It begins
    with a generation that may have been too much for the renderer."""

    scene: Encoded
    whole: bool  # the scene was that generation's, and not an earlier one's
    since: Update | None = None


class ReplayLog:
    """One task's state as the renderer has it. `close` frees the memory of its scenes."""

    def __init__(self, task: int) -> None:
        self.reads: dict[int, Read] = {}  # not answered yet
        self._question: EvaluateBsdf | None = None  # not answered yet: an answer ends its task
        self.saved: StoredPicture | None = None  # a finished picture
        self._checkpoint: StoredPicture | None = None  # one under way
        self._driver = ""
        self._task = task
        self._states = WorkingStates[_State](lambda state: channel.discard(state.scene))
        self._want: Want | None = None
        self._stopped = False
        self._paused: Pause | Resume | None = None
        self._stopped_at: Done | None = None

    @property
    def stored_picture(self) -> StoredPicture | None:
        """The picture as the server keeps it, if it does."""
        return self.saved or self._checkpoint

    @property
    def away(self) -> bool:
        """True if it is a stream's that nobody attends."""
        return isinstance(self._paused, Pause) and self._paused.away

    @property
    def driver(self) -> str:
        """The driver whose bits the kept picture under way has; "" where there is none, or nobody knows."""
        return "" if self._checkpoint is None else self._driver

    def stored(self, picture: SavedPicture, read: Callable[[], Restore]) -> None:
        """A picture is on the disk, from where `read` gives it: it need not stay in memory."""
        if isinstance(self.saved, Restore) and self.saved.saved is picture:
            self.saved = read
        elif isinstance(self._checkpoint, Restore) and self._checkpoint.saved is picture:
            self._checkpoint = read

    def forget(self) -> None:
        """The picture under way that the server keeps can't be read: the render begins again."""
        self._checkpoint = None

    def note_scene(self, update: Update, encoded: Encoded) -> None:
        self._push(update.generation, _State(channel.another(encoded), whole=True))

    def restored(self, restore: Restore) -> None:
        """The server had this picture already: the render goes on from it, or has ended with it."""
        if restore.reason is None:
            self._checkpoint, self._driver = restore, restore.saved.driver
        else:
            self.saved = restore

    def note(self, message: ToRenderer) -> None:
        if isinstance(message, Update):
            self._edited(message)
        elif isinstance(message, Want):
            self._want = message
        elif isinstance(message, Read):
            self.reads[message.serial] = message
        elif isinstance(message, EvaluateBsdf):
            self._question = message
        elif isinstance(message, Pause | Resume):
            self._paused = message
        elif isinstance(message, Stop):
            self._stopped = True

    def heard(self, message: Heard) -> Heard:
        """Note what a message changes; the message as the task's listener is to get it."""
        if isinstance(message, Failed):
            if message.serial is not None:
                self.reads.pop(message.serial, None)
            else:
                self._fall_back(message)
        elif isinstance(message, Image):
            self.reads.pop(message.serial, None)
        elif isinstance(message, Loaded | Frame | Progressed | Checkpoint | Done):
            self._states.works(message.generation)
        if isinstance(message, Checkpoint):
            self._checkpoint = Restore(message.task, message.generation, message.saved, None, message.progress)
            self._driver = message.saved.driver
        if isinstance(message, Frame) and self._want is not None and self._want.serial == message.serial:
            self._want = None
        return self._done(message) if isinstance(message, Done) else message

    def scenes(self) -> list[Encoded | ToRenderer]:
        """Messages that give another renderer the same scenes, in order; the caller owns the descriptors of encoded
        ones."""
        out: list[Encoded | ToRenderer] = []
        for number, (_, state) in enumerate(self._states.items()):
            if number:  # joined with the one before, that would be lost with it
                out.append(ApplyNow(self._task))
            out.append(channel.another(state.scene))
            if state.since is not None:
                out.append(state.since)
        return out

    def again(self, picture: Encoded | None = None) -> list[Encoded | ToRenderer]:
        """Messages for a new renderer, in order; the caller owns the descriptors of encoded ones."""
        out = self.scenes()
        if picture is not None:
            out.append(picture)
        asked: list[ToRenderer] = [*self.reads.values()]
        if self._question is not None:
            asked.append(self._question)
        if not out or self.saved is not None:
            return [*out, *asked]
        stopped = self._stopped_at
        if stopped is not None and stopped.progress.samples:  # as far as it was seen, not further and not less
            stop = StopRule(max_samples=stopped.progress.samples)
            out.append(Update(self._task, stopped.generation, stop=stop, base=stopped.generation))
        elif self._stopped:
            out.append(Stop(self._task))
        if self._paused is not None:
            out.append(self._paused)
        if self._want is not None:
            out.append(self._want)
        return [*out, *asked]

    def close(self) -> None:
        self._states.keep()

    def _push(self, generation: int, state: _State) -> None:
        self._states.push(generation, state)
        self._stopped, self._stopped_at, self._checkpoint = False, None, None

    def _edited(self, update: Update) -> None:
        last = self._states.newest
        if last is None:
            return
        since = last.since.then(update) if last.since is not None else update
        if update.may_not_fit:  # then the state before it is the one that counts
            self._push(update.generation, _State(channel.another(last.scene), whole=False, since=since))
        else:
            last.since = since
            self._stopped, self._stopped_at, self._checkpoint = False, None, None

    def _fall_back(self, failed: Failed) -> None:
        """Forget the state that failed and the edits of it, but not a whole scene that was sent later."""
        works, whole = failed.fallback, (began for began, state in self._states.items() if state.whole)
        later = next((began for began in whole if began > failed.generation), math.inf)
        self._states.keep(lambda began: began >= later or (works is not None and began <= works))

    def _done(self, done: Done) -> Done:
        self._checkpoint = None
        if self._stopped_at is not None and self._stopped_at.generation == done.generation:
            done = replace(done, reason="stopped")
        if done.reason == "stopped":
            self._stopped_at = done
        if done.saved is not None:
            self.saved = Restore(done.task, done.generation, done.saved, done.reason, done.progress)
            self._stopped_at = None
        return done


MOST = 4  # states; while a renderer compiles for one, dragging a slider makes hundreds

State = TypeVar("State")


class WorkingStates(Generic[State]):
    """States by the generations with which they began, in order."""

    def __init__(self, discard: Callable[[State], None] = lambda state: None) -> None:
        """`discard` is called with each state that is forgotten."""
        self._states: list[tuple[int, State]] = []
        self._discard = discard

    def items(self) -> Iterator[tuple[int, State]]:
        """The generations and the states, the oldest first."""
        yield from self._states

    @property
    def newest(self) -> State | None:
        return self._states[-1][1] if self._states else None

    def at(self, generation: int) -> State | None:
        """The state that began with this generation, unless it was forgotten."""
        return next((state for began, state in self._states if began == generation), None)

    def push(self, generation: int, state: State) -> None:
        """Add a newer state. Of more than MOST, the first after the one that works is forgotten."""
        self._states.append((generation, state))
        if len(self._states) > MOST:
            self._forget(1)

    def works(self, generation: int) -> None:
        """The renderer was seen to work at this generation: it goes back to no state before that."""
        while len(self._states) > 1 and self._states[1][0] <= generation:
            self._forget(0)

    def keep(self, wanted: Callable[[int], bool] = lambda generation: False) -> None:
        """Forget all states but those that began with a wanted generation."""
        for at in reversed(range(len(self._states))):
            if not wanted(self._states[at][0]):
                self._forget(at)

    def _forget(self, at: int) -> None:
        self._discard(self._states.pop(at)[1])


@dataclass
class TaskRecord:
    listener: Listener
    kind: Kind
    client: str
    record: ReplayLog
    resident: bool = True  # the renderer has it, or is being told
    strikes: int = 0  # renderers that it brought down
    struck_at: float = 0.0

    @property
    def active(self) -> bool:
        """True if it takes a renderer's time, as an attended stream does, and a render until it has ended."""
        return self.record.saved is None and not self.record.away
