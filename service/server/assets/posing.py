"""Scenes' files in a pose: with other materials, or as one of their animations has them at a time."""

from __future__ import annotations

from service.formats.cache import refused
from service.formats.errors import ParseError
from service.formats.scene_import import Imported, take_apart
from service.formats.source import for_sandbox
from service.formats.types import AssetInfo, Pose
from service.server.assets.store import TAKEN_APART, AssetStore, Room, sizes_of_parts, with_choices
from service.system.disk_usage import expected
from service.system.garbage import collector_paused


def described(store: AssetStore, id: str) -> AssetInfo:
    """An asset's record; a scene's with its variants and animations. Raises NotFound, AssetError, Unavailable."""
    info = store.info(id)
    return with_choices(info, store.materials(id)) if info.kind in TAKEN_APART else info


@collector_paused()
def posed_scene(store: AssetStore, id: str, pose: Pose, room: Room | None = None) -> Imported:
    """`store.scene` in a pose, whose parts are stored; the document is not, as a file has any number of poses.

    `room` is used instead of the store's own. Raises NotFound, also for a variant and an animation that the file
    does not have, AssetError, Unavailable, and the exceptions of `room`.
    """
    saved = store.scene(id)
    if pose.is_default:
        return saved
    saved.check(pose)
    format = store.info(id).format
    with store.opened(id) as source:
        try:
            file = store.loader.sandbox.parse_scene(format, for_sandbox(source), pose)
        except ParseError as error:
            raise refused(f"the {format.upper()} file", error) from None
    with (room or store.room)(expected(sizes_of_parts(file))):
        return take_apart(file, store.store_part)
