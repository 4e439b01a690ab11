"""A scene as finished arrays, which `service.pack` makes and the renderer uploads as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypedDict

import numpy as np

from gpu import layout
from gpu.layout import ShapeKind
from gpu.layout.record import Record
from gpu.tables.sky import SunDisk

Vec3 = tuple[float, float, float]

# The least number of triangles of a mesh that may be an instance; a smaller one costs less in the scene's own tree.
SHAREABLE = 1 << 10
# The least number of triangles of a mesh that becomes an instance because a stream moves it: to pack such a mesh
# again takes 0.05 s, and the kernel with instances takes a quarter more time for a sample.
HEAVY = 1 << 15


@dataclass(frozen=True)
class EnvironmentArrays:
    """Light from infinity: (h, w, 3) float32 radiance, row 0 at the top (v = 0), latitude-longitude.

    A constant environment is one texel. `probability` (h, w) float32 is the density per steradian with which
    `cells` (`layout.EnvironmentCell`) pick a direction in that texel, at rotation 0.

    With `cube` the map is six faces of n x n texels, (2 n, 3 n, 3): px nx py above ny pz nz, and `probability` is per
    unit of area of the cube from -1 to 1. A `sun` shines on top of the map and takes `sun_share` of the samples.
    """

    texels: np.ndarray
    probability: np.ndarray
    cells: np.ndarray
    rotation: float  # radians about +Y
    scale: float
    background: bool
    cube: bool = False
    sun: SunDisk | None = None
    sun_share: float = 0.0
    key: str = ""  # equal where all but rotation, scale and background are

    @property
    def bytes(self) -> int:
        return self.texels.nbytes + self.probability.nbytes + self.cells.nbytes

    def has_map_of(self, other: EnvironmentArrays) -> bool:
        """True if this is the other one, turned or brightened at most: all of their other members are the same."""
        names = (each.name for each in fields(self) if each.name not in ("rotation", "scale", "key"))
        return all(getattr(self, name) is getattr(other, name) for name in names)


@dataclass(frozen=True)
class TextureArrays:
    """The scene's textures as arrays, and how its materials use them.

    `slots`: the members of `layout.Material` that any material has textured (and "normal", "coat_normal"), with the
    slot that gives each its texel; those of `texture_records.OTHER_RANGES` have slots of their own, after all others.
    """

    slots: dict[str, int]
    # (materials, n) uint32: its `TextureSlot`s, a `TextureUse` for each member, and where any slot has one a
    # `TextureRecipe` for each, with room for this number of stops.
    words: np.ndarray
    texels: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.uint8))  # of 8-bit images, in a row
    floats: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.float32))  # of all others
    key: str = ""  # equal where the texels are
    stops: int | None = None  # None: no slot has a recipe


def _empty(record: type[Record]) -> np.ndarray:
    return np.zeros(0, record.dtype)


@dataclass
class SceneArrays:
    """Everything the renderer needs. Rays find shapes of kinds in `bvh_kinds` through `nodes`, all others in a loop.

    The first `large` of a kind in `bvh_kinds` stand in the loop, too, instead of among the leaves.

    The triangles of instances follow all others, in the order of their trees' leaves. Links and leaves in
    `instance_nodes` count from the first node and the first triangle of their instance.

    Positions are relative to `origin` (float64, world): what was subtracted before rounding to float32.
    """

    camera: np.void  # layout.Camera
    materials: np.ndarray  # layout.Material
    spheres: np.ndarray = field(default_factory=lambda: _empty(layout.Sphere))
    quads: np.ndarray = field(default_factory=lambda: _empty(layout.Quad))
    boxes: np.ndarray = field(default_factory=lambda: _empty(layout.Solid))
    ellipsoids: np.ndarray = field(default_factory=lambda: _empty(layout.Solid))
    triangles: np.ndarray = field(default_factory=lambda: _empty(layout.Triangle))
    microfacets: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 4), np.uint32)
    )  # as layout.microfacet_records says; none without such a material
    measured: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 4), np.uint32)
    )  # as layout.measured_records says; none without such a material
    measured_key: str = ""  # equal where these are
    triangle_normals: np.ndarray = field(default_factory=lambda: _empty(layout.TriangleNormals))  # none: all flat
    tangents: bool = False  # whether these have tangents, of meshes whose materials run along them
    triangle_uvs: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 2), np.float32))  # none, or all
    triangle_uvs_1: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 2), np.float32))  # of set 1
    triangle_colors: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 4), np.float16))
    lights: np.ndarray = field(default_factory=lambda: _empty(layout.Light))
    light_tree: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 4), np.uint32)
    )  # as by gpu.accel.light_tree.build
    nodes: np.ndarray = field(default_factory=lambda: _empty(layout.Node))  # as by gpu.accel.bvh.thread
    node_count: int = 0  # of one octant's order
    node_origin: Vec3 = (0.0, 0.0, 0.0)
    node_scale: Vec3 = (0.0, 0.0, 0.0)
    instances: np.ndarray = field(default_factory=lambda: _empty(layout.Instance))
    instance_nodes: np.ndarray = field(default_factory=lambda: _empty(layout.Node))  # of all trees
    # Of all shapes, in the document's order, where a material reads a solid texture; else none.
    spaces: np.ndarray = field(default_factory=lambda: _empty(layout.ShapeSpace))
    # Of what is outside, then of all shapes in order, where one is filled or has a priority; else none.
    bodies: np.ndarray = field(default_factory=lambda: _empty(layout.Body))
    instance_shift: int = 0  # bits of the number of the most triangles that an instance has
    bvh_kinds: frozenset[ShapeKind] = frozenset()
    large: Mapping[ShapeKind, int] = field(default_factory=dict)
    environment: EnvironmentArrays | None = None
    textures: TextureArrays | None = None
    radiance_scale: float = 1.0  # about the largest radiance a picture of it will hold; a power of two
    origin: Vec3 = (0.0, 0.0, 0.0)
    # By which layers number the materials, from 0; None: as they stand here.
    material_numbers: tuple[int, ...] | None = None

    @property
    def corner_colors(self) -> np.ndarray:
        """The triangles' colours; white where no triangle has any, for kernels that read them anyway."""
        missing = len(self.triangles) and not len(self.triangle_colors)
        return np.ones((len(self.triangles), 3, 4), np.float16) if missing else self.triangle_colors

    @property
    def light_words(self) -> np.ndarray:
        """The lights' tree. Where there is none, kernels that read it anyway get a head by which no walk begins."""
        return self.light_tree if len(self.light_tree) else np.zeros((2, 4), np.uint32)


