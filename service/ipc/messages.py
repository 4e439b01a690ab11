"""Messages between the server and the renderer's process. Immutable; arrays inside travel as shared memory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol

import numpy as np

from service.ipc.leases import Assist, Assistants, Lease, LeaseDone, LeaseFailed, LeaseRefuted
from service.ipc.task_control import ApplyNow, CheckpointStored, Drop, Hold, Pause, Resume, Stop, TakeCheckpoint
from service.views import DEFAULT_TONE_MAP, Encoding

BsdfQuestion = Literal["values", "albedo", "terms"]
Reason = Literal["max_samples", "time_limit", "target_noise", "stopped"]

LARGE = 4 << 20  # bytes, which are copied in about a millisecond
TRUSTED_SAMPLES = 16  # from which on the noise meter tells the truth


class SceneData(Protocol):
    """A gpu.SceneArrays, of which the server reads nothing: it may not import gpu."""

    @property
    def materials(self) -> np.ndarray: ...


class SceneEditData(Protocol):
    """A gpu.SceneEdit, of which the server reads no more than this."""

    @property
    def environment_map(self) -> object: ...

    @property
    def restarts(self) -> bool: ...

    @property
    def bytes(self) -> int: ...

    def then(self, later: Any) -> SceneEditData: ...


@dataclass(frozen=True)
class StopRule:
    """Rendering ends at the first of these; None: no such limit."""

    max_samples: int | None = None
    time_limit: float | None = None  # s
    target_noise: float | None = None


@dataclass(frozen=True)
class Lut:
    """A table of displayed colours, as gpu.Lut has it. `key` is equal where the tables are."""

    key: str
    values: np.ndarray = field(compare=False)
    low: tuple[float, float, float] = (0.0, 0.0, 0.0)
    high: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class View:
    """How a picture is to be shown; changing it costs no samples."""

    aov: str = "color"
    exposure: float = 0.0
    tone_map: str = DEFAULT_TONE_MAP
    encoding: Encoding = "u1"
    p3: bool = False  # for a screen with the primaries of Display P3
    lut: Lut | None = None  # what is displayed goes through it last
    prior: bool = False  # until an edited picture has samples, a guess from what it showed before is welcome
    denoise: bool = False  # while it is noisy, it is shown denoised; what is read of it is not


ESTIMATE = View("estimate", encoding="linear")  # colour (4 channels) and variance (3) of the same samples


@dataclass(frozen=True)
class Progress:
    samples: int = 0
    noise: float | None = None
    elapsed_s: float = 0.0
    eta_s: float | None = None


@dataclass(frozen=True)
class SavedPicture:
    """The accumulated samples of a picture: with the same scene and settings it goes on to the same bits.

    The server knows nothing of what is in `buffers`, which are arrays of bytes.
    """

    samples: int
    under_way: tuple[int, int, int]  # samples of the pass, row and column of its next tile
    buffers: list[np.ndarray]
    driver: str = ""  # that produced the samples; only the same driver may resume. "": not known
    # Bands that were done of blocks that were not merged yet: first sample, number of samples, first row, number of
    # rows. Their values are the last ones of `buffers`.
    bands: tuple[tuple[int, int, int, int], ...] = ()

    @property
    def nbytes(self) -> int:
        return sum(buffer.nbytes for buffer in self.buffers)


def driver_of(info: Mapping[str, Any]) -> str:
    """The driver and its version by what `gpu.Renderer.info` says: with equal ones a picture has equal bits."""
    return f"{info.get('renderer', '')} {info.get('version', '')}".strip()


# --- to the renderer ---


@dataclass(frozen=True)
class Update:
    """A change of a task; its first one carries `scene`, `settings` and `stop`. None: as before.

    `settings` are the arguments of gpu.RenderSettings."""

    task: int
    generation: int
    scene: SceneData | None = None
    settings: dict[str, Any] | None = None
    stop: StopRule | None = None
    edit: SceneEditData | None = None  # of the scene that the task has
    denoise: bool | None = None
    base: int | None = None  # the generation that it changes; without one it is whole
    client: str = ""  # tasks of one client share its part of the GPU's time
    interactive: bool = False  # a first look at lower resolution is welcome, and edits will follow

    @property
    def is_large(self) -> bool:
        """True if copying it to shared memory is too much for the event loop."""
        return self.scene is not None or (self.edit is not None and self.edit.bytes > LARGE)

    @property
    def may_not_fit(self) -> bool:
        """True if the device may have no memory for what it brings."""
        lit = self.edit is not None and self.edit.environment_map is not None
        return self.scene is not None or self.settings is not None or lit

    @property
    def restarts(self) -> bool:
        """True if accumulation starts again."""
        return self.scene is not None or self.settings is not None or (self.edit is not None and self.edit.restarts)

    def then(self, later: Update) -> Update:
        """This update and a later one of the same task as one."""
        if later.scene is not None:  # a whole scene: the edits before it are in it
            denoise = self.denoise if later.denoise is None else later.denoise
            settings, stop = later.settings or self.settings, later.stop or self.stop
            return replace(later, settings=settings, stop=stop, denoise=denoise)
        names = ("settings", "stop", "denoise", "edit")
        values = {name: getattr(later, name) for name in names if getattr(later, name) is not None}
        if self.edit is not None and later.edit is not None:
            values["edit"] = self.edit.then(later.edit)
        return replace(self, generation=later.generation, **values)


@dataclass(frozen=True)
class Foresee:
    """Asks for the kernels to be compiled with which a stream would begin this scene, or come to it by an edit of the
    one `before`. The task has no other use."""

    task: int
    scene: SceneData
    settings: dict[str, Any]  # the arguments of gpu.RenderSettings
    before: SceneData | None = None


@dataclass(frozen=True)
class Want:
    """Asks for one Frame, as soon as there is newer content than the last one showed; with `anyway` at once."""

    task: int
    serial: int
    view: View
    anyway: bool = False


@dataclass(frozen=True)
class Read:
    """Asks for one Image of the picture so far."""

    task: int
    serial: int
    view: View


@dataclass(frozen=True)
class Restore:
    """The picture of a task whose scene was just sent again, as it was when Done or Checkpoint brought it."""

    task: int
    generation: int
    saved: SavedPicture
    reason: Reason | None  # why it had ended; None: it goes on
    progress: Progress


@dataclass(frozen=True)
class EvaluateBsdf:
    """Asks for one Evaluated: the result of the method `question` of gpu.BsdfEvaluator. The task has no other use."""

    task: int
    question: BsdfQuestion
    material: SceneData  # of one material
    wo: np.ndarray  # (n, 3), unit length
    wi: np.ndarray  # (m, 3), unit length; for "albedo" none
    samples: int = 0  # for "albedo"
    lobes: bool = False  # for "values": each lobe alone, too
    client: str = ""


# --- from the renderer ---


@dataclass(frozen=True)
class Ready:
    info: dict[str, Any]  # of the GL implementation; sent again, it has what has changed

    @property
    def driver(self) -> str:
        return driver_of(self.info)


@dataclass(frozen=True)
class Unable:
    """Says why there is no renderer on this machine."""

    detail: str


@dataclass(frozen=True)
class Loaded:
    task: int
    generation: int
    setup_s: float
    compile_ms: float
    raised: tuple[str, ...]  # features that the kernel was compiled with, and those that were left out
    spared: tuple[str, ...]
    warnings: list[str]
    traces_caustics: bool = False  # from the lights

    @property
    def kernel(self) -> dict[str, Any]:
        """The kernel's part of a render's status."""
        return {
            "raised": list(self.raised),
            "not_raised": list(self.spared),
            "caustics": "light" if self.traces_caustics else "paths",
            "compile_ms": self.compile_ms,
        }


@dataclass(frozen=True)
class Frame:
    """Pixels (height, width, 4) for a Want; `last`: nothing better will follow."""

    task: int
    serial: int
    generation: int
    pixels: np.ndarray
    progress: Progress
    scale: float
    last: bool
    denoised: bool = False
    prior: bool = False  # it has a guess in it, and is of full size whatever `scale` is
    provisional: bool = False  # the generation may still fail


@dataclass(frozen=True)
class Image:
    """Pixels (height, width, channels) for a Read; None before the first sample."""

    task: int
    serial: int
    pixels: np.ndarray | None
    progress: Progress
    denoised: bool = False


@dataclass(frozen=True)
class Progressed:
    task: int
    generation: int
    progress: Progress


@dataclass(frozen=True)
class Done:
    task: int
    generation: int
    reason: Reason
    progress: Progress
    warnings: list[str]
    saved: SavedPicture | None = None  # of a render that no stream edits; None: no samples
    traces_caustics: bool = False  # from the lights


@dataclass(frozen=True)
class Checkpoint:
    """The picture of a render under way, to go on from should this renderer be lost."""

    task: int
    generation: int
    progress: Progress
    saved: SavedPicture


@dataclass(frozen=True)
class Evaluated:
    """The members of a gpu.BsdfValues, BsdfAlbedo or BsdfTerms, by name."""

    task: int
    arrays: dict[str, np.ndarray]


@dataclass(frozen=True)
class Evicted:
    """The renderer no longer has this finished task; Restore brings it back."""

    task: int


@dataclass(frozen=True)
class Discarded:
    """A Restore of a picture under way did not fit, as another driver or version had saved it: it begins again."""

    task: int


@dataclass(frozen=True)
class Usage:
    """GPU seconds by task and samples of pixels since the last Usage, and what the device stores now."""

    gpu_s: dict[int, float]
    samples: int
    tasks: int
    bytes: int  # on the device
    resting: int  # more of the machine's memory: of a software renderer, for what no task uses just now
    kernels: int
    evicted: int  # kernels, since the last one
    task: int = 0  # of nobody in particular


@dataclass(frozen=True)
class Failed:
    """An update failed: the task goes on with generation `fallback`; None: not before there is a whole scene."""

    task: int
    generation: int
    detail: str
    refused: bool = False  # the scene asks for too much
    serial: int | None = None  # of the Read that failed, when only that did
    fallback: int | None = None


ToRenderer = (
    Update
    | Foresee
    | Want
    | Read
    | Pause
    | Resume
    | Hold
    | Stop
    | Drop
    | ApplyNow
    | TakeCheckpoint
    | CheckpointStored
    | Restore
    | EvaluateBsdf
    | Assist
    | Assistants
    | Lease
    | LeaseDone
)
Heard = (  # of a renderer that has started
    Usage
    | Loaded
    | Frame
    | Image
    | Progressed
    | Checkpoint
    | Done
    | Evaluated
    | Evicted
    | Discarded
    | Failed
    | Lease
    | LeaseDone
    | LeaseFailed
    | LeaseRefuted
)
FromRenderer = Ready | Unable | Heard
