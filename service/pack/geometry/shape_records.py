"""Members of the records of all kinds: shapes that the camera looks through, lights, what fills shapes and the space
around them, and the shapes' own coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from gpu import layout
from gpu.layout import Body, ShapeBit, ShapeKind, ShapeSpace
from gpu.tables.half_space import single_scattering_albedo
from service.document import Scene
from service.document.medium import LARGEST_G, Medium
from service.document.numbers import Vec3
from service.document.procedural import NoiseTexture, RampInput, RampTexture
from service.document.shape import MeshShape, Shape
from service.document.texture import is_projected, references
from service.pack.geometry.shape_kinds import KINDS
from service.pack.geometry.warnings import OddMesh, counted
from service.pack.geometry.world import ShapeMaterials
from service.pack.lights import lights


def hide(records: Sequence[np.ndarray], shapes: Sequence[Shape]) -> None:
    """Mark the records of shapes that the camera looks through."""
    hidden = np.array([not shape.visible_to_camera for shape in shapes], bool)
    if hidden.any():
        for array in records:
            index = array["shape"] & np.uint32(~layout.SHAPE_BITS & layout.NONE)
            array["shape"] |= np.where(hidden[index], ShapeBit.HIDDEN, 0).astype(np.uint32)


def area_lights(
    analytic: dict[ShapeKind, np.ndarray], triangles: np.ndarray, materials: ShapeMaterials
) -> tuple[np.ndarray, np.ndarray]:
    """`layout.Light` records of the shapes that shine, not yet weighted, and their areas (m^2). The lights' numbers
    are written into the shapes' records. `triangles` are those that no instance shows."""
    records = {**analytic, ShapeKind.TRIANGLE: triangles}
    found = lights.mark(records, np.array([name in materials.emissive for name in materials.names]))
    return found, lights.areas(records, found)


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
    return (0.0, 0.0, 0.0) if isinstance(shape, MeshShape) else KINDS[type(shape)].middle(shape)


def bodies(scene: Scene) -> np.ndarray:
    """A `layout.Body` for what is outside, and one for each shape; none where nothing is filled or has a priority."""
    outside = None if scene.environment is None else scene.environment.medium
    media: list[Medium | None] = [outside, *(getattr(shape, "medium", None) for shape in scene.shapes)]
    filled = {i: medium for i, medium in enumerate(media) if medium is not None and not medium.is_empty()}
    ranks = [0, *(getattr(shape, "priority", 0) for shape in scene.shapes)]
    records = np.zeros(len(media) if filled or any(ranks) else 0, Body.dtype)
    records["priority"] = ranks[: len(records)]
    numbers = {name: number for number, name in enumerate(scene.materials)}
    records["material"][1:] = [numbers[shape.material] for shape in scene.shapes][: len(records)]
    for i, medium in filled.items():
        _fill(records[i], medium)
    return records


def odd_media(scene: Scene, materials: np.ndarray, odd: Iterable[OddMesh]) -> tuple[str, ...]:
    """Warnings about media that rays enter and may never leave, or never enter. `materials` are the records, in the
    document's order; `odd` are the meshes that have oddities."""
    rims = {each.shape: each.oddities.rim for each in odd}
    enter = (materials["transmission"] > 0) & (materials["metallic"] < 1) & (materials["thin_walled"] == 0)
    clear = dict(zip(scene.materials, enter.tolist(), strict=True))
    found = list[tuple[int, str]]()
    for i, shape in enumerate(scene.shapes):
        medium = getattr(shape, "medium", None)
        if medium is None or medium.is_empty():
            continue
        if not clear[shape.material]:
            found.append((i, "it has a medium, which is not seen, as its material lets no light in"))
        elif rims.get(i) or (type(shape) in KINDS and KINDS[type(shape)].is_open(shape)):
            found.append((i, "it is open and has a medium: light that leaves by the opening stays in the medium"))
    return counted(found)


def scattering(medium: Medium) -> np.ndarray:
    """The rate at which light turns, 1/m per channel (3,)."""
    if medium.albedo is None:
        return np.array(medium.scattering)
    turned: np.ndarray = np.array(medium.extinction()) * single_scattering_albedo(np.array(medium.albedo), medium.g)
    return turned


def _fill(record: np.void, medium: Medium) -> None:
    record["extinction"], record["scattering"] = medium.extinction(), scattering(medium)
    record["g"], record["emission"] = np.clip(medium.g, -LARGEST_G, LARGEST_G), medium.emission
