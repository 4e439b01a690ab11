"""The bytes of measured reflection, the model `measured`.

One texture holds them: the record of each material of the scene, in their order, and behind them the tables. Their
numbers are floats but for colours, of which a texel has two neighbours as halves, in units of `scale`:

- of half and difference angles: (90, 90, 180), as MERL files have it;
- of an adaptive parameterization: for each of the viewer's directions a table over the unit square.

A density over the unit square that is drawn from has for each of the viewer's directions a texel a row, (its integral
up to there, that along the row, that along the next row), and one a node, (the density, that of the next row, the
integral along the row up to there, that along the next row).
"""

from __future__ import annotations

from enum import IntEnum

from gpu.layout.record import Record, f32, u32, vec3


class MeasuredKind(IntEnum):
    NONE = 0
    HALF_DIFFERENCE = 1
    ADAPTIVE = 2


COLUMNS_BITS = 16  # of a size: rows stand above the columns
HALF_DIFFERENCE_SHAPE = (90, 90, 180)
LIMIT_ANGLES = 91  # factors for directions, a degree apart


class Measured(Record):
    kind: u32  # MeasuredKind
    values: u32  # the first texel of this table; the others likewise
    values_size: u32  # its rows and columns; of an adaptive parameterization
    limits: u32  # factors for both directions; 0: there are none
    angles: u32  # of the viewer: theta and then phi, a texel each
    thetas: u32
    phis: u32
    symmetry: u32  # of the circle phi covers this part
    sampling: u32  # the density from which directions are drawn
    sampling_size: u32
    visible: u32  # that of the facets that the viewer sees; of an adaptive parameterization
    visible_size: u32
    facets: u32  # the density of all facets, a node a texel
    facets_size: u32
    areas: u32  # their area as a direction sees it, likewise; 0: values are not relative to facets and areas
    areas_size: u32
    albedo: vec3  # of light from all sides
    scale: f32
