"""One task's picture as clients see it: frames and images on demand, and the denoised form of both."""

from __future__ import annotations

import logging
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gpu import COVERAGE_AOVS, FIRST_HIT_AOVS, GpuError, Lut, ViewTable, picture_bytes
from gpu.denoise import GUIDE_SAMPLES
from gpu.precompile import kernel_keys
from service import displays
from service.displays import view_of
from service.ipc.messages import ESTIMATE, Frame, Image, Read, Reason, View, Want
from service.worker.context import WorkerContext
from service.worker.device.residency import Residency
from service.worker.helpers.kernel_wait import KernelWait
from service.worker.progress import ProgressTracker
from service.worker.view.denoise_policy import Denoised, DenoisePolicy
from service.worker.view.prior import PriorGuess

if TYPE_CHECKING:
    from gpu import Picture, Prior


SLICE_S = 0.015  # how long a message may have to wait, and how finely the GPU is shared

log = logging.getLogger(__name__)

NODES = 65  # of a view's table, along each axis
# Of the shaper: the linear light below which the nodes lie evenly, above it logarithmically; and the node that lies
# at 1. That of ACES 2.0 ends at 452, beyond which it is white. Views without a tone map clip at 1 and are steep at
# black.
ACES, PLAIN = (2.0**-6, 26), (2.0**-12, 40)
MOST = 4  # tables in memory, of 3 MB each

_baked: OrderedDict[tuple[str, str], ViewTable] = OrderedDict()


class _Content(NamedTuple):
    """The content of a frame: one with equal content would show nothing new."""

    generation: int
    scale: float
    samples: int
    reason: Reason | None  # why the render has ended
    clean: bool  # denoised
    fine: bool  # with the fine network


