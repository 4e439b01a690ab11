"""The payloads of messages by their types in gpu, which `service.rendering.ipc` may not import."""

from __future__ import annotations

from typing import cast

from gpu import Saved, SceneArrays
from service.rendering.ipc.messages import PictureData, SceneData, Update


def scene_arrays(data: SceneData) -> SceneArrays:
    return cast(SceneArrays, data)


def updated_scene(update: Update) -> SceneArrays | None:
    """The whole scene that an update brings; None where it brings edits only."""
    return None if update.scene is None else scene_arrays(update.scene)


def saved_picture(data: PictureData) -> Saved:
    return cast(Saved, data)
