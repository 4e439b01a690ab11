"""A flag is one row: what the row says is found wherever kernels are chosen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from gpu import RenderSettings, SceneArrays
from gpu.bsdf.kernels import ENTRIES
from gpu.kernels import features
from gpu.kernels.flag import ANYWHERE, Flag
from gpu.kernels.flag_table import FLAGS
from gpu.layout.models import FLAGGED
from gpu.precompile import fallback, kernel_keys
from service.document import parse_scene
from service.document.material import PrincipledMaterial
from service.pack import pack, pack_material
from tests.gpu.flag_scenes import IMAGES, made_of
from tests.rendering import document

NEW = "HAS_NOVELTY"
SETTINGS = RenderSettings(64, 48)
PLASTIC = pack(parse_scene(made_of({"type": "principled"})), IMAGES).arrays
CHALK = pack(parse_scene(document([])), IMAGES).arrays
LONE = pack_material(PrincipledMaterial(type="principled"))


@pytest.fixture
def add(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Adds a row for a flag, of which a scene has need where its camera has an aperture."""

    def added(**row: Any) -> None:
        asks = FLAGS["HAS_APERTURE"].asks
        monkeypatch.setitem(FLAGS, NEW, Flag(NEW, asks, **row))

    return added


def open_(scene: SceneArrays) -> SceneArrays:
    """The scene by a camera with an aperture."""
    camera = scene.camera.copy()
    camera["aperture_radius"] = 0.1
    return replace(scene, camera=camera)


def has(keys: Any) -> list[bool]:
    """For each of the keys whether its kernel has the new flag's code."""
    return [dict(key.defines)[NEW] == 1 for key in keys]


def later(scene: SceneArrays) -> list[bool]:
    return has(kernel_keys.keys_after_edit(scene, SETTINGS))


def test_every_kernel_says_whether_it_has_the_flag(add: Any) -> None:
    add()
    raised = features.flags(open_(CHALK))
    assert NEW in raised and NEW not in features.flags(CHALK, True)
    assert features.defines(raised)[NEW] == 1 and features.defines(frozenset())[NEW] == 0
    assert NEW in features.everything()
    assert NEW not in fallback.superset(CHALK) and not any(later(PLASTIC))


def test_cheap_code_is_there_from_the_start(add: Any) -> None:
    add(raised_with=("HAS_PRINCIPLED",))
    assert NEW in features.flags(PLASTIC, True) and NEW not in features.flags(CHALK, True)
    assert NEW not in features.flags(PLASTIC), "nobody edits it"
    assert NEW in fallback.superset(PLASTIC) and all(later(PLASTIC))
    assert all(has(kernel_keys.bsdf_key(LONE, question) for question in ENTRIES))


def test_expensive_code_is_compiled_ahead(add: Any) -> None:
    before = kernel_keys.keys_after_edit(PLASTIC, SETTINGS)
    add(compiled_with=("HAS_PRINCIPLED",))
    assert NEW not in features.flags(PLASTIC, True) and NEW in fallback.superset(PLASTIC)
    assert sum(later(PLASTIC)) == 4, "alone, and with each combination of the two others"
    assert len(later(PLASTIC)) == len(before) + 4 and not any(later(CHALK))
    foreseen = set(kernel_keys.bsdf_keys())
    assert any(has(foreseen)) and not all(has(foreseen))
    materials = [open_(LONE), LONE]
    assert {kernel_keys.bsdf_key(each, "values") for each in materials} <= foreseen


def test_what_any_scene_may_need_is_compiled_once(add: Any) -> None:
    keys = set(kernel_keys.bsdf_keys())
    add(compiled_with=ANYWHERE)
    assert sum(later(PLASTIC)) == 2, "with the opacity, which any scene may need, too, and alone"
    assert len(set(kernel_keys.bsdf_keys())) == len(keys)


def test_what_follows_comes_with_the_flag_that_is_touched(add: Any) -> None:
    add(follows=("HAS_TRANSMISSION", "HAS_QUADS"))
    keys = kernel_keys.keys_after_edit(PLASTIC, SETTINGS)
    assert has(keys) == [dict(key.defines)["HAS_TRANSMISSION"] == 1 for key in keys] and any(has(keys))


def test_the_superset_kernel_shows_rare_edits(add: Any) -> None:
    add(previewed=lambda scene: scene is PLASTIC)
    assert NEW in fallback.superset(PLASTIC) and NEW not in fallback.superset(CHALK)
    assert NEW not in features.flags(PLASTIC, True) and not any(later(PLASTIC))


def test_curves_have_all_menus(add: Any) -> None:
    add(evaluated_with=("HAS_PRINCIPLED",))
    assert NEW in features.evaluating(LONE) and NEW not in features.grown(frozenset(), LONE)
    assert any(has(kernel_keys.bsdf_keys()))


@pytest.mark.parametrize("common", [False, True])
def test_a_kernel_with_everything_has_no_rare_code(add: Any, common: bool) -> None:
    add(in_general=common)
    assert (NEW in features.common()) == common


def test_no_edit_waits_for_what_only_spares_work(add: Any) -> None:
    add(spares=True)
    raised = features.flags(CHALK, True)
    assert features.grown(raised, open_(CHALK)) == raised and NEW in features.flags(open_(CHALK))
    superset = fallback.superset(CHALK)
    assert NEW not in superset and fallback.kernel_key(open_(CHALK), SETTINGS, superset) is not None
    assert NEW not in fallback.least(open_(CHALK))


def test_what_the_camera_alone_decides(add: Any) -> None:
    add(of_camera=True)
    assert features.camera_flags(open_(CHALK)) - features.camera_flags(CHALK) == {"HAS_APERTURE", NEW}


def test_rows_name_flags_that_there_are() -> None:
    for flag in FLAGS.values():
        for names in (flag.raised_with, flag.compiled_with, flag.follows, flag.evaluated_with):
            assert names == ANYWHERE or set(names) <= set(FLAGS), flag.name


def test_a_scene_without_materials_raises_no_flag_of_one() -> None:
    empty = {**document([]), "materials": {}}
    assert not features.flags(pack(parse_scene(empty), IMAGES).arrays) & {model.flag for model in FLAGGED}
