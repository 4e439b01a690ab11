"""Meshes that share their triangles look as if each had its own: in every way that a surface is asked about."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from gpu.kernels import features, instances_glsl
from gpu.kernels.source import SHADERS, KernelSource
from service.document import parse_scene
from service.pack import pack
from service.pack.geometry import instances
from tests import documents
from tests.extremes.scenes import LONG, moved, rows
from tests.gpu.instanced import IMAGES, MIRRORED, Doc, bumpy, two
from tests.marks import seldom
from tests.rays import trace
from tests.rendering import document

pytestmark = pytest.mark.exact  # a tree within a tree, in kernels of families, takes LLVM a minute


@pytest.fixture(autouse=True)
def worth(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever it spares."""
    monkeypatch.setattr(instances, "WORTH", 0)


T = {"texture": "t"}
GLASS = {"type": "principled", "transmission": 1, "roughness": 0, "attenuation_color": [0.5, 0.8, 0.9],
         "attenuation_distance": 1}  # fmt: skip
BALL = {"type": "sphere", "center": [-1.2, 0.1, 0], "radius": 0.4, "material": "m"}
BENT = {"alpha": {**T, "channel": "a"}, "normal_map": {"texture": "n", "scale": 0.4}}
CUBE = {"type": "mesh", **documents.CUBE, "smooth": False, "material": "white"}
WIDE = {"type": "mesh", "vertices": [[-9, -1.3, 9], [9, -1.3, 9], [9, -1.3, -9], [-9, -1.3, -9]], "smooth": False,
        "faces": [[0, 1, 2], [0, 2, 3]], "material": "white"}  # fmt: skip
CUBES = [{**CUBE, "transform": {"translate": [i * 0.5 - 3, -1.2, 1], "scale": 0.2}} for i in range(8)]
BALLS = [{**BALL, "center": [i * 0.3 - 3, -1, 1.5], "radius": 0.1} for i in range(20)]
SCENES = rows(
    {
        "textured, in part there, single-sided": two({"type": "diffuse", "albedo": T, **BENT}, double_sided=False),
        "glass with glass inside": two(GLASS, BALL, bumpy(transform={**MIRRORED, "scale": 0.4})),
        "hidden": two({"type": "diffuse", "albedo": 0.7}, visible_to_camera=False),
    },
    {
        "textured": two(
            {
                "type": "principled",
                "base_color": T,
                "roughness": 0.3,
                "anisotropic": 0.6,
                "normal_map": BENT["normal_map"],
            }
        ),
        "beside a cube in the loop": two({"type": "diffuse", "albedo": 0.7}, CUBE),
        "among balls and cubes, on a floor of triangles": two(
            {"type": "diffuse", "albedo": 0.7}, WIDE, *CUBES, *BALLS
        ),
        "matte": two({"type": "diffuse", "albedo": 0.7}),
        "flat": two({"type": "diffuse", "albedo": 0.7}, smooth=False),
        "brushed": two({"type": "disney", "metallic": 1, "anisotropic": 0.8, "roughness": 0.4}, smooth=False),
        "single-sided glass": two(GLASS, double_sided=False),
    },
)


def seen(gpu: Renderer, scene: Doc, aovs: tuple[str, ...] = ("color",), **more: Any) -> tuple[list[np.ndarray], Any]:
    arrays = pack(parse_scene(scene), IMAGES).arrays
    loaded = gpu.load(arrays)
    settings: Doc = {"width": 72, "height": 48, "max_bounces": 5, "filter": "box", **more}
    made = gpu.picture(loaded, RenderSettings(**settings))
    made.trace(60.0, 8)
    out = [made.read(aov) for aov in aovs]
    made.release()
    loaded.release()
    return out, arrays


