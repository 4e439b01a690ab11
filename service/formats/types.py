"""The results of reading assets, and the limits. This module imports nothing of the service."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

LARGEST, BRIGHTEST = 1e9, 1e20  # the document's ranges of lengths and of radiometric values
Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int32]
Kind = Literal["mesh", "image", "scene", "materials", "lut", "measured"]


@dataclass(frozen=True)
class MeshOddities:
    """Oddities of a mesh. The material decides if the picture shows them."""

    coinciding: int = 0  # triangles with the corners of an earlier one, whichever way they face
    differing: int = 0  # of these, those with other colours or texture coordinates
    crowded: int = 0  # edges of more than two triangles
    turned: int = 0  # edges whose two triangles face opposite ways
    inwards: bool = False  # closed, and facing inwards
    rim: int = 0  # edges of one triangle: with any the mesh is open


@dataclass(frozen=True)
class MeshData:
    """Triangles as in the file, neither merged nor reordered; polygons are triangulated. The arrays are read-only."""

    vertices: Doubles  # (n, 3), finite
    faces: Indices  # (m, 3), in range, counter-clockwise from outside
    normals: Floats | None  # (n, 3), unit length; None where the file has none
    uvs: Floats | None = None  # (n, 2), finite, v pointing up: set 0
    uvs_1: Floats | None = None  # the same for set 1
    colors: Floats | None = None  # (n, 3), linear, 0..1; or (n, 4), with an alpha that multiplies the material's
    warnings: tuple[str, ...] = ()  # oddities, for the author of the file
    tangents: Floats | None = None  # (n, 4), as glTF's TANGENT: a direction of any length, zero for none; handedness
    # (m,) the smoothing group of each triangle: computed normals are shared within a group, and 0 has facets. None:
    # one group, or normals from the file.
    groups: Indices | None = None
    oddities: MeshOddities = MeshOddities()

    @property
    def smoothing(self) -> Indices | bool:
        """How the file asks to be shaded: by vertex normals or not, or by groups of triangles."""
        return True if self.groups is None else self.groups

    @property
    def bounds(self) -> tuple[Doubles, Doubles]:
        """The least and the greatest coordinates of its triangles; a vertex of none does not count."""
        used = np.zeros(len(self.vertices), bool)
        used[self.faces] = True
        corners = self.vertices[used]
        return corners.min(axis=0), corners.max(axis=0)


def array_bytes(parsed: object) -> int:
    """The bytes of the arrays that are its members."""
    return sum(value.nbytes for value in vars(parsed).values() if isinstance(value, np.ndarray))


@dataclass(frozen=True)
class ImageData:
    """Texels as stored, row 0 at the top of the image; nothing is decoded from sRGB. The array is read-only."""

    pixels: npt.NDArray[np.float32] | npt.NDArray[np.uint8]  # (height, width, 1 | 3 | 4), finite; 16 bits became 0..1
    warnings: tuple[str, ...] = ()  # about statements in the file that are ignored
    layers: tuple[str, ...] = ()  # the names of an EXR's layers, where it has several

    @property
    def is_8bit(self) -> bool:
        """True if the texels are bytes as the file has them, not floats."""
        return self.pixels.dtype == np.uint8


@dataclass(frozen=True)
class LutData:
    """A table from displayed colours to displayed colours, even over its domain. The array is read-only."""

    values: Floats  # (n, 3), a curve for each channel; or (n, n, n, 3), by blue, green and red; finite
    low: tuple[float, float, float]  # where the domain begins and ends
    high: tuple[float, float, float]
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class MeasuredData:
    """Reflection as it was measured, by tables. The arrays are read-only.

    With `facets` they are of an adaptive parameterization [Dupuy & Jakob 2018], else `values` is (90, 90, 180, 3),
    1/sr, over half and difference angles, as MERL files have it. `density` says how likely directions shall be drawn:
    with `facets` over the places that `visible` then takes to facets' normals, else over these normals.
    """

    values: Floats  # with facets: (phi, theta, rows, columns, 3), over those places
    theta: Floats  # angles of the viewer to the normal, growing
    phi: Floats  # and about it; one where the surface looks the same from all sides
    density: Floats  # (phi, theta, rows, columns), not negative
    limits: Floats  # (angles, 3): factors for each of both directions, 0 to 90 degrees; none: no direction has one
    albedo: tuple[float, float, float]  # what of light from all sides comes back
    visible: Floats | None = None  # (phi, theta, rows, columns): the density of the facets that the viewer sees
    facets: Floats | None = None  # (rows, columns): the density of facets
    areas: Floats | None = None  # (rows, columns): their area as a direction sees it
    symmetry: int = 1  # `phi` covers this part of the circle: 1, 2 (a half turn) or 4 (mirrored twice)
    is_relative: bool = True  # values are to be multiplied by `facets` over 4 `areas`
    warnings: tuple[str, ...] = ()

    @property
    def texels(self) -> int:
        """About how many texels of sixteen bytes the renderer makes of it."""
        tables = (self.density, self.visible, self.facets, self.areas)
        return self.values.size // 3 + sum(table.size for table in tables if table is not None)


@dataclass(frozen=True)
class RenderedPicture:
    """A render as an EXR with the layer `variance` describes it. The array is read-only."""

    layers: Floats  # (height, width, 6), finite: colour and the variance of each channel's mean
    samples: int  # of each pixel
    seed: int
    denoised: bool
    ways: tuple[str, str, int]  # how light was found: estimator, sampler, depth from which paths may end


@dataclass(frozen=True)
class ScenePart:
    """A separate file for a part of a scene: a mesh as PLY, or an image as it was (then without counts)."""

    data: bytes | memoryview
    pointer: str  # where it came from
    vertices: int | None = None
    triangles: int | None = None
    bounds: list[list[float]] | None = None  # of a mesh: least and greatest x, y, z, m


@dataclass(frozen=True)
class Animation:
    """One of the animations of a scene's file."""

    name: str
    duration: float  # s; it begins at 0


