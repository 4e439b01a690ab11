"""A dispatch that reads nothing of a scene.

Mesa keeps what its last dispatch read, also once it is deleted, until another dispatch reads something else from the
same binding points: of llvmpipe, that renders in the machine's memory, a scene's textures and triangles stayed there
for as long as nobody rendered.
"""

from __future__ import annotations

from typing import Any

from gpu import context as contexts
from gpu.kernels.cache import KernelCache
from gpu.layout import bindings

SLOTS = 16  # storage buffers, which all drivers have at least
UNITS = bindings.BODIES_TEXTURE + 1
ENTRY = "blank.comp"
DEFINES: dict[str, object] = {"SLOTS": SLOTS, "UNITS": UNITS}


def dispatch_blank(context: Any, kernels: KernelCache) -> None:
    """Make the driver let go of what has been deleted. Raises CompileError, DeviceLost."""
    kernel = kernels.get(ENTRY, DEFINES)
    texture, buffer = context.texture((1, 1), 4), context.buffer(reserve=4)
    for unit in range(UNITS):
        texture.use(unit)
    for slot in range(SLOTS):
        buffer.bind_to_storage_buffer(slot)
    contexts.dispatch(context, kernel, 1, 1)
    contexts.finish(context)
    texture.release()
    buffer.release()
