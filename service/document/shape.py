"""The shapes: sphere, quad, disk, cylinder, box and mesh."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import ConfigDict, Field, model_validator

from service.document.base import OMITTABLE, Name, Named, entry, hint, refusal, slider
from service.document.medium import Medium
from service.document.numbers import (
    Colors,
    Coordinates,
    Direction,
    Directions,
    Point,
    Points,
    PositiveLength,
    Triangles,
    first_beyond,
)
from service.document.transform import AnyTransform

# The sine between a quad's edges below which its float32 normal is noise: the spacing of float32 near 1.
LEAST_SINE = float(np.finfo(np.float32).eps)


class _Placed(Named):
    name: Name = None
    material: Annotated[str, hint("Material", "The name of one of the scene's materials.")]
    transform: Annotated[
        AnyTransform | None,
        OMITTABLE,
        hint("Transform", "Where the thing stands, how it is turned and how large it is."),
    ] = None
    visible_to_camera: Annotated[
        bool,
        hint(
            "Visible to the camera", "Off: the camera looks through it, but its light, shadow and reflections stay."
        ),
    ] = True


class _Body(_Placed):
    """A shape that may have an inside."""

    priority: Annotated[
        int,
        Field(ge=-100, le=100),
        entry(
            "Priority",
            "Where glass, liquids and other clear bodies overlap, the one with the highest number is there.",
            unit="",
            soft=(-10, 10),
        ),
    ] = 0
    medium: Annotated[Medium | None, OMITTABLE, hint("Medium", "What fills it, behind a surface that transmits.")] = (
        None
    )


class SphereShape(_Body):
    """An exact sphere, not a mesh."""

    type: Literal["sphere"]
    center: Annotated[Point, entry("Centre", "The middle of the sphere.")]
    radius: Annotated[PositiveLength, slider("Radius", "From the centre to the surface.", unit="m", soft=5)]


class QuadShape(_Placed):
    """A parallelogram; its front is where u, v and the normal are right-handed."""

    type: Literal["quad"]
    origin: Annotated[Point, entry("Corner", "The corner that both edges start from.")]
    u: Annotated[Point, entry("Edge u", "From the corner along the first edge.")]
    v: Annotated[Point, entry("Edge v", "Along the second edge; the front faces cross(u, v).")]

    @model_validator(mode="after")
    def _has_area(self) -> Self:
        edges = math.hypot(*self.u) * math.hypot(*self.v)
        area = math.hypot(*np.cross(self.u, self.v).tolist())
        if area <= LEAST_SINE * edges or np.float32(area) == 0.0:
            raise refusal("has no area: u and v must not be zero nor parallel")
        return self


class DiskShape(_Placed):
    """A flat disk; its front is where the normal points."""

    type: Literal["disk"]
    center: Annotated[Point, entry("Centre", "The middle of the disk.")]
    normal: Annotated[Direction, entry("Normal", "The direction in which its front faces, and shines.", unit="")]
    radius: Annotated[PositiveLength, slider("Radius", "From the centre to the rim.", unit="m", soft=5)]


class CylinderShape(_Body):
    """A cylinder between two flat caps, or an open tube."""

    type: Literal["cylinder"]
    base: Annotated[Point, entry("Base", "The middle of the end where it begins.")]
    axis: Annotated[Direction, entry("Axis", "From the base to the other end.")]
    radius: Annotated[PositiveLength, slider("Radius", "From the middle to the side.", unit="m", soft=5)]
    caps: Annotated[bool, hint("Caps", "Off: both ends are open, and you can see its inside.")] = True


class BoxShape(_Body):
    """A box along the axes; a transform turns it."""

    type: Literal["box"]
    min: Annotated[Point, entry("Lower corner", "The corner with the smallest x, y and z.")]
    max: Annotated[Point, entry("Upper corner", "The corner with the largest x, y and z.")]

    @model_validator(mode="after")
    def _has_volume(self) -> Self:
        for axis, low, high in zip("xyz", self.min, self.max, strict=True):
            # In float32, as the box is traced: it may be too thin for its distance from the origin.
            if not np.float32(low) < np.float32(high):
                raise refusal(f"max must be above min on every axis; on {axis} they are {high!r} and {low!r}")
        return self


class MeshShape(_Body):
    """Triangles, from a file (`asset`) or written out (`vertices` and `faces`)."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["asset"]}, {"required": ["vertices", "faces"]}]}
    )

    type: Literal["mesh"]
    asset: Annotated[
        str | None, Field(min_length=1), OMITTABLE, hint("File", "A mesh file: OBJ, PLY, STL or GLB.")
    ] = None
    vertices: Annotated[Points | None, OMITTABLE, entry("Vertices", "Rows of x, y, z.")] = None
    faces: Annotated[
        Triangles | None,
        OMITTABLE,
        entry("Faces", "Rows of three vertex numbers, from 0, counter-clockwise seen from outside.", unit=""),
    ] = None
    normals: Annotated[Directions | None, OMITTABLE, entry("Normals", "One row per vertex.", unit="")] = None
    uvs: Annotated[
        Coordinates | None,
        OMITTABLE,
        entry("Texture coordinates", "One row of u and v per vertex; v points up.", unit=""),
    ] = None
    colors: Annotated[
        Colors | None,
        OMITTABLE,
        entry(
            "Vertex colours", "One row per vertex, linear, perhaps with alpha; they multiply the material's.", unit=""
        ),
    ] = None
    smooth: Annotated[
        bool | None, OMITTABLE, hint("Smooth", "On: rounded; off: with flat facets; neither: as the file says.")
    ] = None
    double_sided: Annotated[bool, hint("Double-sided", "Off: from behind it is not there.")] = True
    displacement: Annotated[
        bool, hint("Displacement", "On: the height of the material moves the surface itself.")
    ] = False
    max_edge: Annotated[
        PositiveLength | None,
        OMITTABLE,
        entry(
            "Longest edge",
            "The longest edge of the triangles: shorter edges show finer relief and take more memory.",
            absent="1/200 of its size",
        ),
    ] = None

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.asset is not None:
            for name in ("vertices", "faces", "normals", "uvs", "colors"):
                if getattr(self, name) is not None:
                    raise refusal(f"a mesh has an asset or {name}, not both", at=f"/{name}")
            return self
        if self.vertices is None and self.faces is None:
            raise refusal("is required: a mesh has an asset, or vertices and faces", at="/asset")
        if self.vertices is None or self.faces is None:
            missing = "vertices" if self.vertices is None else "faces"
            raise refusal("is required: a mesh without asset has vertices and faces", at=f"/{missing}")
        _check_numbers(self.vertices, self.faces)
        for name in ("normals", "uvs", "colors"):
            rows, count = getattr(self, name), len(self.vertices)
            if rows is not None and len(rows) != count:
                raise refusal(f"has {len(rows)} rows for {count} vertices: must be one per vertex", at=f"/{name}")
        return self

    def has_its_vertices(self) -> bool:
        """Check that written faces name existing vertices, in arrays of the right form."""
        vertices, faces = self.vertices, self.faces
        if vertices is None or faces is None or vertices.dtype != np.float64 or faces.dtype != np.int32:
            return False
        rows = vertices.shape[1:] == faces.shape[1:] == (3,)
        return rows and (not faces.size or 0 <= faces.min() <= faces.max() < len(vertices))


def _check_numbers(vertices: np.ndarray, faces: np.ndarray) -> None:
    beyond = first_beyond(faces, len(vertices))
    if beyond is not None:
        row, last = faces[beyond].tolist(), len(vertices) - 1
        raise refusal(f"{row} names a vertex that is not there: the last is {last}", at=f"/faces/{beyond}")


Shape = Annotated[
    SphereShape | QuadShape | DiskShape | CylinderShape | BoxShape | MeshShape, Field(discriminator="type")
]