class FrameSource:
    """Frames and images of a task; what cannot be shown at once is prepared in steps, while `due`."""

    def __init__(
        self,
        context: WorkerContext,
        number: int,
        client: str,
        residency: Residency,
        tracker: ProgressTracker,
        denoising: DenoisePolicy,
        prior: PriorGuess,
        finish: Callable[[], None],
    ) -> None:
        """`finish` says that the task has ended, where that waited for the denoised picture (`owes_done`)."""
        self.want: Want | None = None
        self.scale: float | None = None  # of what there is to see
        self.owes_done = False
        self.denoising = denoising
        self._number, self._send, self._finish, self._prior = number, context.send, finish, prior
        self._residency, self._tracker = residency, tracker
        self._wait = KernelWait(context.compiler, client)  # for the kernel of the AOVs of the first hit
        self._served: _Content | None = None  # of the last frame that was sent
        self._reads: list[Read] = []  # waiting for AOVs of the first hit, which are traced when asked for
        self._guided: Picture | None = None  # whose they are, while some are missing
        self._covers = False  # coverage is what is missing
        self._denoised_reads: list[Read] = []  # waiting for the denoised picture
        self._denoiser_answered = False  # the denoiser has answered, and pending reads are to be served

    def restart(self) -> None:
        """Begin with another picture, of which nothing was shown yet."""
        self.part()
        self.denoising.restart()
        self._denoiser_answered = False
        self.scale = None

    def part(self) -> None:
        """Let go of the pictures, which are about to leave the device."""
        self._guided = None
        self._wait.forget()

    def forget(self) -> None:
        """Forget everything; pending reads are answered with no image."""
        reads = self._reads + self._denoised_reads
        self._reads, self._denoised_reads = [], []
        self.restart()
        self.owes_done = False
        for read in reads:
            self.read(read)

    @property
    def awaited(self) -> bool:
        """True if a client waits for something that takes steps."""
        return self._guided is not None or bool(self._reads) or self._denoiser_answered or self._denoising_due

    @property
    def due(self) -> bool:
        """True if there is a step to be done."""
        return self.awaited and not self._wait.compiling

    def step(self) -> bool:
        """Do a step; whether there was one."""
        return self._denoise() or self._trace_guides()

    def answer(self) -> bool:
        """Send the frame that is wanted, if it would show something new."""
        want, shown, tracker = self.want, self.scale, self._tracker
        if want is None or shown is None:
            return False
        if self._residency.offloaded is not None:  # at rest: there is nothing new in it
            if self._served and self._served.reason == tracker.reason and not want.anyway:
                return False
            self._residency.wake()
        if self._residency.loaded is None:
            return False
        picture = self._residency.ladder.picture(shown)
        if self._needs_guides(picture, want.view):
            return False
        prior = self._guess(want.view, shown) if shown < 1.0 else None
        clean = None
        if self._smooths(shown, prior) and self.denoising.covers(want.view.aov, tracker.meter.noise):
            clean = self._denoised_frame(shown)
            if clean is None and self._holds_frame(want):
                return False
        progress = clean.progress if clean else tracker.progress(self._residency, shown)
        whole = clean is None or clean is self.denoising.has(picture.samples)
        fine = clean is not None and clean.fine
        content = _Content(tracker.generation, shown, progress.samples, tracker.reason, clean is not None, fine)
        if content == self._served and not want.anyway:
            return False
        last = tracker.reason is not None and whole
        if shown == 1.0 and not clean and not last:
            prior = self._guess(want.view, shown)
        prior = None if last else prior
        pixels = pixels_of(self._residency.full if prior else picture, want.view, clean, prior)
        self._served, self.want = content, None
        what = pixels, progress, shown, last, clean is not None, prior is not None
        self._send(Frame(self._number, want.serial, tracker.generation, *what))
        return True

    def _guess(self, view: View, scale: float) -> Prior | None:
        """The guess at the picture that is shown until that has samples of its own."""
        shows = view.prior and view.aov == "color" and view.encoding != "linear"
        return self._prior.shown(self._residency.ladder, scale) if shows else None

    def _smooths(self, shown: float, prior: Prior | None) -> bool:
        """True if a picture of that scale may be shown denoised: a small one of the view's, where no guess at the
        full one serves better. Reads are of the full one."""
        return shown == 1.0 or (self.denoising.live and prior is None and not self._denoised_reads)

    def _denoised_frame(self, shown: float) -> Denoised | None:
        """The newest denoised picture, unless the client has seen more, or as much and waits no longer."""
        latest, served = self.denoising.latest, self._served
        if latest is None or latest.scale != shown:
            return None
        if served is None or (served.generation, served.scale) != (self._tracker.generation, shown):
            return latest
        samples, seen = latest.progress.samples, served.samples
        traced = self._residency.ladder.picture(shown).samples
        stale = samples == seen < traced and not self.denoising.under_way
        return None if samples < seen or stale else latest

    def _holds_frame(self, want: Want) -> bool:
        """True if the client has something to look at until the denoised picture comes, which can't be long; or waits
        for that alone, where it is there in a moment."""
        seen = self._served is not None and self._served.generation == self._tracker.generation
        waits = seen or (self.denoising.live and self.denoising.quick)
        return self.denoising.under_way and waits and not want.anyway

    def read(self, read: Read) -> None:
        self._residency.wake()
        full = self._residency.full if self._residency.loaded and self._residency.full.samples else None
        if full is not None and self._needs_guides(full, read.view):
            self._reads.append(read)
            return
        clean = None
        noise = None if full is None else self._tracker.meter.read(full, fresh=True)
        if full is not None and self.denoising.covers(read.view.aov, noise, final=True):
            clean = self.denoising.has(full.samples)
            if clean is None:
                self._denoised_reads.append(read)
                return
        self._give(read, full, clean)

    def _give(self, read: Read, full: Picture | None, clean: Denoised | None) -> None:
        pixels = pixels_of(full, read.view, clean) if full else None
        progress = clean.progress if clean else self._tracker.progress(self._residency)
        self._residency.touch()
        self._send(Image(self._number, read.serial, pixels, progress, clean is not None))

    @property
    def _denoising_due(self) -> bool:
        """True if somebody waits for the picture to be denoised, and it can be."""
        denoising, scale = self.denoising, self.scale
        if self._residency.loaded is None or scale is None or not denoising.able:
            return False
        want = self.want if self._tracker.interactive else None
        watched = want is not None and denoising.covers(want.view.aov, self._tracker.meter.noise)
        if not (watched or self.owes_done or self._denoised_reads):
            return False
        prior = None if want is None or scale == 1.0 else self._guess(want.view, scale)
        if not self._smooths(scale, prior):
            return False
        return denoising.due(self._residency.ladder.picture(scale).samples, self._denoises_finely, scale)

    @property
    def _denoises_finely(self) -> bool:
        return self._tracker.reason is not None or bool(self._denoised_reads)

    def _denoise(self) -> bool:
        """Do a slice of the renderer's part of denoising, where any is due."""
        if self._denoiser_answered:
            self._denoiser_answered = False
            reads, self._denoised_reads = self._denoised_reads, []
            for read in reads:
                self._give(read, self._residency.full, None if self.denoising.warning else self.denoising.latest)
            if self.owes_done:
                self._finish()
            return True
        if not self._denoising_due:
            return False
        tracker, scale, fine = self._tracker, self.scale or 1.0, self._denoises_finely
        picture = self._residency.ladder.picture(scale)
        guided = not self._waits(picture)
        if not guided and fine:
            return True
        if not guided or picture.trace_guides(SLICE_S, GUIDE_SAMPLES):
            tracker.meter.read(self._residency.full, fresh=True)
            progress = tracker.progress(self._residency, scale)
            self.denoising.begin(picture, progress, fine, self._hear_denoised, scale, guided)
        return True

    def _hear_denoised(self) -> None:
        self._denoiser_answered = True

    def _waits(self, picture: Picture, coverage: bool = False) -> bool:
        """True if the kernel for the AOVs of the first hit is being compiled. Raises CompileError."""
        if self._wait.compiler is None or picture.guided_yet(coverage):
            return False
        scene, entry = picture.scene, kernel_keys.COVER if coverage else kernel_keys.GUIDES
        wanted = kernel_keys.kernel_key(scene.arrays, picture.settings, scene.flags, entry)
        if not self._wait.begin(wanted):
            self._wait.loaded(wanted)  # in a moment
        return self._wait.compiling

    def _needs_guides(self, picture: Picture, view: View) -> bool:
        coverage = view.aov in COVERAGE_AOVS
        if view.aov not in FIRST_HIT_AOVS and not coverage:
            return False
        if not (picture.covered if coverage else picture.guided):
            more = picture_bytes(picture.settings, not coverage, coverage) - picture_bytes(picture.settings)
            self._residency.make_room(more)
        if picture.trace_guides(0.0, coverage=coverage):
            return False
        self._guided, self._covers = picture, coverage
        return True

    def trace_first_hit(self, picture: Picture) -> bool | None:
        """Trace a slice of one sample of the AOVs of the first hit; whether it is complete. None while the kernel for
        it is compiled, or where the denoiser has them traced."""
        if self.denoising.able or self._waits(picture):
            return None
        if not picture.guided:
            self._residency.make_room(picture_bytes(picture.settings, True) - picture_bytes(picture.settings))
        return picture.trace_guides(SLICE_S, most=1)

    def _trace_guides(self) -> bool:
        """Trace a slice of the AOVs of the first hit where a read waits for them; then answer those reads."""
        picture = self._guided
        if picture is None and self._reads and self._residency.loaded is not None:  # it was aside meanwhile
            picture = self._residency.full
        if picture is None:
            return False
        if self._waits(picture, self._covers):
            return True
        if picture.trace_guides(SLICE_S, coverage=self._covers):
            self._guided = None
            reads, self._reads = self._reads, []
            for read in reads:
                self.read(read)
        return True


