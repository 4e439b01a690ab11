"""Whether large meshes of a document that is being edited shall have trees of their own: from the first move on."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence

from gpu.arrays import HEAVY
from service.scene.shape import MeshShape, Shape

FIELDS = tuple(MeshShape.model_fields)
TRANSFORM = FIELDS.index("transform")
STILL = [FIELDS.index(name) for name in FIELDS if name not in ("transform", "material", "visible_to_camera")]


class MovedMeshes:
    """What one stream has moved. One call at a time."""

    def __init__(self) -> None:
        self._before: Sequence[Hashable] = ()
        self._moved: set[Hashable] = set()

    def apart(
        self, shapes: Sequence[Shape], contents: Sequence[Hashable], triangles: Callable[[MeshShape], int]
    ) -> bool:
        """Whether a mesh is there that was moved, now or before. `contents` as by cache.content."""
        here = {_still(each) for each in contents}
        for shape, old, new in zip(shapes, self._before, contents, strict=False):
            still = _still(new)
            if isinstance(shape, MeshShape) and still not in self._moved and _still(old) == still:
                elsewhere = isinstance(old, tuple) and isinstance(new, tuple) and old[TRANSFORM] != new[TRANSFORM]
                if elsewhere and triangles(shape) >= HEAVY:
                    self._moved.add(still)
        self._before = contents
        self._moved &= here
        return bool(self._moved)


def _still(content: Hashable) -> Hashable:
    """What stays of a mesh that moves; of another shape nothing."""
    return tuple(content[i] for i in STILL) if isinstance(content, tuple) else None
