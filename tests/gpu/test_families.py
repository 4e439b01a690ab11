"""The kernels by which tests trace their pictures show what the product's own kernels show."""

from __future__ import annotations

import numpy as np
import pytest

from gpu import RenderSettings
from gpu.kernels.flag_table import FLAGS
from service.pack import pack
from service.scene import parse_scene
from tests.families import BASE, GROUPS, FamilyRenderer, family
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


def test_a_family_has_what_its_scene_needs_and_whole_groups() -> None:
    raised = frozenset({"HAS_TRANSMISSION", "HAS_PRINCIPLED", "HAS_FILM"})
    found = family(raised)
    assert found is not None and found >= raised | BASE | GROUPS["glass"] | GROUPS["principled"]
    assert found.isdisjoint(GROUPS["textures"])
    assert set(FLAGS) >= BASE.union(*GROUPS.values())
