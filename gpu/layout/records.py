"""The bytes that the host and the shaders share, declared once.

Each record yields a numpy dtype and, in `kernels/layout_glsl.py`, a struct, a buffer and a loader; `texture_records`
declares those of textures, `bindings` the places where kernels find it all. Shaders get all of it through
`#include "layout.glsl"`, which exists only in memory. Buffers are arrays of 32-bit words in groups of four (or two):
llvmpipe fetches a uvec4 for the price of one float, so a record is read with as few fetches as it has groups.
"""

from __future__ import annotations

from enum import IntEnum

from gpu.layout.bindings import Slot
from gpu.layout.record import Record, f32, u32, uvec2, vec2, vec3, vec4

NONE = 0xFFFFFFFF  # "no light", "no shape": an index that no array reaches
NOT_VAST = 3.4e38
ABSENT = -1.0  # a material's number that was not given
LEAST_ROUGHNESS = 0.01  # a `principled` surface or coat with less is a mirror
LUMINANCE = (0.2126, 0.7152, 0.0722)  # weights of linear Rec.709
TEXTURED = 1e-30  # a material's number that a texture gives: above 0, so that it raises the flags it may need
# In TriangleNormals.bits: NORMALS_SMOOTH: the corners' normals are interpolated; NORMALS_LEFT: v grows to the right
# of u, seen from outside. From TANGENT_SHIFT on follow three codes of TANGENT_BITS each: 0 for no tangent, else 1 +
# its angle in the plane of the corner's normal, in steps. A step is 0.35 degrees, less than a normal map of 8 bits
# resolves; a right angle is a whole number of steps.
NORMALS_SMOOTH, NORMALS_LEFT = 1, 2
TANGENT_SHIFT, TANGENT_BITS, TANGENT_STEPS = 2, 10, 1020


class ShapeBit(IntEnum):
    """Bits beside the index of a shape, in its records."""

    SINGLE_SIDED = 0x80000000  # of a triangle: rays that come from behind pass it
    HIDDEN = 0x40000000  # the camera looks through it
    # Of a quad: only the ellipse that touches its four edges is there, which is a disk; of a box: only the cylinder
    # about its y axis that touches its faces.
    ROUND = 0x20000000
    OPEN = 0x10000000  # of a cylinder: it has no caps


SOLID_BITS = ShapeBit.ROUND | ShapeBit.OPEN  # those that say which shape the record of a box is
SHAPE_BITS = ShapeBit.SINGLE_SIDED | ShapeBit.HIDDEN | SOLID_BITS


class ShapeKind(IntEnum):
    SPHERE = 0
    QUAD = 1
    BOX = 2
    ELLIPSOID = 3
    TRIANGLE = 4
    INSTANCE = 5  # of triangles that have a tree of their own; never in a loop


class CameraKind(IntEnum):
    PERSPECTIVE = 0  # a thin lens
    ORTHOGRAPHIC = 1
    PANORAMA = 2


class LightKind(IntEnum):
    """Kinds of lights. Those from SPHERE on are shapes, which emit by their material."""

    POINT = 0
    ENVIRONMENT = 1
    SPOT = 2
    DIRECTIONAL = 3
    SPHERE = 4
    QUAD = 5
    TRIANGLE = 6
    ELLIPSOID = 7
    CYLINDER = 8  # the side of one, which is among the boxes


