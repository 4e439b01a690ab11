"""A scene on the device with its pictures; and the same offloaded to the machine's memory, to be restored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from gpu import RenderSettings, Steps, picture_bytes, scene_bytes
from gpu.precompile import fallback, kernel_keys
from service.ipc.messages import Foresee, Update
from service.worker.device.resolution_ladder import ResolutionLadder
from service.worker.payloads import scene_arrays, scene_edit, updated_scene

if TYPE_CHECKING:
    from gpu import KernelKey, Renderer, Saved, Scene, SceneArrays


@dataclass(frozen=True)
class Offloaded:
    """All that was on the device of a scene: restored, it goes on to the same bits."""

    arrays: SceneArrays
    settings: RenderSettings
    editing: bool
    flags: frozenset[str]  # of its kernel: edits that came and went may have raised more than the arrays ask for
    pictures: dict[float, Saved]  # by scale, of those that had begun


class LoadedScene:
    """A scene on the device. Its methods raise what the renderer raises; then nothing is left on the device."""

    def __init__(
        self,
        renderer: Renderer,
        arrays: SceneArrays,
        settings: RenderSettings,
        editing: bool,
        flags: frozenset[str],
    ) -> None:
        """While the scene is edited, its kernels have `flags` at least."""
        self._renderer = renderer
        self._editing = editing
        self.scene: Scene = renderer.load(arrays, editing, raised=flags)
        try:
            self.ladder = ResolutionLadder(renderer, self.scene, settings)
        except Exception:
            self.scene.release()
            raise

    @property
    def editing(self) -> bool:
        return self._editing

    @property
    def arrays(self) -> SceneArrays:
        return self.scene.arrays

    @property
    def flags(self) -> frozenset[str]:
        return self.scene.flags

    @property
    def bytes(self) -> int:
        return self.scene.bytes + self.ladder.bytes

    def resize(self, settings: RenderSettings) -> None:
        """Change to settings of another size; where there is no memory for it, the old pictures stay."""
        ladder = ResolutionLadder(self._renderer, self.scene, settings)
        self.ladder.release()
        self.ladder = ladder

    def offloaded(self) -> Offloaded:
        """Move everything to the machine's memory and release this object."""
        pictures = {scale: Steps(made.save()).finish() for scale, made in self.ladder.begun.items()}
        out = Offloaded(self.scene.arrays, self.ladder.full.settings, self._editing, self.scene.flags, pictures)
        self.release()
        return out

    @classmethod
    def back(cls, renderer: Renderer, offloaded: Offloaded) -> LoadedScene:
        out = cls(renderer, offloaded.arrays, offloaded.settings, offloaded.editing, offloaded.flags)
        try:
            for scale, saved in offloaded.pictures.items():
                out.ladder.picture(scale).restore(saved)
        except Exception:
            out.release()
            raise
        return out

    def release(self) -> None:
        self.ladder.release()
        self.scene.release()


def needed(arrays: SceneArrays | None, settings: RenderSettings) -> int:
    """About the bytes that a scene and its picture take on the device."""
    return (0 if arrays is None else scene_bytes(arrays)) + picture_bytes(settings)


@dataclass(frozen=True)
class KernelRequest:
    """The arrays and settings that an update leads to, and the kernels that they need: that of the camera's paths
    and that of its paths of light, if there are any."""

    arrays: SceneArrays
    settings: RenderSettings
    key: KernelKey
    light: KernelKey | None = None

    @property
    def keys(self) -> list[KernelKey]:
        return [key for key in (self.key, self.light) if key is not None]


def begin_key(foreseen: Foresee) -> KernelKey:
    """The key of the kernel with which a stream begins a scene, or comes to it by an edit of another one."""
    arrays, settings = scene_arrays(foreseen.scene), RenderSettings(**foreseen.settings)
    if foreseen.before is None:
        return kernel_keys.kernel_key(arrays, settings, kernel_keys.flags(arrays, True))
    raised = kernel_keys.flags(scene_arrays(foreseen.before), True)
    return kernel_keys.kernel_key(arrays, settings, kernel_keys.flags_after_edit(raised, arrays, True))


def slider_keys(foreseen: Foresee) -> list[KernelKey]:
    """The keys of the kernels with which the first touch of any of its sliders is shown."""
    arrays, settings = scene_arrays(foreseen.scene), RenderSettings(**foreseen.settings)
    return fallback.superset_keys(arrays, settings, fallback.superset(arrays))


@dataclass(frozen=True)
class EditedScene:
    """The scene that an update leads to."""

    arrays: SceneArrays
    flags: frozenset[str]  # of its kernel
    editing: bool
    same_kernel: bool  # the kernel of the scene that was edited serves, with the same settings


def edited_scene(update: Update, before: LoadedScene | Offloaded | None) -> EditedScene | None:
    """The scene that an update leads to, from its own or from the one `before`; None where there is neither.

    Raises ValueError where the edit is none of that scene."""
    scene, edit = updated_scene(update), scene_edit(update)
    if scene is not None:
        old, editing, flags = scene, update.interactive, kernel_keys.flags(scene, update.interactive)
    elif before is not None:
        old, editing, flags = before.arrays, before.editing, before.flags
    else:
        return None
    if edit is None:
        return EditedScene(old, flags, editing, same_kernel=scene is None)
    new = edit.apply(old)
    if edit.needs_kernel or kernel_keys.camera_flags(old) != kernel_keys.camera_flags(new):
        return EditedScene(new, kernel_keys.flags_after_edit(flags, new, editing), editing, same_kernel=False)
    return EditedScene(new, flags, editing, same_kernel=scene is None)


def kernel_request(
    update: Update, old: RenderSettings | None, edited: EditedScene | None, loaded: bool
) -> KernelRequest | None:
    """The request for the kernel of the scene that an update leads to; None where the present one serves, which is
    `loaded`, or where the update cannot be applied."""
    settings = old if update.settings is None else RenderSettings(**update.settings)
    if settings is None or edited is None or (loaded and update.settings is None and edited.same_kernel):
        return None
    key = kernel_keys.kernel_key(edited.arrays, settings, edited.flags)
    light = kernel_keys.light_key(edited.arrays, settings, edited.flags)
    return KernelRequest(edited.arrays, settings, key, light)
