"""The shapes' own coordinates, in which solid textures and projections lie."""

from __future__ import annotations

import numpy as np

from gpu.layout import ShapeSpace
from service.document import Scene
from service.document.numbers import Vec3
from service.document.procedural import NoiseTexture, RampInput, RampTexture
from service.document.shape import BoxShape, CylinderShape, DiskShape, QuadShape, Shape, SphereShape
from service.document.texture import is_projected, references


def shape_spaces(scene: Scene, origin: Vec3) -> np.ndarray:
    """A `layout.ShapeSpace` for each shape, from coordinates relative to `origin`; none where nothing is solid.

    They are metres before the shape's transform, from a place that moves with it: the middle of a sphere, a disk or a
    box, the corner of a quad, the origin of a mesh. Shapes whose materials show nothing solid are left out: all zero.
    """
    solid = {name for name, texture in scene.textures.items() if _is_solid(scene, texture)}
    shown = {
        name
        for name, material in scene.materials.items()
        if solid and any(reference.texture in solid for reference in references(material).values())
    }
    chosen = [i for i, shape in enumerate(scene.shapes) if shape.material in shown]
    if not chosen:
        return np.zeros(0, ShapeSpace.dtype)
    records = np.zeros(len(scene.shapes), ShapeSpace.dtype)
    shapes = [scene.shapes[i] for i in chosen]
    maps = np.array([np.eye(4) if s.transform is None else s.transform.matrix4() for s in shapes])
    rows = np.linalg.inv(maps[:, :3, :3])
    move = np.einsum("nij,nj->ni", rows, np.array(origin) - maps[:, :3, 3]) - [_middle(shape) for shape in shapes]
    for i, axis in enumerate("xyz"):
        records[f"row_{axis}"][chosen], records[f"move_{axis}"][chosen] = rows[:, i], move[:, i]
    return records


def _is_solid(scene: Scene, texture: object) -> bool:
    if isinstance(texture, RampTexture) and isinstance(texture.input, RampInput):
        texture = scene.textures[texture.input.texture]
    return is_projected(texture) or (isinstance(texture, NoiseTexture) and texture.space == "object")


def _middle(shape: Shape) -> Vec3:
    match shape:
        case SphereShape() | DiskShape():
            return shape.center
        case CylinderShape():
            x, y, z = (a + b / 2 for a, b in zip(shape.base, shape.axis, strict=True))
            return x, y, z
        case BoxShape():
            x, y, z = ((a + b) / 2 for a, b in zip(shape.min, shape.max, strict=True))
            return x, y, z
        case QuadShape():
            return shape.origin
        case _:
            return 0.0, 0.0, 0.0
