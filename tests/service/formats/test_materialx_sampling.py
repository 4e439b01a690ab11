"""Images in MaterialX graphs, at any coordinates."""

from __future__ import annotations

import numpy as np

from service.formats import ImageData
from service.formats.read.materialx.evaluation import sampled
from service.formats.surface.trees import Tree

PIXELS = np.random.default_rng(5).integers(0, 256, (2, 2, 3), np.uint8)


def test_colours_are_decoded_before_they_are_mixed() -> None:
    """In the middle of four texels, that is their mean; one beside the border is half that of the other side."""
    own = PIXELS / 255
    linear = np.where(own <= 0.04045, own / 12.92, ((own + 0.055) / 1.055) ** 2.4)
    places = np.array([[0.5, 0.5], [0.25, 0.75], [0.0, 0.75]], np.float32)
    for space, texels in (("srgb", linear), ("linear", own)):
        found = sampled(ImageData(PIXELS), places, Tree("image", 3, texts={"space": space}))
        expected = [texels.mean((0, 1)), texels[0, 0], texels[0].mean(0)]
        assert np.allclose(found[:, :3], expected, atol=1e-5), space