class Material(Record):
    slot = Slot.MATERIALS
    base_color: vec3  # linear Rec.709 reflectance, each channel in [0, 1]; diffuse's albedo
    roughness: f32  # perceptual, [0, 1]
    emission: vec3  # radiance, W / (m^2 sr) per channel
    metallic: f32
    model: u32  # models.Model.number
    subsurface: f32
    specular: f32
    specular_tint: f32
    anisotropic: f32
    sheen: f32
    sheen_tint: f32
    clearcoat: f32
    clearcoat_gloss: f32
    opacity: f32  # the chance that a ray meets the surface
    emission_sides: u32  # 1: the outward side emits; 2: both do
    sheen_roughness: f32
    phong_specular: vec3  # of phong and blinn_phong; their diffuse is base_color
    shininess: f32  # exponent, >= 0
    ambient: vec3  # radiance added wherever a path meets the surface
    transmission: f32
    attenuation_color: vec3  # what is left of light after attenuation_distance inside
    attenuation_distance: f32  # ABSENT: clear
    specular_color: vec3
    clearcoat_roughness: f32  # ABSENT: from clearcoat_gloss
    sheen_color: vec3  # ABSENT: from sheen_tint
    anisotropic_rotation: f32  # degrees
    ior: f32  # inside over outside; ABSENT: from `specular`
    cutoff: f32  # an opacity of at least this counts as 1, any other as 0; ABSENT: it is a chance
    alpha: f32  # parameter of microfacet's distribution; its f0 is specular_color, its diffuse base_color
    number: u32  # of the material in the scene: microfacet's record
    diffuse_transmission_color: vec3  # of a thin wall; ABSENT: base_color
    diffuse_transmission: f32  # share of a thin wall's diffuse light that goes through
    # of openpbr, whose transmission_color is attenuation_color
    coat_color: vec3  # what is left of light that crosses the coat twice, straight
    coat_ior: f32
    conductor_eta: vec3  # of a metal of `principled`; ABSENT: it has its base_color
    base_weight: f32
    conductor_k: vec3  # its extinction coefficient
    diffuse_roughness: f32
    coat_darkening: f32
    coat_anisotropy: f32
    coat_rotation: f32  # degrees
    thin_walled: f32  # 1: its surfaces are walls without an inside
    dispersion: f32  # 1 over the Abbe number; 0: the same index for all wavelengths
    film_weight: f32  # the share of the surface that a thin film covers; 1 for `principled`
    film_thickness: f32  # nm
    film_ior: f32
    subsurface_color: vec3  # of what is under the surface, where it is the model's `walk_color`
    subsurface_g: f32  # mean cosine of scattering there
    subsurface_radius: vec3  # mean free path there, m; ABSENT: all light comes back where it enters
    scatter_g: f32  # mean cosine of scattering behind a surface that transmits
    scatter_color: vec3  # rate of scattering there, times attenuation_distance


class Sphere(Record):
    slot = Slot.SPHERES
    center: vec3
    radius: f32
    rotation: vec4  # quaternion (x, y, z, w), world from object: where the poles and the meridian are
    material: u32
    light: u32  # its place among the lights, or NONE
    shape: u32  # index in the scene document
    power: f32  # |center|^2 - radius^2 in float64, where the surface of a vast ball passes the origin; else NOT_VAST


class Quad(Record):
    """A parallelogram; with ROUND the disk in it, an ellipse where a transform stretches it."""

    slot = Slot.QUADS
    origin: vec3
    material: u32
    normal: vec3  # unit, outward: along cross(u, v), against it where a transform mirrors
    light: u32
    dual_u: vec3  # unit, across v in the plane: dot(p - origin, dual_u) is 0..u_length inside
    u_length: f32  # between those two sides: |u| of a rectangle
    dual_v: vec3
    v_length: f32
    u: vec3
    area: f32
    v: vec3
    shape: u32  # index in the scene document, with ROUND and HIDDEN


class Solid(Record):
    """A unit sphere (ellipsoid) or the cube [-1, 1]^3 (box) under an affine map: object = rows (world - center)."""

    center: vec3
    material: u32
    row_x: vec3  # rows of object_from_world
    light: u32
    row_y: vec3
    shape: u32
    row_z: vec3


class Triangle(Record):
    slot = Slot.TRIANGLES
    v0: vec3
    material: u32
    v1: vec3
    light: u32
    v2: vec3
    shape: u32  # index in the scene document, with SINGLE_SIDED


class Instance(Record):
    """Triangles with a tree of their own under an affine map: object = rows (world - center).

    Their normals and what they have at their corners are where theirs are; material, shape and its bits are here.
    """

    row_x: vec3  # rows of object_from_world
    first: u32  # triangle; the leaves count from there
    row_y: vec3
    shape: u32  # index in the scene document, with HIDDEN
    row_z: vec3
    side: f32  # -1 where the map mirrors, else 1
    center: vec3
    material: u32
    node_origin: vec3  # object position of grid coordinate 0
    node_first: u32  # of its tree's nodes, whose links count from there
    node_scale: vec3
    node_count: u32  # of one octant's order of the top
    axis_x: vec3  # columns of world_from_object
    axis_z_x: f32
    axis_y: vec3
    axis_z_y: f32
    error: vec3  # in units of a rounding: what the maps lose of a place on the way out and back
    axis_z_z: f32


