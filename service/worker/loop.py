"""One loop: the newest messages, a slice of work, what is wanted of the result."""

from __future__ import annotations

import logging
import select
import socket
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from gpu import DeviceLost, GpuError, OutOfMemory, Renderer, SceneTooLarge, denoise
from gpu.precompile import kernel_keys
from service.ipc import channel
from service.ipc.heartbeat import Heartbeat
from service.ipc.leases import Assist, Assistants, Lease, LeaseDone, LeaseFailed
from service.ipc.messages import (
    EvaluateBsdf,
    Evicted,
    Failed,
    Foresee,
    FromRenderer,
    Read,
    Ready,
    Restore,
    ToRenderer,
    Update,
    Usage,
    Want,
)
from service.ipc.task_control import ApplyNow, CheckpointStored, Drop, Hold, Pause, Resume, Stop, TakeCheckpoint
from service.worker.bsdf_task import BsdfTask
from service.worker.context import WorkerContext
from service.worker.device.memory import DeviceMemory
from service.worker.division.assistant import Assistant
from service.worker.foreseen import ForeseenKernels
from service.worker.helpers.compile_client import CompileClient, compiler_memory
from service.worker.helpers.denoise_client import DenoiseClient
from service.worker.helpers.first_look_client import FirstLookClient
from service.worker.scheduler import Scheduler
from service.worker.task import Task

Runnable = Task | Assistant | BsdfTask  # what the scheduler gives turns to

REPORT_S = 0.25  # between two accounts of the GPU time that was used
# No hang: a driver may take this long for a kernel with every feature. The renderer compiles none where a process
# can; but the driver may have dropped what that compiled.
COMPILING_S = 300.0

log = logging.getLogger(__name__)


