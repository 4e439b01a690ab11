"""Where kernels find what they read and write: binding points of buffers and blocks, and texture units."""

from __future__ import annotations

from enum import IntEnum


class Slot(IntEnum):
    """Binding points of the storage buffers. The last three serve several kernels, under a name for each use."""

    MATERIALS = 0
    SPHERES = 1
    QUADS = 2
    BOXES = 3
    ELLIPSOIDS = 4
    TRIANGLES = 5
    TRIANGLE_NORMALS = 6
    NODES = 7
    LIGHTS = 8
    ENVIRONMENT_CELLS = 9
    SUM = 10
    COMPENSATION = 11
    MOMENTS = 12
    OUTPUT = 15  # what a kernel computes
    # guides.comp: the first hit
    ALBEDO = 13
    NORMAL = 14
    FIRST_HITS = 15
    # cover.comp
    SHAPE_COVER = 13
    MATERIAL_COVER = 14
    # pathtrace.comp
    COUNTERS = 13
    SAMPLE_PLAN = 14
    PLANNED_AREAS = 15
    # lighttrace.comp
    SPLATS = 10
    LIGHT_SOURCES = 14
    # meter.comp
    METER_PLACES = 14
    # resolve.comp: tables of displays and looks, and light of lamps
    TABLES = 13
    LIGHT_SUMS = 14
    # prior.comp, prior_warp.comp
    BEFORE = 13
    CHANGE = 14
    AFTER = 15
    DEPTHS = 14


class BlockSlot(IntEnum):
    """Binding points of the accumulators of a block of samples, in kernels that read no scene."""

    SUM = 0
    COMPENSATION = 1
    MOMENTS = 2


class GuessSlot(IntEnum):
    """Binding points of the guess that a picture is shown with, in resolve.comp."""

    SUM = 3
    MOMENTS = 4


UNIFORM_BLOCK = 0  # binding points of uniform blocks
FILTER_BLOCK = 1
# Binding points, as uniform blocks, of the buffers whose NAME_COUNT kernels are compiled for, where it is above 0.
COUNTED = {"material": 2, "sphere": 3, "quad": 4, "box": 5, "ellipsoid": 6, "triangle": 7, "light": 8}
ENVIRONMENT_TEXTURE = 0  # this and the following ones are texture units
BYTES_TEXTURE, FLOATS_TEXTURE = 8, 9  # texels of images
UVS_TEXTURES = (10, 11)  # texture coordinates of triangles' corners, by uv set
COLORS_TEXTURE = 12
LIGHT_TREE_TEXTURE = 13
INSTANCES_TEXTURE = 14  # records in a texture, as all storage buffers are taken
MICROFACETS_TEXTURE = 5  # records of the model `microfacet` and their tables
MEASURED_TEXTURE = 15  # records of the model `measured` and their tables
SPACES_TEXTURE = 6  # the shapes' own coordinates
BODIES_TEXTURE = 17  # what fills the shapes
ENERGY_TEXTURES = {
    "albedo": 1,
    "stretched": 2,
    "mean": 3,
    "sheen": 4,
    "fuzz": 7,
    "facets": 16,  # OpenGL promises 16 units; drivers have 32
}  # of gpu.tables.energy
FILM_TEXTURE = 18  # of gpu.tables.film
TEXELS_A_ROW = 8192  # width of the textures that hold one long row of values, cut into rows
