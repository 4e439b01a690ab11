"""Light that walks under a surface: half spaces show its colour, nothing is gained, and a bunny glows at its ears."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh

from gpu import Renderer
from tests.extremes.scenes import ball, icosphere, quad
from tests.marks import seldom
from tests.rendering import assert_estimators_agree, document, picture, render

Doc = dict[str, Any]
WHITE = {"environment": {"type": "constant", "radiance": 1}}
HALF_SPACE = [{"type": "box", "min": [-9, -9, -18], "max": [9, 9, 0], "material": "m"}]
CAMERA = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 0.02}


def principled(color: float, **more: Any) -> Doc:
    return {"type": "principled", "base_color": color, "subsurface": 1, "subsurface_radius": 0.02, **more}


def openpbr(color: float, **more: Any) -> Doc:
    return {
        "type": "openpbr", "subsurface_weight": 1, "subsurface_color": [color] * 3, "subsurface_radius": 0.02, **more,
    }  # fmt: skip


MODELS = {"principled": principled, "openpbr": openpbr}
NO_GLOSS = {"principled": {"specular": 0}, "openpbr": {"specular_weight": 0}}


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("color", seldom([0.2, 0.5, 0.8], [0.5]))
def test_half_spaces_show_the_colour(gpu: Renderer, model: str, color: float) -> None:
    """Of radii that differ by channel, too; by one event, as a walk counts. As walks end after so many steps, light
    colours lack less than a hundredth."""
    material = MODELS[model](color, **NO_GLOSS[model])
    image = render(gpu, document(HALF_SPACE, {"m": material}, camera=CAMERA, **WHITE), 256, width=16, height=16)
    np.testing.assert_allclose(image[..., :3].mean((0, 1)), color, atol=0.004 if color < 0.8 else 0.01)


@pytest.mark.parametrize("g", [-0.5, 0.7])
def test_the_colour_stays_whatever_way_light_turns(gpu: Renderer, g: float) -> None:
    material = openpbr(0.6, subsurface_scatter_anisotropy=g, specular_weight=0)
    image = render(gpu, document(HALF_SPACE, {"m": material}, camera=CAMERA, **WHITE), 256, width=16, height=16)
    np.testing.assert_allclose(image[..., :3].mean((0, 1)), 0.6, atol=0.05)


WHITE_BODIES = [ball("m"), icosphere("m", 2), {"type": "box", "min": [-1] * 3, "max": [1] * 3, "material": "m"}]
WHITE_MATERIALS = {
    f"{model} {coat}": principled(1.0, subsurface_radius=0.3, clearcoat=coat, clearcoat_roughness=0.2)
    if model == "principled"
    else openpbr(1.0, subsurface_radius=0.3, coat_weight=coat, coat_roughness=0.2, coat_darkening=0)
    for model in ("principled", "openpbr")
    for coat in (0, 1)
}


@pytest.mark.parametrize("shape", seldom(WHITE_BODIES, WHITE_BODIES[:1]))
@pytest.mark.parametrize("coat", [0, 1])
def test_what_is_white_gains_nothing_and_loses_what_the_steps_cut_off(gpu: Renderer, shape: Doc, coat: int) -> None:
    """One kernel serves all of them, as there is one of each out of sight."""
    away = [{**body, "transform": {"translate": [50 + 4 * i, 0, 0]}} for i, body in enumerate(WHITE_BODIES)]
    for model in ("principled", "openpbr"):
        materials = {**WHITE_MATERIALS, "m": WHITE_MATERIALS[f"{model} {coat}"]}
        made = picture(gpu, document([shape, *away], materials, **WHITE), 64, max_bounces=8)
        mean = made.read()[..., :3].mean()
        made.release()
        assert 0.95 < mean < 1.003


def test_what_comes_out_is_around_the_body_again(gpu: Renderer) -> None:
    """Of a body of which half is clear, and dark inside: the other half of the light walks, and comes out whole."""
    half = principled(1.0, subsurface_radius=0.1, specular=0, ior=1, roughness=0.5, transmission=0.5)
    dark = {**half, "attenuation_color": 0.1, "attenuation_distance": 0.05}
    image = render(gpu, document([ball("m")], {"m": dark}, camera=CAMERA, **WHITE), 256, width=16, height=16)
    np.testing.assert_allclose(image[..., :3].mean((0, 1)), 0.5, atol=0.01)


def test_estimators_agree(gpu: Renderer) -> None:
    """Also with other things in the body, which a walk passes, and half of the light that does not walk."""
    shapes = [
        ball("m", (0, 0, 0), 0.8), ball("stone", (0, 0, 0), 0.3), ball("lamp", (-1.6, 1.4, 1), 0.9),
        quad("floor", (-4, -0.8, 4), (8, 0, 0), (0, 0, -8)),
    ]  # fmt: skip
    materials = {
        "m": principled(0.8, subsurface=0.6, subsurface_radius=[0.3, 0.1, 0.05]),
        "lamp": {"type": "diffuse", "albedo": 0, "emission": 1},
        "stone": {"type": "diffuse", "albedo": 0.1}, "floor": {"type": "diffuse", "albedo": 0.5},
    }  # fmt: skip
    assert_estimators_agree(gpu, document(shapes, materials))


def test_light_comes_out_beside_where_it_went_in(gpu: Renderer) -> None:
    """Of a slab that is lit on its left half, the right half shines where light goes far, and red goes furthest."""
    slab = {"type": "box", "min": [-2, -2, -2], "max": [2, 2, 0], "material": "m"}
    shade = {"type": "quad", "origin": [0, -3, 0.2], "u": [3, 0, 0], "v": [0, 6, 0], "material": "black"}
    black = {"type": "diffuse", "albedo": 0}
    seen = {"type": "orthographic", "position": [0, 0, 5], "target": [0, 0, 0], "height": 2}
    sun = {"type": "directional", "direction": [0, 0, -1], "irradiance": 1}
    found = {}
    for name, radius in (("far", [0.5, 0.1, 0.02]), ("near", [0.01, 0.01, 0.01])):
        made = principled(0.8, subsurface_radius=radius, specular=0)
        hidden = [{**shade, "visible_to_camera": False}]
        scene = document([slab, *hidden], {"m": made, "black": black}, camera=seen, lights=[sun])
        found[name] = render(gpu, scene, 256, width=32, height=32)[..., :3]
    right = {name: image[:, 18:24].mean((0, 1)) for name, image in found.items()}
    assert right["far"][0] > 1.5 * right["far"][1] > 3 * right["far"][2] > 0
    assert right["far"][0] > 10 * right["near"][0]


def test_without_a_radius_it_is_the_flat_shade_and_its_kernel(gpu: Renderer) -> None:
    scenes = [
        document([ball("m")], {"m": {"type": "principled", "subsurface": 1, **more}}, **WHITE)
        for more in ({}, {"subsurface_radius": 0})
    ]
    loaded = [picture(gpu, scene, 4) for scene in scenes]
    assert not any("HAS_WALKS" in made.scene.features for made in loaded)
    np.testing.assert_array_equal(*(made.read() for made in loaded))


def test_thin_walls_let_through_what_walks_in_them(gpu: Renderer) -> None:
    """A leaf of OpenPBR: half of its colour on either side, by the mean cosine more beyond."""
    for g, through in ((0.0, 0.5), (1.0, 1.0), (-1.0, 0.0)):
        leaf = openpbr(0.6, geometry_thin_walled=True, specular_weight=0, subsurface_scatter_anisotropy=g)
        sheet = quad("m", (-3, -3, 0), (6, 0, 0), (0, 6, 0))
        seen = []
        for z in (2, -2):
            lamp = {"type": "directional", "direction": [0, 0, -1], "irradiance": np.pi}
            camera = {"position": [0, 0, z], "target": [0, 0, 0], "vfov": 1}
            scene = document([sheet], {"m": leaf}, camera=camera, lights=[lamp])
            seen.append(render(gpu, scene, 16, width=8, height=8)[..., :3].mean())
        np.testing.assert_allclose(seen, [0.6 * (1 - through), 0.6 * through], atol=0.01)


def test_milk_in_a_glass_is_given_by_the_glass(gpu: Renderer) -> None:
    """`transmission_depth` and `transmission_scatter` are the medium that a shape of `principled` names by itself."""
    by_glass = {
        "type": "openpbr", "transmission_weight": 1, "specular_roughness": 0, "transmission_color": [0.5, 0.7, 0.9],
        "transmission_depth": 0.5, "transmission_scatter": [0.4, 0.2, 0.05], "transmission_scatter_anisotropy": 0.3,
    }  # fmt: skip
    extinction = -np.log([0.5, 0.7, 0.9]) / 0.5
    scattering = np.array([0.4, 0.2, 0.05]) / 0.5
    lost = min(0.0, float((extinction - scattering).min()))  # what absorbs is raised until nothing is negative
    clear = {"type": "openpbr", "transmission_weight": 1, "specular_roughness": 0}
    medium = {"absorption": (extinction - scattering - lost).tolist(), "scattering": scattering.tolist(), "g": 0.3}
    images = []
    for material, more in ((by_glass, {}), (clear, {"medium": medium})):
        scene = document([{**ball("m"), **more}], {"m": material}, **WHITE)
        images.append(render(gpu, scene, 256, max_bounces=32)[..., :3])
    np.testing.assert_allclose(images[0].mean((0, 1)), images[1].mean((0, 1)), rtol=0.01)


@pytest.mark.slow
def test_a_smooth_mesh_shows_what_its_facets_do(gpu: Renderer) -> None:
    """Walks begin and end at the triangles, on what is hollow, too, wherever vertex normals lift other rays."""
    ring = trimesh.creation.torus(0.7, 0.35, major_sections=32, minor_sections=16)
    mesh = {"type": "mesh", "vertices": ring.vertices.tolist(), "faces": ring.faces.tolist(), "material": "m"}
    material = principled(0.8, subsurface_radius=[0.1, 0.05, 0.01])
    seen = {"position": [0, -2.5, 2.5], "target": [0, 0, 0], "vfov": 35}
    smooth, flat = (
        render(
            gpu, document([mesh | {"smooth": each}], {"m": material}, camera=seen, **WHITE), 256, max_bounces=8
        )[..., :3].mean((0, 1))
        for each in (True, False)
    )  # fmt: skip
    np.testing.assert_allclose(smooth, flat, rtol=0.01)