class Loop:
    def __init__(
        self,
        end: socket.socket,
        renderer: Renderer,
        heartbeat: Heartbeat,
        memory_limit: int,
        device: int | None,
        checkpoint_s: float,
        lifeline: int | None = None,
        ahead: str = "some",
    ) -> None:
        """`ahead`: how many kernels are compiled before anybody waits for them: off, some or all."""
        foresees = ahead != "off"
        self._end = end
        self._renderer = renderer
        self._heartbeat = heartbeat
        self._tasks: dict[int, Task] = {}
        self._questions: dict[int, BsdfTask] = {}
        self._assistants: dict[int, Assistant] = {}  # of tasks whose home is elsewhere
        self._memory = DeviceMemory(
            memory_limit,
            lambda: [*self._tasks.values(), *self._assistants.values()],
            lambda: renderer.shared_bytes,
        )
        self._scheduler = Scheduler()
        gpu = None if renderer.info["software"] else device or 0
        self._denoiser = DenoiseClient(gpu, self._tell_denoiser)
        self._compiler = CompileClient(renderer.info, device, lifeline, foresees)
        # A GPU's driver has no such choice.
        looks = foresees and renderer.info["software"] and self._compiler.able
        self._context = WorkerContext(
            renderer,
            self._send,
            self._denoiser,
            self._compiler,
            FirstLookClient(device, compiler_memory(renderer.info)) if looks else None,
            self._memory,
            self._forget,
            checkpoint_s,
            self._scheduler.sharers,
        )
        self._foreseen = ForeseenKernels(self._compiler, bounded=ahead != "all")
        self._used_s: dict[int, float] = defaultdict(float)  # by task, not reported yet
        self._traced = self._evicted = self._resting = 0
        self._reported = 0.0
        self.handlers = self._table()

    def run(self) -> None:
        """Work until the server is gone, then raise channel.Closed. Sleep on the sockets while idle."""
        self._compiler.prepare(kernel_keys.common_keys(), "soon")
        self._denoiser.locate()
        busy = False
        while True:
            busy = self.step(wait=not busy)

    def step(self, wait: bool) -> bool:
        """One round: messages, a turn, frames; whether there is more to do at once. With `wait` it first sleeps until
        there is a reason for it."""
        for message in coalesced(self._pending(wait)):
            self._take(message)
        self._denoiser.hear()
        self._compiler.hear()
        if self._context.first_looks is not None:
            self._context.first_looks.hear()
        chosen = self._scheduler.choose(self._everyone)
        if chosen is not None:
            began = time.monotonic()
            self._work(chosen, chosen.turn)
            self._heartbeat.lasted(time.monotonic() - began)
        for task in list(self._tasks.values()):
            for message in task.take_deferred():
                self._take(message)
            if task.wanted:
                self._work(task, partial(self._answer, task))
        busy = any(each.ready for each in self._everyone)
        self._account(at_once=not busy)
        return self._foreseen.prepare() or busy

    def _tell_denoiser(self, place: str) -> None:
        self._send(Ready({"denoiser": denoise.version(place)}))

    @property
    def _everyone(self) -> list[Runnable]:
        return [*self._tasks.values(), *self._assistants.values(), *self._questions.values()]

    def _pending(self, wait: bool) -> Iterator[ToRenderer]:
        """The messages that have come in; with `wait`, as soon as there is one, or a helper has answered."""
        if wait:
            ends = [self._end, *self._denoiser.ends, *self._compiler.ends]
            ends += [] if self._context.first_looks is None else self._context.first_looks.ends
            waits = [self._compiler.left_s, self._renderer.tidy()]
            waits.append(None if self._denoiser.late else self._denoiser.left_s)
            waits += [task.left_s for task in self._tasks.values()]
            self._account(at_once=True)  # what tidying has changed
            select.select(ends, [], [], min((left_s for left_s in waits if left_s is not None), default=None))
        try:
            while True:
                message = channel.receive(self._end)
                self._heartbeat.take()
                yield message
        except BlockingIOError:
            return

    def _take(self, message: ToRenderer) -> None:
        task = self._tasks.get(message.task)
        if task is None or not task.defers(message):
            self.handlers[type(message)](message)

    def _answer(self, task: Task) -> None:
        if task.answer():
            self._scheduler.shown(task)

    def _work(self, task: Runnable, work: Callable[[], object], read: Read | None = None) -> None:
        """Do the work and charge the task's client for its time. An exception fails this task only."""
        began = time.perf_counter()
        compiles = task.loads or not self._compiler.able
        with self._heartbeat.working(task.number, COMPILING_S if compiles else 0.0):
            self._guard(task, work, read)
        seconds = time.perf_counter() - began
        self._scheduler.charge(task, seconds)
        self._used_s[task.number] += seconds

    def _account(self, at_once: bool) -> None:
        """Report the GPU time that was used, now and then, and at once before the loop sleeps."""
        now = time.monotonic()
        resting = self._resting_bytes
        if (self._used_s or resting != self._resting) and (at_once or now - self._reported >= REPORT_S):
            pictures: list[Task | Assistant] = [*self._tasks.values(), *self._assistants.values()]
            traced = sum(each.traced for each in pictures)
            used = dict(self._used_s)
            self._renderer.tidy()
            kernels, evicted = self._renderer.kernels, self._renderer.kernels_evicted
            self._resting = self._resting_bytes
            resident = len(self._tasks), self._memory.used, self._resting, kernels
            self._send(Usage(used, traced - self._traced, *resident, evicted - self._evicted))
            self._used_s.clear()
            self._evicted = evicted
            self._traced, self._reported = traced, now

    @property
    def _resting_bytes(self) -> int:
        return self._renderer.resting_bytes if self._renderer.info["software"] else 0

    def _table(self) -> dict[type, Callable[[Any], object]]:
        """The handler of each type of message, one for each of `ToRenderer`."""
        note, work = self._note, self._charged
        return {
            Assist: self._begin_to_assist,
            Lease: self._lease,
            Update: self._update,
            Drop: self._drop,
            Foresee: self._foreseen.add,
            EvaluateBsdf: self._evaluate,
            Read: self._read,
            Assistants: work(lambda task, message: task.picture.home.assist(message.ids)),
            LeaseDone: work(lambda task, message: task.picture.home.heard(message)),
            Restore: work(lambda task, message: task.picture.restore(message)),
            ApplyNow: note(lambda task, _: None),  # nothing is left to be applied: else the task had kept it
            Stop: work(lambda task, _: task.picture.stop()),
            Want: note(lambda task, message: task.picture.request_frame(message)),
            TakeCheckpoint: note(lambda task, _: task.picture.ending.checkpoints.hasten()),
            CheckpointStored: note(lambda task, message: task.picture.ending.checkpoints.stored(message.took_s)),
            Pause: note(lambda task, message: task.pause(message.away)),
            Resume: note(lambda task, _: task.resume()),
            Hold: note(lambda task, _: task.hold()),
        }

    def _note(self, act: Callable[[Task, Any], object]) -> Callable[[Any], object]:
        """A handler for what takes no time; it does nothing where the message's task is gone."""

        def handle(message: ToRenderer) -> None:
            if (task := self._tasks.get(message.task)) is not None:
                act(task, message)

        return handle

    def _charged(self, act: Callable[[Task, Any], object]) -> Callable[[Any], object]:
        """A handler for what takes time, which is charged to the task's client."""
        return self._note(lambda task, message: self._work(task, partial(act, task, message)))

    def _update(self, update: Update) -> None:
        number = update.task
        if number in self._assistants:
            self._assistants[number].update(update)
            return
        if number not in self._tasks:
            self._tasks[number] = Task(self._context, number, update.client)
        self._tasks[number].update(update)

    def _read(self, read: Read) -> None:
        task = self._tasks.get(read.task)
        if task is None:  # evicted, and the server had not heard of it when it sent this
            self._send(Evicted(read.task))
        else:
            self._work(task, lambda: task.picture.frames.read(read), read)

    def _evaluate(self, question: EvaluateBsdf) -> None:
        self._questions[question.task] = BsdfTask(self._context, question)

    def _begin_to_assist(self, message: Assist) -> None:
        self._assistants[message.task] = Assistant(self._context, message.task)

    def _lease(self, lease: Lease) -> None:
        if lease.task in self._assistants:
            self._assistants[lease.task].lease(lease)

    def _drop(self, message: Drop) -> None:
        number = message.task
        if (assistant := self._assistants.pop(number, None)) is not None:
            self._traced -= assistant.traced
            assistant.release()
            self._renderer.let_go()
        elif (question := self._questions.pop(number, None)) is not None:
            question.release()
        elif number in self._tasks:
            self._remove(self._tasks[number])

    def _forget(self, number: int) -> None:
        """The server has this finished picture, and brings it back when somebody asks for it."""
        self._remove(self._tasks[number])
        self._send(Evicted(number))

    def _remove(self, task: Task) -> None:
        self._traced -= task.traced
        del self._tasks[task.number]
        task.release()
        self._renderer.let_go()

    def _guard(self, task: Runnable, work: Callable[[], object], read: Read | None = None) -> None:
        try:
            work()
            return
        except (channel.Closed, DeviceLost):  # the process ends, and another one goes on from checkpoints
            raise
        except GpuError as error:
            self._look_for_reset()
            log.warning("task failed", {"task": task.number, "kind": type(error).__name__, "error": error})
            detail, refused = str(error), isinstance(error, SceneTooLarge | OutOfMemory)
        except Exception:
            self._look_for_reset()  # of a lost context moderngl maps no memory
            log.exception("task failed", {"task": task.number})
            detail, refused = "The renderer made a mistake; its log says which.", False
        if read is None:
            task.fail()
        if isinstance(task, Assistant):
            return self._send(LeaseFailed(task.number, task.attempted, detail))
        self._send(Failed(task.number, task.attempted, detail, refused, read.serial if read else None))

    def _look_for_reset(self) -> None:
        if reason := self._renderer.reset_reason:
            raise DeviceLost(f"the device was reset {reason}")

    def _send(self, message: FromRenderer) -> None:
        channel.send(self._end, message)


def coalesced(messages: Iterator[ToRenderer]) -> Iterator[ToRenderer]:
    """The messages in order, a run of updates of one task joined into its last. A Want in between changes nothing."""
    updates: dict[int, Update] = {}
    wants: dict[int, Want] = {}
    for message in messages:
        earlier = updates.get(message.task)
        if isinstance(message, Update):
            updates[message.task] = earlier.then(message) if earlier else message
        elif isinstance(message, Want):
            wants[message.task] = message
        else:
            if earlier is not None:
                yield updates.pop(message.task)
            if message.task in wants:
                yield wants.pop(message.task)
            yield message
    yield from updates.values()
    yield from wants.values()
