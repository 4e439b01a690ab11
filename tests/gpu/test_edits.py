"""An edit of a scene's arrays: joined with a later one, and made once."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from gpu import EnvironmentArrays, SceneArrays, SceneEdit, TextureArrays, layout


def environment(scale: float = 1.0) -> EnvironmentArrays:
    texels = np.ones((1, 1, 3), np.float32)
    return EnvironmentArrays(texels, texels[..., 0], np.zeros(1, layout.EnvironmentCell.dtype), 0.0, scale, True)


def materials(count: int, roughness: float = 0.0) -> np.ndarray:
    out = np.zeros(count, layout.Material.dtype)
    out["roughness"] = roughness
    return out


def camera(radius: float) -> np.void:
    out: np.void = np.zeros(1, layout.Camera.dtype)[0]
    out["aperture_radius"] = radius
    return out


SCENE = SceneArrays(
    camera(0.0), materials(2), environment=environment(), textures=TextureArrays({}, np.zeros((2, 1), np.uint32))
)
LIGHTS, BALLS = np.zeros(1, layout.Light.dtype), np.zeros(1, layout.Sphere.dtype)
PARTS: dict[str, Any] = {
    "camera": camera(1.0),
    "materials": materials(2, 0.5),
    "texture_words": np.ones((2, 1), np.uint32),
    "microfacets": np.ones((2, 4), np.uint32),
    "environment": (0.5, 2.0),
    "environment_map": environment(3.0),
    "moved": {"lights": LIGHTS},
    "material_numbers": (1, 0),
}


def test_each_part_of_an_edit_changes_the_scene_and_may_be_joined() -> None:
    assert PARTS.keys() == {each.name for each in fields(SceneEdit)}
    assert SceneEdit().apply(SCENE) == SCENE
    joined = SceneEdit()
    for name, value in PARTS.items():
        edit = SceneEdit(**{name: value})
        changed = edit.apply(SCENE)
        differing = [f.name for f in fields(SCENE) if getattr(changed, f.name) is not getattr(SCENE, f.name)]
        assert len(differing) == 1, name
        joined = joined.then(edit)
    assert joined == SceneEdit(**PARTS)


def test_the_later_edit_wins_and_moves_are_joined() -> None:
    first = SceneEdit(camera=camera(1.0), environment=(0.5, 2.0), moved={"lights": LIGHTS})
    later = SceneEdit(environment=(0.25, 1.0), moved={"spheres": BALLS})
    joined = first.then(later)
    assert joined.camera is first.camera and joined.environment == (0.25, 1.0)
    assert joined.moved == {"lights": LIGHTS, "spheres": BALLS}
    once, twice = joined.apply(SCENE), later.apply(first.apply(SCENE))
    assert once.environment is not None and once.environment == twice.environment
    assert all(getattr(once, f.name) is getattr(twice, f.name) for f in fields(SCENE) if f.name != "environment")


def test_only_numbers_leave_pictures_as_they_are() -> None:
    assert [name for name, value in PARTS.items() if not SceneEdit(**{name: value}).restarts] == ["material_numbers"]


def test_only_camera_and_turn_need_no_other_kernel() -> None:
    need = {name for name, value in PARTS.items() if SceneEdit(**{name: value}).needs_kernel}
    assert need == PARTS.keys() - {"camera", "environment", "material_numbers"}


def test_bytes_are_those_of_what_may_be_large() -> None:
    lit = environment()
    assert SceneEdit(**{**PARTS, "environment_map": lit}).bytes == (
        LIGHTS.nbytes + lit.texels.nbytes + lit.probability.nbytes + lit.cells.nbytes
    )
    assert SceneEdit(camera=camera(0.0), materials=materials(2)).bytes == 0


def test_another_number_of_materials_is_none() -> None:
    with pytest.raises(ValueError, match="3 materials for a scene of 2"):
        SceneEdit(materials=materials(3)).apply(SCENE)


def test_a_turned_map_is_the_same_and_an_equal_one_is_not() -> None:
    lit = environment()
    assert replace(lit, rotation=1.0, scale=2.0).has_map_of(lit)
    assert not environment().has_map_of(lit) and not replace(lit, background=False).has_map_of(lit)
