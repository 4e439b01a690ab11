"""A scene as finished arrays, which `service.pack` makes and the renderer uploads as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
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


@dataclass(frozen=True)
class TextureArrays:
    """What the scene's textures are made of, and how its materials use them.

    `slots`: the members of `layout.Material` that any material has textured (and "normal", "coat_normal"), with the
    slot that gives each its texel; those of `texture_records.OTHER_RANGES` have slots of their own, after all others.
    """

    slots: dict[str, int]
    words: np.ndarray  # (materials, n) uint32: its `TextureSlot`s, then a `TextureUse` for each member
    texels: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.uint8))  # of 8-bit images, in a row
    floats: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.float32))  # of all others
    key: str = ""  # equal where the texels are


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
    instance_shift: int = 0  # bits of the number of the most triangles that an instance has
    bvh_kinds: frozenset[ShapeKind] = frozenset()
    large: Mapping[ShapeKind, int] = field(default_factory=dict)
    environment: EnvironmentArrays | None = None
    textures: TextureArrays | None = None
    radiance_scale: float = 1.0  # about the largest radiance a picture of it will hold; a power of two
    origin: Vec3 = (0.0, 0.0, 0.0)

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
    nodes: np.ndarray
    node_count: int
    node_origin: Vec3
    node_scale: Vec3
    radiance_scale: float


def apply_edit(
    arrays: SceneArrays,
    camera: np.void | None = None,
    materials: np.ndarray | None = None,
    texture_words: np.ndarray | None = None,
    microfacets: np.ndarray | None = None,
    environment: tuple[float, float] | None = None,
    environment_map: EnvironmentArrays | None = None,
    moved: MovedArrays | None = None,
) -> SceneArrays:
    """The arrays after an edit. None leaves a part as it is.

    `materials` are as many records as before, `texture_words` their `TextureArrays.words`, `microfacets` the words of
    the model `microfacet`, `environment_map` is another environment in the place of one, and `environment` its
    (rotation, scale). The arrays of `moved` have the same lengths as before,
    except that the scene's tree may differ in length where there are instances. Raises ValueError for another number
    of materials.
    """
    changes: dict[str, Any] = dict(moved or {})
    if camera is not None:
        changes["camera"] = camera
    if materials is not None:
        if len(materials) != len(arrays.materials):
            raise ValueError(f"{len(materials)} materials for a scene of {len(arrays.materials)}")
        changes["materials"] = materials
    if texture_words is not None and arrays.textures is not None:
        changes["textures"] = replace(arrays.textures, words=texture_words)
    if microfacets is not None:
        changes["microfacets"] = microfacets
    lit = arrays.environment if environment_map is None else environment_map
    if environment is not None and lit is not None:
        rotation, scale = environment
        lit = replace(lit, rotation=rotation, scale=scale)
    if lit is not arrays.environment:
        changes["environment"] = lit
    return replace(arrays, **changes)