@pytest.fixture
def apart(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Takes sharing away."""
    return lambda: monkeypatch.setattr(instances, "LEAST", 10**9)


@pytest.mark.parametrize("row", seldom(SCENES, ["textured, in part there, single-sided"]))
def test_shared_triangles_look_as_one_s_own(gpu: Renderer, apart: Any, row: str) -> None:
    aovs = ("color", "albedo", "normal", "depth", "shape_id", "material_id")
    if "glass" in row and not LONG:
        aovs = aovs[:1]
    shared, arrays = seen(gpu, SCENES[row], aovs)
    assert len(arrays.instances) == sum(len(shape.get("faces", ())) == 1280 for shape in SCENES[row]["shapes"])
    apart()
    own, arrays = seen(gpu, SCENES[row], aovs)
    assert not len(arrays.instances)
    for name, a, b in zip(aovs, shared, own, strict=True):
        # Tangents have ten bits, in the one space or the other; and a rounding turns a path at an edge.
        least = 4e-3 if {"normal_map", "anisotropic"} & SCENES[row]["materials"]["m"].keys() else 2e-4
        assert np.isclose(a, b, rtol=2e-3, atol=least).all(2).mean() > 0.98, name
    assert shared[0].mean() == pytest.approx(own[0].mean(), rel=2e-3)


def test_far_away_they_look_the_same(gpu: Renderer) -> None:
    scene = two({"type": "diffuse", "albedo": 0.7})
    (near,), _ = seen(gpu, scene)
    (far,), arrays = seen(gpu, moved(scene, [1e6, -1e6, 3e5]))
    assert len(arrays.instances) == 2
    assert np.isclose(near, far, rtol=1e-3).all(2).mean() > 0.99


def test_closed_glass_loses_and_gains_nothing(gpu: Renderer) -> None:
    clear = {"type": "principled", "base_color": 1, "transmission": 1, "roughness": 0}
    scene = two(clear, smooth=False)
    scene = {**scene, "shapes": scene["shapes"][:2], "lights": [], "environment": {"type": "constant", "radiance": 1}}
    (color,), arrays = seen(gpu, scene, max_bounces=64, roulette_depth=64, width=32, height=24)
    assert len(arrays.instances) == 2
    assert color.min() > 0.99 and color.max() < 1.003


def test_a_ray_meets_the_same_triangle_of_another_instance(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """From one square, across to its likeness; and not the one it leaves, neither itself nor from the next."""
    monkeypatch.setattr(instances, "LEAST", 1)
    corners, faces = [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    square = {"type": "mesh", "vertices": corners, "faces": faces, "material": "m"}
    shapes = [{**square, "transform": {"rotate": [5, 0, 0], "translate": [0, 0, z]}} for z in (0, 1e-3)]
    arrays = pack(parse_scene(document(shapes)), IMAGES).arrays
    assert len(arrays.instances) == 2
    scene = gpu.load(arrays)
    rng = np.random.default_rng(3)
    o = np.concatenate([rng.uniform(-0.5, 0.5, (20_000, 2)), np.full((20_000, 1), -2.0)], axis=1)
    down, up = np.tile([0.0, 0, -1], (20_000, 1)), np.tile([0.0, 0, 1], (20_000, 1))
    hits, _, leaves = trace(gpu, scene, o, up, down)  # back to where it came from: nothing is there
    assert (hits[:, 3] > 0).all() and not leaves[:, 0].any()
    between = o * [1, 1, 0] + [0, 0, 5e-4] + np.outer(o[:, 1] * np.tan(np.radians(5)), [0, 0, 1])
    hits, _, leaves = trace(gpu, scene, between, up, down)
    assert (hits[:, 3] > 0).all() and leaves[:, 0].all()
    scene.release()


def test_kernels_of_other_scenes_have_nothing_of_it() -> None:
    """Of what a kernel is compiled from, without the flag, no line reads an instance: neither its record nor the
    frame's members for it, and none calls the functions of shapes/instance.glsl. The walk's own functions are empty
    then."""
    declared = instances_glsl.text() + (SHADERS / "shapes" / "instance.glsl").read_text()
    code = re.sub("//.*", "", declared)
    names = set(re.findall(r"\w*instance\w*", code, re.IGNORECASE)) - {"HAS_INSTANCES"}
    assert {"Instance", "instance_load", "instance_texels", "instance_rows", "INSTANCED"} <= names
    names |= {rf"uniforms\.{member}" for member in instances_glsl.UNIFORMS}
    reads = re.compile(rf"\b({'|'.join(names)})\b")
    flags = features.everything() - {"HAS_INSTANCES"}
    for entry in ("pathtrace.comp", "guides.comp"):
        text = KernelSource(entry, features.defines(flags)).text.replace("#define HAS_INSTANCES 0\n", "")
        assert reads.search(text)
        assert not reads.search(_without_instances(text))


def _without_instances(text: str) -> str:
    """The lines that are left where HAS_INSTANCES is 0, comments taken out."""
    out, depth, skipped = list[str](), list[str](), 0
    for line in text.splitlines():
        word = line.strip()
        if word.startswith("#if"):
            depth.append(word)
            skipped += word == "#if HAS_INSTANCES"
        elif word.startswith(("#else", "#elif")) and depth[-1] == "#if HAS_INSTANCES":
            depth[-1] = word
            skipped -= 1
        elif word.startswith("#endif"):
            skipped -= depth.pop() == "#if HAS_INSTANCES"
        elif not skipped and not word.startswith("#line"):
            out.append(line.split("//")[0])
    assert not depth and not skipped
    return "\n".join(out)
