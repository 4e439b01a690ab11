"""The kernels by which tests trace their pictures show what the product's own kernels show."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import RenderSettings
from gpu.kernels.flag_table import FLAGS
from service.document import parse_scene
from service.pack import pack
from tests.families import FAMILIES, FamilyRenderer, family
from tests.gpu.flag_scenes import IMAGES, SCENES
from tests.marks import seldom

# One for lamps, and one for each group of flags that many tests share.
FEW = ("SPOT_LIGHTS", "SMOOTH_NORMALS", "CLEARCOAT", "PRINCIPLED", "STRAIGHT", "BYTE_TEXELS", "SCATTERING")
RARE = [name for name in SCENES if name not in FEW]


@pytest.mark.parametrize("name", seldom(SCENES, RARE))
def test_a_family_shows_what_the_scene_s_own_kernel_shows(gpu: FamilyRenderer, name: str) -> None:
    arrays = pack(parse_scene(SCENES[name]), IMAGES).arrays
    images = []
    for exact in (True, False):
        with gpu.exact(exact):
            loaded = gpu.load(arrays)
        made = gpu.picture(loaded, RenderSettings(48, 32, max_bounces=3, roulette_depth=99))
        made.trace(60.0, 8)
        images.append(made.read())
        made.release()
        loaded.release()
    # A rounding may turn a path at an edge: all but a few pixels agree to rounding, and their mean does.
    assert np.isclose(*images, rtol=1e-3, atol=1e-5).all(2).mean() > 0.985
    assert images[0].mean() == pytest.approx(images[1].mean(), rel=2e-3)


def test_a_scene_is_of_the_first_family_that_has_its_flags() -> None:
    assert family(frozenset({"HAS_QUADS"})) == FAMILIES["matte"]
    assert family(frozenset({"HAS_QUADS", "HAS_PRINCIPLED"})) == FAMILIES["principled"]
    film = frozenset({"HAS_FILM", "HAS_PRINCIPLED"})
    assert family(film) > film and family(film | {"HAS_BVH"}) == film | {"HAS_BVH"}
    assert set(FLAGS) >= frozenset().union(*FAMILIES.values())
