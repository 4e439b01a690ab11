"""The payloads of messages by their types in gpu, which `service.rendering.ipc` may not import."""

from __future__ import annotations

from typing import cast

from gpu import RenderSettings, Saved, SceneArrays
from service.rendering.ipc.messages import SavedPicture, SceneData, Update


def scene_arrays(data: SceneData) -> SceneArrays:
    return cast(SceneArrays, data)


def updated_scene(update: Update) -> SceneArrays | None:
    """The whole scene that an update brings; None where it brings edits only."""
    return None if update.scene is None else scene_arrays(update.scene)


def saved_picture(sent: SavedPicture, settings: RenderSettings) -> Saved:
    """The picture that a message brings, with the settings that the task has."""
    return Saved(settings, sent.samples, sent.under_way, sent.buffers)


def sent_picture(saved: Saved, driver: str) -> SavedPicture:
    """The picture for a message."""
    return SavedPicture(saved.samples, saved.under_way, saved.buffers, driver)
