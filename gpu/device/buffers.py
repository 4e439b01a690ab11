"""The arrays of a scene as buffers on the device, and the upload of those that differ after shapes have moved."""

from __future__ import annotations

from typing import Any

import numpy as np

from gpu import context as contexts
from gpu.arrays import SceneArrays
from gpu.device.pinned import Pinned, pin
from gpu.device.textures import linear_texture, update_range
from gpu.errors import GpuError
from gpu.layout import bindings
from gpu.layout.bindings import Slot

BUFFERS = {
    Slot.SPHERES: "spheres",
    Slot.QUADS: "quads",
    Slot.BOXES: "boxes",
    Slot.ELLIPSOIDS: "ellipsoids",
    Slot.TRIANGLES: "triangles",
    Slot.TRIANGLE_NORMALS: "triangle_normals",
    Slot.NODES: "nodes",
    Slot.LIGHTS: "lights",
}
SPARE = 2  # the room for the scene's own tree behind those of instances, in units of its present size


def upload(context: Any, array: np.ndarray) -> Any:
    """A buffer. Raises SceneTooLarge, OutOfMemory."""
    # An empty binding still needs a buffer: llvmpipe reads it even in branches that no lane takes.
    data = np.ascontiguousarray(array).view(np.uint8).reshape(-1) if array.size else np.zeros(96, np.uint8)
    return contexts.block(context, data)


def shared(context: Any, slot: Slot, arrays: SceneArrays) -> Any:
    """The buffer of a slot of BUFFERS; the array itself where the driver can use it in place. Raises SceneTooLarge,
    OutOfMemory."""
    array = getattr(arrays, BUFFERS[slot])
    if slot == Slot.NODES and len(arrays.instances):
        buffer = contexts.block(context, arrays.instance_nodes.nbytes + SPARE * array.nbytes)
        _write(buffer, arrays.instance_nodes, 0)
        _write(buffer, array, arrays.instance_nodes.nbytes)
        return buffer
    return pin(context, array) or upload(context, array)


def move(context: Any, old: SceneArrays, new: SceneArrays, buffers: dict[Slot, Any], textures: dict[int, Any]) -> int:
    """Upload what differs: of BUFFERS all but triangles, instances, the lights' tree. Returns the number of bytes.

    Raises SceneTooLarge, OutOfMemory, and then changes nothing.
    """
    made, texture, sent = dict[Slot, Any](), None, 0
    differing = [slot for slot, name in BUFFERS.items() if not _equal(getattr(old, name), getattr(new, name))]
    try:
        for slot in differing:
            size = getattr(new, BUFFERS[slot]).nbytes + (new.instance_nodes.nbytes if slot == Slot.NODES else 0)
            if isinstance(buffers[slot], Pinned) or size > buffers[slot].size or not size:
                made[slot] = shared(context, slot, new)
                sent += made[slot].size
        if not _equal(old.light_tree, new.light_tree):
            texture = linear_texture(context, new.light_words, 4, "u4")
    except GpuError:
        for buffer in made.values():
            buffer.release()
        raise
    for slot in differing:
        if slot in made:
            buffers[slot].release()
            buffers[slot] = made[slot]
        else:
            array = getattr(new, BUFFERS[slot])
            _write(buffers[slot], array, new.instance_nodes.nbytes if slot == Slot.NODES else 0)
            sent += array.nbytes
    if texture is not None and bindings.LIGHT_TREE_TEXTURE in textures:
        textures[bindings.LIGHT_TREE_TEXTURE].release()
        textures[bindings.LIGHT_TREE_TEXTURE] = texture
        sent += new.light_words.nbytes
    for unit, was, is_ in (
        (bindings.INSTANCES_TEXTURE, old.instances, new.instances),
        (bindings.SPACES_TEXTURE, old.spaces, new.spaces),
        (bindings.BODIES_TEXTURE, old.bodies, new.bodies),
    ):
        if was is not is_ and len(changed := np.flatnonzero(was != is_)):
            sent += update_range(textures[unit], is_, slice(int(changed[0]), int(changed[-1]) + 1))
    return sent


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    return a is b or np.array_equal(a, b)


def _write(buffer: Any, array: np.ndarray, offset: int) -> None:
    if array.nbytes:
        buffer.write(np.ascontiguousarray(array).view(np.uint8).reshape(-1), offset=offset)