class ShapeSpace(Record):
    """The way from the world to a shape's own coordinates: object = rows world + move."""

    row_x: vec3
    move_x: f32
    row_y: vec3
    move_y: f32
    row_z: vec3
    move_z: f32


class Body(Record):
    """The medium that fills a shape, besides what its material absorbs; the first one is what is outside of all."""

    extinction: vec3  # 1/m
    g: f32  # mean cosine of scattering
    scattering: vec3  # 1/m
    priority: f32
    emission: vec3  # W / (m^3 sr)
    material: u32  # of the shape


class TriangleNormals(Record):
    slot = Slot.TRIANGLE_NORMALS
    n0: u32  # octahedral, 2 x 16 bits snorm (packSnorm2x16)
    n1: u32
    n2: u32
    bits: u32  # NORMALS_*, TANGENT_*


class Node(Record):
    """One box of the threaded tree, quantised to 16 bits a side, rounded outwards."""

    slot = Slot.NODES
    x: u32  # low half: lower bound; high half: upper bound, in units of the grid
    y: u32
    z: u32
    link: u32  # inner: index to go on at when the box is missed. Leaf: see LEAF_*; treelet: see TREELET_*


class Light(Record):
    slot = Slot.LIGHTS
    position: vec3  # point lights and spots
    kind: u32  # LightKind
    intensity: vec3  # W/sr, points and spots; directional: radiance of the disk, or irradiance; 0 for shapes
    index: u32  # into the array of the shape's kind
    probability: f32  # of being picked; of a light in the tree: the part that does not go by the tree
    threshold: f32  # alias table: keep this light where u < threshold; of a light in the tree: its intensity
    alias: u32  # else take that one; of a light in the tree: bit k says which child leads to it at depth k
    material: u32
    direction: vec3  # the way the light travels; a spot's is scaled, see spot.glsl
    spread: f32  # spot: see spot.glsl; directional: 1 - cos of the disk's half angle, 0: no disk


class LightTreeHead(Record):
    """The first words of the lights' tree: how the numbers 0 .. LIGHT_CODES - 1 are dealt out, and its grid."""

    near: u32  # below: the tree's lights; from there on those at infinity, by their alias table
    even: u32  # below: the tree's lights alike; from there to `near` down the tree
    even_shift: u32  # the power of two of numbers that each then has
    far_first: u32  # the first light that is not in the tree
    origin: vec3  # world position of grid coordinate 0
    inverse_step: f32  # grid steps a metre


class LightNode(Record):
    """Bounds of some lights; the two children of a node stand side by side, the pair k at 2 k and 2 k + 1."""

    place: u32  # middle of a ball around them, in grid steps: x, y << 16
    reach: u32  # z; the ball's radius << 16; sine of half the angle of the normals' cone << 24, of 255
    # The cone's axis, octahedral 2 x 8 bits; sine of half the angle from a normal at which light leaves << 16, of 31
    # for a right one; intensity << 21
    shine: u32
    link: u32  # the pair of its children, with CLUSTER_BIT; a light: LEAF_BIT | its index


class LightCluster(Record):
    """A node whose lights are drawn by an alias table where they are far; that of the pair k at 2 far_first + k."""

    first: u32  # its table's first entry, among all words
    count: u32
    inverse_intensity: f32  # of all of them, in the unit of Light.threshold


class LightClusterEntry(Record):
    light: u32
    alias: u32  # the light to take where u >= threshold
    threshold: f32


class EnvironmentCell(Record):
    """One of many drawn with equal chances: see `cells`."""

    slot = Slot.ENVIRONMENT_CELLS
    corner: u32  # of its block: x, y << 16, in texels
    size: u32  # of its block: width, height << 16
    first: u32  # the first of the block's cells ...
    count: u32  # ... and how many there are


