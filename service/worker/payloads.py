"""The payloads of messages by their types in gpu, which `service.ipc` may not import."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from gpu import Band, RenderSettings, Saved, SceneArrays, SceneEdit
from service.ipc.messages import SavedPicture, SceneData, Update

Result = tuple[Band, np.ndarray]  # a band, and its accumulators as `gpu.Picture.block.read_band` gives them


def scene_arrays(data: SceneData) -> SceneArrays:
    return cast(SceneArrays, data)


def updated_scene(update: Update) -> SceneArrays | None:
    """The whole scene that an update brings; None where it brings edits only."""
    return None if update.scene is None else scene_arrays(update.scene)


def scene_edit(update: Update) -> SceneEdit | None:
    """The edit that an update brings."""
    return cast(SceneEdit | None, update.edit)


def saved_picture(sent: SavedPicture, settings: RenderSettings) -> Saved:
    """The picture that a message brings, with the settings that the task has."""
    return Saved(settings, sent.samples, sent.under_way, sent.buffers[: len(sent.buffers) - len(sent.bands)])


def saved_bands(sent: SavedPicture, settings: RenderSettings) -> list[Result]:
    """The bands that were done of blocks that were not merged yet."""
    parts = sent.buffers[len(sent.buffers) - len(sent.bands) :]
    return [
        (Band(*band), part.view(np.float32).reshape(band[3], settings.width, -1))
        for band, part in zip(sent.bands, parts, strict=True)
    ]


def sent_picture(saved: Saved, driver: str, done: Sequence[Result] = ()) -> SavedPicture:
    """The picture for a message, with bands that are not merged yet."""
    parts = [np.ascontiguousarray(values).reshape(-1).view(np.uint8) for _, values in done]
    bands = tuple((band.first, band.count, band.top, band.rows) for band, _ in done)
    return SavedPicture(saved.samples, saved.under_way, [*saved.buffers, *parts], driver, bands)
