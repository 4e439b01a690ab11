"""The terms of the model `microfacet`, and the bytes of their parameters and tables.

One texture holds them: the record of each material of the scene, in their order, and behind them the tables. A table
has a row for each alpha that it knows: (logarithm of the distribution's factor, `near`, `far`, intervals over a unit
of the axis of directions), and, where the geometry term needs it, the projected area of the facets that a direction
sees, as the four coefficients of a cubic for each interval. `gpu/tables/microfacet.py` makes the rows.
"""

from __future__ import annotations

from enum import IntEnum

from gpu.layout.record import Record, f32, u32, vec3


class Distribution(IntEnum):
    PHONG = 0
    BECKMANN = 1
    GGX = 2
    GTR = 3
    ABC = 4
    SGD = 5
    GAUSSIAN = 6


class Geometry(IntEnum):
    IMPLICIT = 0
    NEUMANN = 1
    COOK_TORRANCE = 2
    KELEMEN = 3
    SCHLICK_GGX = 4
    SMITH = 5
    SMITH_CORRELATED = 6


class Fresnel(IntEnum):
    NONE = 0
    SCHLICK = 1
    COOK_TORRANCE = 2
    DIELECTRIC = 3
    CONDUCTOR = 4


class DiffuseModel(IntEnum):
    LAMBERT = 0
    OREN_NAYAR = 1
    DISNEY = 2
    EON = 3


TERMS: dict[str, type[IntEnum]] = {
    "distribution": Distribution,
    "geometry": Geometry,
    "fresnel": Fresnel,
    "diffuse_model": DiffuseModel,
}
# The term of each kind that kernels compute where no flag of that kind is raised.
PLAIN: dict[str, IntEnum] = {"fresnel": Fresnel.NONE, "diffuse_model": DiffuseModel.LAMBERT}


class Microfacet(Record):
    distribution: u32
    geometry: u32
    fresnel: u32
    diffuse_model: u32
    gamma: f32  # the distribution's second parameter, where it has one
    diffuse_roughness: f32  # [0, 1]; radians for oren_nayar
    table: u32  # the first texel of its table
    rows: u32  # 0: it needs no table; 1: one alpha; else a range of alphas, for a texture that gives alpha
    conductor_eta: vec3  # index of refraction, per channel
    row_scale: f32  # rows over a unit of log(alpha + row_offset)
    conductor_k: vec3  # extinction coefficient, per channel
    row_start: f32  # log(alpha + row_offset) of the first row
    alpha_low: f32  # the range that a textured alpha is clamped to
    alpha_high: f32
    row_offset: f32
    row_texels: u32  # of one row
