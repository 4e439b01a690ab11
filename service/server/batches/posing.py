"""Axes that are times of an animation: at each of them the scene's things of a glTF file are posed anew.

Things are known by their names, which are the paths of the file's nodes; those of several things of one name, and of
things without a name, by their order. A posed thing takes the file's mesh and place at that time, and keeps its
material.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

from service.document.axes import Times
from service.document.references import references
from service.formats.types import Pose
from service.problems import FieldError, InvalidDocument, NotFound, TooLarge
from service.server.assets.posing import posed_scene
from service.server.requests.batch_request import ParsedBatch, times_of
from service.server.requests.request_parser import unfolded
from service.server.storage.stores import Storage

MEMBERS = {"shapes": ("asset", "transform"), "lights": ("position", "direction")}  # that a pose sets
MOST_BYTES = 16 << 20  # of all poses of a batch, which stay in memory while its renders are made
GONE = {"transform": {"scale": 1e-6}}  # of a shape whose node is flat at that time

Thing = dict[str, Any]


def with_poses(parsed: ParsedBatch, storage: Storage, owner: str) -> ParsedBatch:
    """The batch with what moves at each time, as it is stored. It reads each file once for each time.

    Raises InvalidDocument, NotFound and TooLarge with pointers from the root of the body, and what importing raises.
    """
    moved = times_of(parsed.axes)
    if not moved:
        return parsed
    scene, axes = json.loads(unfolded(parsed.body))["scene"], json.loads(parsed.axes)
    uses = list(parsed.uses)
    for i, axis in moved.items():
        axes[i]["poses"] = poses = _poses(axis, f"/over/{i}", scene, storage, owner)
        uses += [
            (f"/over/{i}{axis.pointer(step)}", ref) for step, pose in enumerate(poses) for ref in references(pose)
        ]
    return replace(parsed, axes=json.dumps(axes), uses=uses)


def _poses(axis: Times, pointer: str, scene: Any, storage: Storage, owner: str) -> list[dict[str, dict[str, Thing]]]:
    store, room = storage.assets, partial(storage.shares.room, owner)
    try:
        storage.access.check(owner, axis.asset)
        saved = store.scene(axis.asset).document
    except NotFound as error:
        raise NotFound(error.detail, f"{pointer}/asset") from None
    here = {kind: _places(scene.get(kind, ()), saved.get(kind, ()), kind) for kind in MEMBERS}
    if not any(here.values()):
        detail = "nothing in the scene is of this file: its shapes and lights are known by their names"
        raise InvalidDocument([FieldError(f"{pointer}/asset", detail)])
    found, size = [], 0
    for time in axis.time:
        try:
            posed = posed_scene(store, axis.asset, Pose(animation=axis.animation, time=time), room)
        except NotFound as error:
            raise NotFound(error.detail, pointer + error.pointer) from None
        storage.shares.imported(owner, axis.asset, posed.references())
        pose = {
            kind: _moved(scene[kind], here[kind], posed.document.get(kind, ()), kind)
            for kind in MEMBERS
            if here[kind]
        }
        found.append({kind: things for kind, things in pose.items() if things})
        size += len(json.dumps(found[-1]))
        if size > MOST_BYTES:
            detail = f"the poses of these times take more than the {MOST_BYTES >> 20} MiB allowed: ask for fewer"
            raise TooLarge(detail, f"{pointer}/time")
    return found


def _keys(things: Iterable[Thing]) -> list[tuple[str, int]]:
    """Keys that tell each of the file's things from the others: its name, and the number among those of that name."""
    counts: dict[str, int] = defaultdict(int)
    keys = []
    for thing in things:
        name = thing.get("name", "")
        keys.append((name, counts[name]))
        counts[name] += 1
    return keys


def _places(things: Iterable[Thing], saved: Iterable[Thing], kind: str) -> dict[tuple[str, int], int]:
    """Where in the scene the things of the file are, by their keys. One without a name is the file's where it has the
    mesh of one at rest."""
    known, files = {thing.get("name", "") for thing in saved}, {thing.get("asset") for thing in saved}
    in_scene = [
        (i, thing)
        for i, thing in enumerate(things)
        if (thing["name"] in known if "name" in thing else kind == "shapes" and thing.get("asset") in files)
    ]
    return dict(zip(_keys((thing for _, thing in in_scene)), (i for i, _ in in_scene), strict=True))


def _moved(things: list[Thing], here: dict[tuple[str, int], int], posed: list[Thing], kind: str) -> dict[str, Thing]:
    """The members that differ from the scene's, by the places of the things."""
    standing = dict(zip(_keys(posed), posed, strict=True))
    moved = {}
    for key, place in here.items():
        then = standing.get(key)
        if then is None and kind == "lights":
            continue
        members = GONE if then is None else {name: then.get(name) for name in MEMBERS[kind]}
        changed = {name: value for name, value in members.items() if value != things[place].get(name)}
        if changed:
            moved[str(place)] = changed
    return moved
