"""The update of a task that waits to be applied; it is joined with later ones, and may wait for its kernel."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gpu import CompileError, RenderSettings
from gpu.precompile import kernel_keys
from service.ipc.messages import Update, Want
from service.worker.context import WorkerContext
from service.worker.device.loaded_scene import EditedScene, KernelRequest, edited_scene, kernel_request
from service.worker.device.residency import Residency
from service.worker.helpers.kernel_wait import KernelWait
from service.worker.progress import ProgressTracker
from service.worker.view.fallback_preview import FallbackPreview
from service.worker.view.first_look import UnoptimisedLook, is_large

if TYPE_CHECKING:
    from gpu import KernelKey


class Updates:
    """At most one update is pending. While its kernel is compiled, it may be shown with another one: the superset
    kernel of the scene that was edited, where that is there already, or a small one without optimisation."""

    def __init__(
        self, context: WorkerContext, number: int, client: str, residency: Residency, tracker: ProgressTracker
    ) -> None:
        self.pending: Update | None = None
        self.stops = False  # the render ends as soon as the pending update is applied
        self.settings: RenderSettings | None = None  # of the last update that was applied
        self._fallback = FallbackPreview(number, context.send, context.renderer, context.compiler)
        self._unoptimised = UnoptimisedLook(number, context.send, context.first_looks)
        self._first_looks = context.first_looks
        self._residency, self._tracker, self._compiler, self._client = residency, tracker, context.compiler, client
        self._wait = KernelWait(context.compiler, client)
        # Of the pending update, once it was looked at.
        self._edited: EditedScene | None = None
        self._request: KernelRequest | None = None
        self._refusal: CompileError | None = None

    @property
    def compiling(self) -> bool:
        """True if the pending update waits for its kernel."""
        return self._wait.compiling

    @property
    def previews(self) -> bool:
        """True if there is a slice to trace of what shows the pending update meanwhile."""
        return self.compiling and self._fallback.due

    @property
    def previewed(self) -> bool:
        """True if that shows something already."""
        return self._fallback.scale is not None

    @property
    def bytes(self) -> int:
        """The bytes that it takes to show the pending update."""
        return self._fallback.bytes + self._unoptimised.bytes

    def trace_preview(self) -> int:
        """Trace a slice of it; how many samples of pixels that were."""
        return self._fallback.step()

    def answer(self, want: Want | None) -> bool:
        """Send the frame that is wanted of an update that waits for its kernel, if there is something new to show."""
        return self.compiling and (self._fallback.answer(want) or self._unoptimised.answer(want))

    def shown(self, generation: int) -> float:
        """The scale at which that generation was shown before its kernel was there; 0 where it was not."""
        return max(self._fallback.shown(generation), self._unoptimised.shown(generation))

    def join(self, update: Update) -> None:
        """Take an update, unless it changes one that failed: the server will hear of that, and say what it wants."""
        known = self._tracker.generation if self.pending is None else self.pending.generation
        if update.base is not None and update.base != known:
            return
        self.pending = self.pending.then(update) if self.pending is not None else update
        self._edited = self._request = self._refusal = None
        self.stops = False
        self._wait.stop()

    def edited(self, update: Update) -> EditedScene | None:
        """The scene that the pending update leads to; None where there is none to edit. It is made once."""
        if self._edited is None:
            self._edited = edited_scene(update, self._residency.loaded or self._residency.offloaded)
        return self._edited

    def begin_to_wait(self, update: Update, paused: bool) -> bool:
        """True if the update's kernel is being compiled, so that the update has to wait for it. Where it cannot be,
        `check` says so."""
        self._request = self._refusal = None
        if self._wait.compiler is None:
            return False
        loaded = self._residency.loaded is not None
        request = kernel_request(update, self.settings, self.edited(update), loaded)
        self._request = request
        if request is None:
            return False
        watched = (update.interactive or self._tracker.interactive) and not paused
        try:
            return any(self._waits_for(key, request, update.generation, watched) for key in request.keys)
        except CompileError as error:
            self._refusal = error
            return False

    def check(self) -> None:
        """Raise the CompileError of the pending update's kernel, if there is none for it."""
        if self._refusal is not None:
            raise self._refusal

    def _waits_for(self, key: KernelKey, request: KernelRequest, generation: int, watched: bool) -> bool:
        """True if this kernel is being compiled, which may be shown by another one meanwhile."""
        assert self._wait.compiler is not None
        shows = watched and not self._wait.compiler.needs_no_wait(key)
        at_once = shows and self._fallback.can(request)
        soon = shows and not at_once and self._unoptimised.can(request)
        if not self._wait.begin(key):
            return False
        for preview, serves in ((self._fallback, at_once), (self._unoptimised, soon)):
            if not serves:
                preview.release()
            elif preview.generation != generation or not preview.shows:
                preview.begin(request, generation)
        return True

    def applied(self, update: Update) -> None:
        """The pending update was applied, or refused; in the first case the renderer has met its kernel."""
        self._release_previews()
        if self._request is not None and self._tracker.generation == update.generation:
            for key in self._request.keys:
                self._wait.loaded(key)
        self._edited = self._request = self._refusal = None

    def take_compile_ms(self) -> float:
        """Milliseconds that the kernel of the last update took to compile elsewhere; 0 when asked again."""
        return self._wait.take_ms()

    def foresee(self, settings: RenderSettings) -> None:
        """Have compiled what moving a large mesh would need, and the first touch of some sliders."""
        if self._compiler is not None and self._compiler.foresees and self._tracker.interactive:
            arrays = self._residency.full.scene.arrays
            moved = kernel_keys.key_after_move(arrays, settings)
            first = self._fallback.prepare(arrays, settings)  # with which any of them can be shown
            keys = [*first, *([moved] if moved else []), *kernel_keys.keys_after_edit(arrays, settings)]
            self._compiler.prepare(keys, "soon", self._client, self._foreseen)
            if self._first_looks is not None and is_large(settings):
                self._first_looks.start()

    def _foreseen(self, milliseconds: float) -> None:
        """A foreseen kernel was compiled: nobody waits for it."""

    def release(self) -> None:
        """Wait for no kernel, and show nothing meanwhile; what is pending stays so."""
        self._wait.forget()
        if self._compiler is not None:
            self._compiler.forget(self._foreseen)
        self._release_previews()

    def _release_previews(self) -> None:
        self._fallback.release()
        self._unoptimised.release()