def pixels_of(picture: Picture, view: View, clean: Denoised | None, prior: Prior | None = None) -> np.ndarray:
    """The pixels of a picture, (height, width, 4), as the view wants them; with the guess of a `prior`, if any."""
    color = clean.pixels if clean else None
    if view.aov == ESTIMATE.aov:
        return np.concatenate([picture.read("color"), picture.read("variance")], axis=-1)
    if view.encoding == "linear":
        return picture.read(view.aov) if color is None else color
    lut = Lut(view.lut.key, view.lut.values, view.lut.low, view.lut.high) if view.lut else None
    named = view_of(view.tone_map, view.p3)
    tone_map = view_table(*named) if named else view.tone_map
    return picture.display(view.aov, view.exposure, tone_map, view.encoding, color, view.p3, lut, prior)


def view_table(display: str, view: str) -> ViewTable:
    """The table of a known view of OpenColorIO's, baked from its exact processor: 0.3 s the first time.

    Against that processor, over colours of all saturations from 0.002 to 128 times white, an 8-bit picture under ACES
    2.0 is off by 0.07 of its steps on average, by less than half a step in 99.9 % and at most by 2, near the borders
    of the display's gamut; without a tone map at most by 6, where a colour begins to clip
    (tests/shaders/test_view_tables.py).
    """
    key = display, view
    if key not in _baked:
        began = time.perf_counter()
        toe, node = ACES if view.startswith("ACES") else PLAIN
        top = toe * ((1.0 / toe + 1.0) ** ((NODES - 1) / node) - 1.0)
        axis = ViewTable.nodes(NODES, toe, top)
        blue, green, red = np.meshgrid(axis, axis, axis, indexing="ij")
        values = exact(np.stack([red, green, blue], axis=-1).reshape(NODES, -1, 3), display, view)
        values = np.clip(values, 0.0, 1.0).reshape(NODES, NODES, NODES, 3)
        _baked[key] = ViewTable(f"{display}/{view}", values, toe, top)
        log.info("baked a view", {"view": f"{display}/{view}", "ms": round((time.perf_counter() - began) * 1e3)})
    _baked.move_to_end(key)
    while len(_baked) > MOST:
        _baked.popitem(last=False)
    return _baked[key]


def exact(colors: np.ndarray, display: str, view: str) -> np.ndarray:
    """Display values of linear Rec.709 by OpenColorIO's own processor: (height, width, 3) float32, in and out."""
    import OpenImageIO as oiio

    height, width = colors.shape[:2]
    image = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, "float"))
    image.set_pixels(image.roi, np.ascontiguousarray(colors, np.float32))
    out = oiio.ImageBufAlgo.ociodisplay(
        image, display, view, displays.SOURCE, unpremult=False, colorconfig=displays.CONFIGURATION, nthreads=1
    )
    if out.has_error:
        raise GpuError(f"OpenColorIO could not show {display}/{view}: {out.geterror()}")
    return np.asarray(out.get_pixels(oiio.FLOAT))