class Camera(Record):
    """In the scene's (rebased) coordinates; right, up and forward are orthonormal."""

    position: vec3
    aperture_radius: f32  # of the lens; 0: a pinhole
    right: vec3
    focus_distance: f32  # along forward
    up: vec3
    half_height: f32  # of the picture: a lens's tangent of half the vertical field of view, else m
    forward: vec3
    kind: u32  # CameraKind


class Uniforms(Record):
    """The uniform block of one dispatch."""

    camera: Camera
    lamps_x: vec4  # where lamps are that distances in media are drawn towards
    lamps_y: vec4
    lamps_z: vec4
    lamps_intensity: vec4  # W / sr; 0: there is none
    environment_turn: vec2  # cosine, sine of the rotation
    resolution: uvec2  # of the whole picture
    tile_origin: uvec2
    tile_size: uvec2
    sample_first: u32
    sample_count: u32
    max_bounces: u32
    roulette_depth: u32
    node_origin: vec3  # world position of grid coordinate 0
    seed: u32
    node_scale: vec3  # world size of one grid step
    node_count: u32  # of one octant's order of the top
    light_count: u32
    replicate: u32  # 0: the picture's own scramble of the sampler; 1: the noise meter's, from the first one on
    clamp_radiance: f32  # of indirect light; infinite: off
    environment_probability: f32  # of picking the environment among the lights
    moment_scale: f32  # second moments are of radiance times this
    environment_background: u32
    slot_width: u32  # of a row of the accumulators: the picture's, or the noise meter's
    environment_cube: u32  # 1: its texture holds the six faces of a cube
    environment_sun: vec3  # unit, towards the sun's middle, before the environment's rotation
    environment_sun_cap: f32  # 1 - cos of its angular radius
    environment_sun_radiance: vec3
    environment_sun_share: f32  # of the environment's samples
    environment_scale: f32  # factor on the environment's radiance
    slot_first: u32  # the pixel at the beginning of the bound part of the accumulators
    sun_first: u32  # among the lights: directional ones with a disk stand side by side
    sun_count: u32
    looped_spheres: u32  # how many stand in the kernel's loop, for one that was not compiled for their number
    looped_quads: u32
    looped_boxes: u32
    looped_ellipsoids: u32
    looped_triangles: u32
    looped_textures: u32  # slots that a surface is made from, for a kernel that was not compiled for their number
    group_stride: u32  # places from one work group to the next; see gpu.picture.schedule.group_stride
    footprint_share: f32  # of a pixel's width: that of the footprint of one camera ray; see gpu.picture.filters
    filter_glossy: f32  # least roughness after a path's first scattering
    glint_chance: f32  # least of reflection, and of refraction, at a smooth surface that the camera sees
    estimator: u32  # its place in `gpu.settings.ESTIMATORS`, for a kernel that was not compiled for one
    sampler: u32  # likewise
    # These two stay the last: kernels without instances lack them (gpu/kernels/instances_glsl.py).
    node_first: u32  # of the tree's nodes: those of instances lie before
    instance_shift: u32  # of an instance's number in an id, above its triangle's


WORK_GROUP = 8  # invocations a side of the work groups of kernels over pixels; fewer than 8 can hang llvmpipe
BSDF_GROUP = 64  # invocations of a work group of the kernels that evaluate a BSDF
# Pixels a side of the areas of a sample plan, each of which is a work group of the path tracer.
PLAN_AREA = WORK_GROUP
PLAN_CLASSES = 4  # of an area's rows, each planned by itself: llvmpipe works on a row of eight pixels at once
METER_REPLICATES = 8  # more than the noise meter takes of a pixel; the replicate's number over this is x's fraction

BUFFERS: dict[str, tuple[type[Record], Slot]] = {
    "material": (Material, Slot.MATERIALS),
    "sphere": (Sphere, Slot.SPHERES),
    "quad": (Quad, Slot.QUADS),
    "box": (Solid, Slot.BOXES),
    "ellipsoid": (Solid, Slot.ELLIPSOIDS),
    "triangle": (Triangle, Slot.TRIANGLES),
    "triangle_normals": (TriangleNormals, Slot.TRIANGLE_NORMALS),
    "light": (Light, Slot.LIGHTS),
    "environment_cell": (EnvironmentCell, Slot.ENVIRONMENT_CELLS),
}