class MovedArrays(TypedDict, total=False):
    """The members of `SceneArrays` that say where shapes and lights are, for a scene in which some are others; those
    that are not may be missing."""

    spheres: np.ndarray
    quads: np.ndarray
    boxes: np.ndarray
    ellipsoids: np.ndarray
    lights: np.ndarray
    light_tree: np.ndarray
    instances: np.ndarray
    spaces: np.ndarray
    bodies: np.ndarray
    nodes: np.ndarray
    node_count: int
    node_origin: Vec3
    node_scale: Vec3
    radiance_scale: float


@dataclass(frozen=True)
class SceneEdit:
    """An edit of a scene that is on the device; None leaves a part as it is."""

    camera: np.void | None = None  # layout.Camera
    materials: np.ndarray | None = None  # layout.Material, as many as before
    texture_words: np.ndarray | None = None  # `TextureArrays.words`
    microfacets: np.ndarray | None = None  # as `SceneArrays.microfacets`
    environment: tuple[float, float] | None = None  # rotation and scale
    environment_map: EnvironmentArrays | None = None  # another one in the place of one
    # Of the same lengths as before, except that the scene's tree may differ in length where there are instances.
    moved: MovedArrays | None = None
    material_numbers: tuple[int, ...] | None = None  # as many as materials

    @property
    def needs_kernel(self) -> bool:
        """True if the scene may need another kernel after it. Of an edit of the camera, the camera's flags say."""
        return not self._given.keys() <= {"camera", "environment", "material_numbers"}

    @property
    def restarts(self) -> bool:
        """True if pictures of the scene begin again after it: all but the numbers change what is seen."""
        return not self._given.keys() <= {"material_numbers"}

    @property
    def bytes(self) -> int:
        """Bytes of the parts that may be large."""
        parts = {**(self.moved or {}), **(vars(self.environment_map) if self.environment_map is not None else {})}
        return sum(part.nbytes for part in parts.values() if isinstance(part, np.ndarray))

    @property
    def _given(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if value is not None}

    def then(self, later: SceneEdit) -> SceneEdit:
        """This edit and a later one as one."""
        given = later._given
        if self.moved is not None and later.moved is not None:
            given["moved"] = {**self.moved, **later.moved}
        return replace(self, **given)

    def apply(self, arrays: SceneArrays) -> SceneArrays:
        """The arrays after the edit. Raises ValueError for another number of materials."""
        changes: dict[str, Any] = dict(self.moved or {})
        if self.materials is not None and len(self.materials) != len(arrays.materials):
            raise ValueError(f"{len(self.materials)} materials for a scene of {len(arrays.materials)}")
        parts = ("camera", "materials", "microfacets", "material_numbers")
        changes |= {name: value for name, value in self._given.items() if name in parts}
        if self.texture_words is not None and arrays.textures is not None:
            changes["textures"] = replace(arrays.textures, words=self.texture_words)
        lit = arrays.environment if self.environment_map is None else self.environment_map
        if self.environment is not None and lit is not None:
            rotation, scale = self.environment
            lit = replace(lit, rotation=rotation, scale=scale)
        return replace(arrays, environment=lit, **changes)
