"""Layers that a picture stores of every pixel on the device. A layer has a vector of 16 bytes, in a buffer of its
own."""

from __future__ import annotations

from gpu.layout.bindings import Slot

VECTOR_BYTES = 16  # of a vec4 or a uvec4
ACCUMULATORS = (Slot.SUM, Slot.COMPENSATION, Slot.MOMENTS)  # of all samples, and again of a block of them
FIRST_HIT = (Slot.ALBEDO, Slot.NORMAL, Slot.FIRST_HITS)  # AOVs, once one of them was asked for
COVER = (Slot.SHAPE_COVER, Slot.MATERIAL_COVER)  # what covers how much of a pixel, once that was asked for
COVER_RANKS = 6  # ids that a pixel counts; two in a vector, and three vectors in each of these layers
COVER_VECTORS = COVER_RANKS // 2

# Bytes of a pixel.
ACCUMULATOR_BYTES = VECTOR_BYTES * len(ACCUMULATORS)
FIRST_HIT_BYTES = VECTOR_BYTES * len(FIRST_HIT)
COVER_BYTES = VECTOR_BYTES * COVER_VECTORS * len(COVER)
SPLAT_BYTES = 32  # of light that comes from elsewhere: four numbers of 64 bits; where caustics are traced from lights
PLAN_BYTES = 1  # of the plan of `adaptive`, about: it has words of areas, not of pixels
