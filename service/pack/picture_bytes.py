"""How many bytes a picture takes, from the renderer's own table of what it stores of a pixel."""

from gpu.layout.pixel_layers import ACCUMULATOR_BYTES, FIRST_HIT_BYTES, VECTOR_BYTES

# Bytes of a pixel in a checkpoint: all samples, and a block of them, which the last picture may lack.
SAVED_PIXEL_BYTES = 2 * ACCUMULATOR_BYTES
# Bytes of a pixel in the renderer: the same, AOVs, and the denoised picture with a copy of it on its way.
RENDERED_PIXEL_BYTES = SAVED_PIXEL_BYTES + FIRST_HIT_BYTES + 2 * VECTOR_BYTES
