"""The work of one path is bounded, whatever a document asks for: a path that is cut is one of fewer bounces."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.kernels.source import SHADERS
from tests.extremes.scenes import icosphere
from tests.rendering import document, picture

ROOM = {"type": "box", "min": [-1, -1, -1], "max": [1, 1, 1], "material": "m"}
INSIDE = {"position": [0.1, 0.2, 0.8], "target": [0, 0, -1], "vfov": 90}
GLOW = {"type": "diffuse", "albedo": 1, "emission": 1, "emission_sides": "both"}
DEEP: dict[str, Any] = {"width": 8, "height": 8, "max_bounces": 1024, "roulette_depth": 1024}


def _sheets(count: int) -> dict[str, Any]:
    """Two triangles each, across the room."""
    z = np.linspace(-0.7, 0.7, count)[:, None, None]
    corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + z * [0, 0, 1]
    faces = 4 * np.arange(count)[:, None, None] + np.array([[0, 1, 2], [0, 2, 3]])
    mesh = {"type": "mesh", "vertices": corners.reshape(-1, 3).tolist(), "faces": faces.reshape(-1, 3).tolist()}
    return {**mesh, "material": "veil", "smooth": False}


def _quads(count: int) -> list[dict[str, Any]]:
    quad = {"type": "quad", "u": [2, 0, 0], "v": [0, 2, 0], "material": "veil"}
    return [{**quad, "origin": [-1, -1, -0.5 + i / count]} for i in range(count)]


def _veiled(*shapes: dict[str, Any], alpha: float = 0.0005) -> dict[str, Any]:
    """A white room with a lamp, in which each of the shapes hides that share of what is behind it."""
    materials = {"m": {"type": "diffuse", "albedo": 1}, "veil": {"type": "diffuse", "albedo": 1, "alpha": alpha}}
    lamp = {"type": "point", "position": [0.3, 0.5, -0.8], "intensity": 5}
    return document([ROOM, *shapes], materials, lights=[lamp], camera=INSIDE)


def _cut(warnings: list[str]) -> int:
    """The number of paths that were cut, as the one warning says."""
    (warning,) = warnings
    number, rest = warning.split(" ", 1)
    assert rest.startswith("paths were cut short and lack light") and "max_bounces" in rest
    return int(number)


def test_a_path_among_many_shapes_ends_and_keeps_what_it_found(gpu: Renderer) -> None:
    """In a mesh that reflects all light and glows with 1, a path's light is the number of surfaces that it met."""
    scene = document(
        [{**icosphere("m", 1), "smooth": False}], {"m": GLOW}, camera={**INSIDE, "position": [0, 0, 0.5]}
    )
    made = picture(gpu, scene, 1, estimator="bsdf", **DEEP)
    met = made.read()[..., :3]
    assert _cut(made.warnings) == 64
    assert np.array_equal(met, np.rint(met)) and 300 < met.min() < met.max() < 1000
    for bounces in (20, int(met.min()), int(met.mean()), int(met.max())):
        made = picture(gpu, scene, 1, estimator="bsdf", **{**DEEP, "max_bounces": bounces})
        assert np.array_equal(made.read()[..., :3], np.minimum(met, bounces + 1))
        assert bounces >= met.min() or made.warnings == []


@pytest.mark.parametrize("shapes", [[_sheets(400)], _quads(24)], ids=["in the tree", "in loops"])
def test_a_path_through_many_layers_ends_and_keeps_what_it_found(gpu: Renderer, shapes: list[dict[str, Any]]) -> None:
    """It is that of a picture with some fewer bounces, to the bit: light through layers to whose end it did not come
    is left out."""
    made = picture(gpu, _veiled(*shapes), 1, **DEEP)
    seen = made.read()[..., :3]
    assert _cut(made.warnings) == 64
    unknown, bounces = np.ones((8, 8), bool), 0
    while unknown.any() and bounces < 200:
        made.configure(dataclasses.replace(made.settings, max_bounces=bounces))
        made.trace(600.0, 1)
        unknown &= (made.read()[..., :3] != seen).any(axis=-1)
        bounces += 1
    assert bounces > 2 and not unknown.any()


def test_a_ray_of_the_camera_that_is_cut_meets_nothing(gpu: Renderer) -> None:
    scene = {**_veiled(_sheets(4000), alpha=0), "camera": {"position": [0, 0, 0.8], "target": [0, 0, 0], "vfov": 10}}
    made = picture(gpu, scene, 1, **{**DEEP, "max_bounces": 0})
    assert _cut(made.warnings) == 64
    assert not made.read().any() and not made.read("depth").any() and not made.read("shape_id").any()


def test_where_a_path_is_cut_does_not_depend_on_its_neighbours(gpu: Renderer) -> None:
    """Pixels that are traced one by one, in turns with others or in one dispatch have the same bits."""
    scene = _veiled(_sheets(400))
    whole = picture(gpu, scene, 4, **DEEP)
    parts = picture(gpu, scene, 1, **DEEP)
    while parts.samples < 4:
        parts.trace(0.0, parts.samples + 1)
    assert np.array_equal(whole.read(), parts.read()) and _cut(whole.warnings) == _cut(parts.warnings) == 256


def test_rays_are_counted_where_there_is_no_tree(tmp_path: Path) -> None:
    """In a box that reflects all light and glows with 1, a path meets as many surfaces as it has turns, but for the
    last one. It needs a renderer of its own, whose paths have few turns."""
    turns = 40
    few = (SHADERS / "shapes/budget.glsl").read_text().replace("BUDGET_TURNS = 28672", f"BUDGET_TURNS = {turns}")
    (tmp_path / "shapes").mkdir()
    (tmp_path / "shapes/budget.glsl").write_text(few)
    with Renderer(shaders=(tmp_path, SHADERS)) as renderer:
        made = picture(renderer, document([ROOM], {"m": GLOW}, camera=INSIDE), 1, estimator="bsdf", **DEEP)
        assert _cut(made.warnings) == 64
        assert (made.read()[..., :3] == turns - 1).all()
        made.release()
