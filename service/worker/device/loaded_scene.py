"""A scene on the device with its pictures; and the same offloaded to the machine's memory, to be restored."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from gpu import RenderSettings, Steps, apply_edit, picture_bytes, scene_bytes
from gpu.precompile import fallback, kernel_keys
from service.ipc.messages import Foresee, Update
from service.worker.device.resolution_ladder import ResolutionLadder
from service.worker.payloads import scene_arrays, updated_scene

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
        edits: dict[str, Any],
        flags: frozenset[str] = frozenset(),
    ) -> None:
        self._renderer = renderer
        self._editing = editing
        self.scene: Scene = renderer.load(arrays, editing, raised=flags)
        try:
            if edits:
                self.scene.edit(**edits)
            self.ladder = ResolutionLadder(renderer, self.scene, settings)
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
        out = cls(renderer, offloaded.arrays, offloaded.settings, offloaded.editing, {}, offloaded.flags)
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
    """The arrays and settings that an update leads to, and the kernel that they need."""

    arrays: SceneArrays
    settings: RenderSettings
    key: KernelKey


def begin_key(foreseen: Foresee) -> KernelKey:
    """The key of the kernel with which a stream begins a scene."""
    arrays, settings = scene_arrays(foreseen.scene), RenderSettings(**foreseen.settings)
    return kernel_keys.kernel_key(arrays, settings, kernel_keys.flags(arrays, True))


def slider_keys(foreseen: Foresee) -> list[KernelKey]:
    """The keys of the kernels with which the first touch of any of its sliders is shown."""
    arrays, settings = scene_arrays(foreseen.scene), RenderSettings(**foreseen.settings)
    return fallback.superset_keys(arrays, settings, fallback.superset(arrays))


def kernel_request(
    update: Update, old: RenderSettings | None, loaded: LoadedScene | None, offloaded: Offloaded | None
) -> KernelRequest | None:
    """The request for an update's kernel; None where the present one serves, or the update cannot be applied."""
    settings = old if update.settings is None else RenderSettings(**update.settings)
    edits, raised = update.edits, frozenset[str]()
    if settings is None:
        return None
    scene = updated_scene(update)
    if scene is not None:
        arrays, editing = scene, update.interactive
        raised = kernel_keys.flags(arrays, editing)
    elif loaded is not None:
        arrays, editing, raised = loaded.scene.arrays, loaded.editing, loaded.scene.flags
        moved = arrays if update.camera is None else replace(arrays, camera=update.camera)
        same_flags = kernel_keys.camera_flags(moved) == kernel_keys.camera_flags(arrays)
        compiled = {"materials", "texture_words", "microfacets", "environment_map", "moved"}
        if update.settings is None and same_flags and not edits.keys() & compiled:
            return None
    elif offloaded is not None:
        arrays, editing, raised = offloaded.arrays, offloaded.editing, offloaded.flags
    else:
        return None
    if edits or update.scene is None:
        arrays = apply_edit(arrays, **edits)
        raised = kernel_keys.flags_after_edit(raised, arrays, editing)
    return KernelRequest(arrays, settings, kernel_keys.kernel_key(arrays, settings, raised))
