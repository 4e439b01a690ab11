"""Large meshes of a document that is being edited get trees of their own when they are first moved."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence

from gpu.arrays import HEAVY
from service.document.shape import MeshShape, Shape

# The fields of a mesh that its triangles depend on.
MESH_FIELDS = tuple(name for name in MeshShape.model_fields if name not in ("name", "medium", "priority"))
TRANSFORM = MESH_FIELDS.index("transform")
STILL = [i for i, name in enumerate(MESH_FIELDS) if name not in ("transform", "material", "visible_to_camera")]


class MovedMeshes:
    """The large meshes that one stream has moved. It serves one call at a time."""

    def __init__(self) -> None:
        self._before: Sequence[Hashable] = ()
        self._moved: set[Hashable] = set()

    def apart(
        self, shapes: Sequence[Shape], contents: Sequence[Hashable], triangles: Callable[[MeshShape], int]
    ) -> bool:
        """Whether the scene has a mesh that was moved, now or before. `contents` are the shapes' `cache.content`."""
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
    """The part of a mesh's content that a move does not change; None for another shape."""
    return tuple(content[i] for i in STILL) if isinstance(content, tuple) else None
