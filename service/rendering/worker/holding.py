"""A scene on the device with its pictures; and the same put aside in the machine's memory, to be taken up again."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from gpu import RenderSettings, picture_bytes, save, scene_bytes
from gpu.kernels import features
from gpu.precompile import kernel_keys
from service.rendering.ipc.messages import Update
from service.rendering.worker.ladder import Ladder

if TYPE_CHECKING:
    from gpu import KernelKey, Renderer, Saved, Scene, SceneArrays


@dataclass(frozen=True)
class Aside:
    """What was on the device, in full: it goes on to the same bits."""

    arrays: SceneArrays
    settings: RenderSettings
    editing: bool
    flags: frozenset[str]  # of its kernel: edits that came and went may have raised more than the arrays ask for
    pictures: dict[float, Saved]  # by scale, of those that had begun


class Holding:
    """Raises what the renderer raises, and then holds nothing."""

    def __init__(
        self,
        renderer: Renderer,
        arrays: SceneArrays,
        settings: RenderSettings,
        editing: bool,
        edits: dict[str, Any],
        flags: frozenset[str] = frozenset(),
    ) -> None:
        self._renderer = renderer
        self._editing = editing
        self.scene: Scene = renderer.load(arrays, editing, raised=flags)
        try:
            if edits:
                self.scene.edit(**edits)
            self.ladder = Ladder(renderer, self.scene, settings)
        except Exception:
            self.scene.release()
            raise

    @property
    def editing(self) -> bool:
        return self._editing

    @property
    def bytes(self) -> int:
        return scene_bytes(self.scene.arrays) + self.ladder.bytes

    def resize(self, settings: RenderSettings) -> None:
        """Takes settings of another size; what there is stays when that can't be had."""
        ladder = Ladder(self._renderer, self.scene, settings)
        self.ladder.release()
        self.ladder = ladder

    def aside(self) -> Aside:
        """Off the device; this holding is released."""
        pictures = {scale: finished(save(made)) for scale, made in self.ladder.begun.items()}
        out = Aside(self.scene.arrays, self.ladder.full.settings, self._editing, self.scene.flags, pictures)
        self.release()
        return out

    @classmethod
    def back(cls, renderer: Renderer, aside: Aside) -> Holding:
        out = cls(renderer, aside.arrays, aside.settings, aside.editing, {}, aside.flags)
        try:
            for scale, saved in aside.pictures.items():
                out.ladder.picture(scale).restore(saved)
        except Exception:
            out.release()
            raise
        return out

    def release(self) -> None:
        self.ladder.release()
        self.scene.release()


def finished(saving: Generator[None, None, Saved]) -> Saved:
    """What a saving comes to, all at once."""
    while True:
        try:
            next(saving)
        except StopIteration as end:
            saved: Saved = end.value
            return saved


def needed(arrays: SceneArrays | None, settings: RenderSettings) -> int:
    """About what a scene and its picture take on the device."""
    return (0 if arrays is None else scene_bytes(arrays)) + picture_bytes(settings)


@dataclass(frozen=True)
class Wanted:
    """What an update comes to, and the kernel that it takes."""

    arrays: SceneArrays
    settings: RenderSettings
    recipe: KernelKey


def wanted_of(
    update: Update, old: RenderSettings | None, holding: Holding | None, aside: Aside | None
) -> Wanted | None:
    """The picture that the update makes; None: its kernel is the one there is, or nothing can come of it."""
    settings = old if update.settings is None else RenderSettings(**update.settings)
    edits, raised = update.edits, frozenset[str]()
    if settings is None:
        return None
    if update.scene is not None:
        arrays, editing = update.scene, update.interactive
        raised = features.flags(arrays, editing)
    elif holding is not None:
        arrays, editing, raised = holding.scene.arrays, holding.editing, holding.scene.flags
        aperture = update.camera is None or update.camera.aperture_radius == arrays.camera.aperture_radius
        if update.settings is None and aperture and not edits.keys() & {"materials", "texture_words", "moved"}:
            return None
    elif aside is not None:
        arrays, editing, raised = aside.arrays, aside.editing, aside.flags
    else:
        return None
    if edits or update.scene is None:
        arrays = kernel_keys.apply_edit(arrays, edits)
        raised = features.grown(raised, arrays) if editing else features.flags(arrays)
    return Wanted(arrays, settings, kernel_keys.kernel_key(arrays, settings, raised))