@dataclass(frozen=True)
class Pose:
    """How a scene's file is shown, where that is not as it was saved. The names are ones that it has."""

    variant: str | None = None  # of its materials
    animation: str | None = None
    time: float = 0.0  # s, in the animation

    @property
    def is_default(self) -> bool:
        return self.variant is None and self.animation is None


@dataclass(frozen=True)
class SceneFile:
    """A file that is a whole scene. `document` refers to `parts[k]` as "part:k".

    A file without lights has no environment here; the caller adds a default one.
    """

    document: dict[str, Any]
    parts: list[ScenePart]
    warnings: list[dict[str, Any]]  # unsupported features: [{pointer, detail, count?}]
    triangles: int
    lit: bool
    exposure: float | None = None  # stops that suit its lights; None: 0 does
    aspect_ratio: float | None = None  # of its camera's picture, width over height
    bounds: list[list[float]] | None = None  # of its triangles where they stand: least and greatest x, y, z, m
    variants: list[str] = field(default_factory=list)  # of its materials
    animations: list[Animation] = field(default_factory=list)


@dataclass(frozen=True)
class TakenFile:
    """A model of a zip as a file of its own, or as a zip with its parts alone."""

    name: str
    data: bytes | memoryview


@dataclass(frozen=True)
class AssetInfo:
    """The answer to an upload. A mesh has no width and an image no triangles: those are None.

    `warnings`, `[{pointer, detail, count?}]`, are about oddities, and about unsupported parts of a scene; a
    pointer is into the file's own JSON, or FILE:LINE of an OBJ's files, the first of `count` places.
    """

    id: str
    kind: Kind
    format: str
    bytes: int
    width: int | None = None
    height: int | None = None
    channels: int | None = None
    vertices: int | None = None
    triangles: int | None = None
    bounds: list[list[float]] | None = None  # of the triangles of a mesh or a scene: least and greatest x, y, z, m
    warnings: list[dict[str, Any]] | None = None
    exposure: float | None = None  # in stops, that suits a scene's lights; None: 0 does
    aspect_ratio: float | None = None  # of the picture of a scene's camera, width over height
    variants: list[str] | None = None  # of a scene's materials, by name
    animations: list[dict[str, Any]] | None = None  # of a scene: [{name, duration}], s
    layers: list[str] | None = None  # of an EXR with several, by name; "" is the one of plain R, G and B


@dataclass(frozen=True)
class AssetLimits:
    """Bounds on one file, on the process that parses it, and on the cache in memory."""

    max_triangles: int = 16_000_000
    max_texels: int = 1 << 26  # 8192 x 8192: as float32 RGBA 1 GiB
    max_file: int = 1 << 30
    seconds: float = 20.0  # wall and processor time for one file
    memory: int = 8 << 30  # bytes, for one file, however much its kind may need
    cache_bytes: int = 512 << 20
    children: int = 3  # at a time, two of one caller


class Assets(Protocol):
    """The assets to which a scene's references lead. Its methods raise AssetError, and any thread may call them."""

    def mesh(self, ref: str) -> MeshData: ...

    def image(self, ref: str, layer: str = "") -> ImageData:
        """Of an EXR the layer of this name. A refusal of the name has the pointer LAYER."""
        ...

    def measured(self, ref: str) -> MeasuredData: ...


class HasLimits(Protocol):
    """The part of the configuration that concerns assets."""

    @property
    def max_triangles(self) -> int: ...

    @property
    def max_texels(self) -> int: ...

    @property
    def max_asset(self) -> int: ...

    @property
    def parse_seconds(self) -> float: ...

    @property
    def parse_memory(self) -> int: ...


def asset_limits(config: HasLimits | None) -> AssetLimits:
    if config is None:
        return AssetLimits()
    return AssetLimits(
        max_triangles=config.max_triangles,
        max_texels=config.max_texels,
        max_file=config.max_asset,
        seconds=config.parse_seconds,
        memory=config.parse_memory,
    )
