"""Textures are read as the contract says: against a bilinear filter in float64, and where they lie on each shape."""

from __future__ import annotations

import itertools
import re
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings, layout
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.kernels.source import SHADERS, KernelSource
from gpu.layout import texture_records
from gpu.layout.bindings import Slot
from service.document import parse_scene
from service.pack import pack, parameter_edit
from service.problems import InvalidDocument
from service.server.streams.scene_diff import SceneDiff, scene_diff
from tests.documents import Few
from tests.probing import PROBES
from tests.rendering import Images, document, render
from tests.shaders.textured import BALL, BARE, BOX, QUAD, at, on_ball

Doc = dict[str, Any]
RNG = np.random.default_rng(6)
IMAGES = {
    "rgb": RNG.integers(0, 256, (5, 7, 3)).astype(np.uint8),
    "grey": RNG.integers(0, 256, (4, 3, 1)).astype(np.uint8),
    "rgba": RNG.integers(0, 256, (3, 4, 4)).astype(np.uint8),
    "floats": RNG.random((6, 4, 3), np.float32) * 3,
    "one": np.array([[[200, 30, 90]]], np.uint8),
}
LOOK = {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 2 * np.degrees(np.arctan(0.25))}  # the quad fills it


def wrapped(i: np.ndarray, n: int, wrap: str) -> np.ndarray:
    if wrap == "clamp":
        return np.clip(i, 0, n - 1)
    if wrap == "mirror":
        i = i % (2 * n)
        return np.where(i < n, i, 2 * n - 1 - i)
    return i % n


def expected(texture: dict[str, Any], reference: dict[str, Any], uv: np.ndarray) -> np.ndarray:
    """(n, 3) of a colour parameter: the contract's words in float64."""
    image = IMAGES[texture["asset"]]
    pixels = image.astype(float) / (255 if image.dtype == np.uint8 else 1)
    if pixels.shape[2] == 1:
        pixels = np.repeat(pixels, 3, axis=2)
    if texture.get("color_space", "srgb" if image.dtype == np.uint8 else "linear") == "srgb":
        c = pixels[..., :3]
        pixels[..., :3] = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    angle = np.radians(texture.get("rotation", 0))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    uv = texture.get("offset", (0, 0)) + (uv * texture.get("scale", (1, 1))) @ turn.T
    height, width = pixels.shape[:2]
    x, y = uv[:, 0] * width - 0.5, (1 - uv[:, 1]) * height - 0.5
    wrap, out = texture.get("wrap", "repeat"), 0.0
    across, down = (wrap, wrap) if isinstance(wrap, str) else wrap
    x = np.clip(x, -0.5, width - 0.5) if across == "clamp" else x
    y = np.clip(y, -0.5, height - 0.5) if down == "clamp" else y
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    for a, b in itertools.product((0, 1), (0, 1)):
        weight = (x - i if a else 1 - x + i) * (y - j if b else 1 - y + j)
        texel = pixels[wrapped(j + b, height, down), wrapped(i + a, width, across)]
        out = out + weight[:, None] * texel
    out = np.asarray(out)
    if "channel" in reference:
        out = np.repeat(out[:, ["rgba".index(reference["channel"])]], 3, axis=1)
    return out[:, :3] * np.broadcast_to(reference.get("factor", 1), 3)


def scene_of(textures: Doc, material: Doc, *shapes: Doc, **more: Any) -> Doc:
    m = {"type": "diffuse", "albedo": 0, **material}
    return document(list(shapes or [QUAD]), {"m": m}, textures=textures, camera=LOOK, **more)


WRAPS = ("repeat", "clamp", "mirror")
TEXTURES: list[dict[str, Any]] = [
    *({"wrap": wrap, "asset": asset} for wrap in WRAPS for asset in IMAGES),
    *({"wrap": list(pair), "asset": "rgb"} for pair in itertools.permutations(WRAPS, 2)),
    {"asset": "rgba", "rotation": 30, "scale": [2, -3], "offset": [0.3, -5.7], "wrap": ["mirror", "clamp"]},
    {"asset": "rgb", "color_space": "linear"},
    {"asset": "floats", "color_space": "linear", "rotation": 90},
    {"asset": "floats", "color_space": "srgb"},
    {"asset": "rgb", "rotation": 30, "scale": [2, -3], "offset": [0.3, -5.7]},
    {"asset": "rgba", "rotation": -120.5, "scale": [0.1, 40], "wrap": "mirror"},
    {"asset": "floats", "rotation": 725, "offset": [1e3, 7], "wrap": "clamp"},
    {"asset": "grey", "uv": 1, "scale": [3, 1]},
]
REFERENCES: list[dict[str, Any]] = [{}, {"channel": "b"}, {"channel": "r", "factor": [2, 0, 0.5]}, {"factor": 3}]
MESH = {
    "type": "mesh", "asset": "mesh", "material": "m",
}  # fmt: skip


class Shelf(Images):
    """With one mesh that has two sets of coordinates."""

    def mesh(self, ref: str) -> Any:
        from service.formats import MeshData

        corners = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
        uvs = ((corners[:, :2] + 1) / 2).astype(np.float32)
        faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
        return MeshData(corners, faces, None, uvs, 1 - 2 * uvs)


@pytest.mark.parametrize("texture", TEXTURES, ids=str)
def test_texels_are_filtered_as_the_contract_says(gpu: Renderer, texture: dict[str, Any]) -> None:
    references = REFERENCES + ([{"channel": "a"}] if texture["asset"] == "rgba" else [])
    asks = (RNG.random((512, 4), np.float32) * 6 - 3).astype(np.float32)
    asks[:8] = [[u, v, u, v] for u in (0, 1) for v in (0, 1, -1, 2)]
    for reference in references:
        scene = scene_of({"t": texture}, {"emission": {"texture": "t", **reference}}, MESH)
        loaded = gpu.load(pack(parse_scene(scene), Shelf(**IMAGES)).arrays)
        defines = loaded.defines(RenderSettings(8, 8))
        kernels = KernelCache(gpu.context, (PROBES, SHADERS))
        kernel = kernels.get("texture.comp", defines)
        ask, answer = gpu.context.buffer(asks.tobytes()), gpu.context.buffer(reserve=asks.nbytes)
        loaded.bind()
        ask.bind_to_storage_buffer(int(Slot.SUM))
        answer.bind_to_storage_buffer(int(Slot.OUTPUT))
        kernel["count"].value = len(asks)
        kernel.run(len(asks) // 64)
        got = np.frombuffer(answer.read(), np.float32).reshape(-1, 4)[:, :3]
        want = expected(texture, reference, (asks[:, 2:] if texture.get("uv") else asks[:, :2]).astype(float))
        far = 1e-3 if abs(texture.get("offset", (0, 0))[0]) > 100 else 4e-5 * max(1, np.max(texture.get("scale", 1)))
        np.testing.assert_allclose(got, want, rtol=2e-5, atol=far)
        for thing in (ask, answer, loaded, kernels):
            thing.release()


def seen(gpu: Renderer, scene: dict[str, Any], aov: str = "albedo", samples: int = 16, **more: Any) -> np.ndarray:
    return render(gpu, scene, samples, aov, assets=more.pop("assets", Shelf(ramp=RAMP, **IMAGES)), **more)


N = 128
RAMP = np.zeros((N, N, 3), np.float32)  # u in red, v in green, but for half a texel at the borders
RAMP[..., 0] = (np.arange(N) + 0.5) / N
RAMP[..., 1] = 1 - RAMP[..., 0].T
RAMPED = {"t": {"asset": "ramp", "wrap": "clamp"}}
ALBEDO = {"albedo": {"texture": "t"}}


STRETCHED = {**BALL, "transform": {"scale": [1, 2, 0.5]}}


PLACES = [
    # shape, point, from where, its u and v
    (QUAD, [-0.5, 0.2, 0], [0, 0, 3], [0.25, 0.6]),
    (BOX, [0.5, 1, 3], [0, 0, 4], [0.75, 0.75]),
    (BOX, [0.5, 1, -3], [0, 0, -4], [0.25, 0.75]),
    (BOX, [1, 1, 1.5], [4, 0, 0], [0.25, 0.75]),
    (BOX, [-1, 1, 1.5], [-4, 0, 0], [0.75, 0.75]),
    (BOX, [0.5, 2, 1.5], [0, 4, 0.1], [0.75, 0.25]),
    (BOX, [0.5, -2, 1.5], [0, -4, 0.1], [0.75, 0.75]),
    (MESH, [0.5, -0.5, 0], [0, 0, 3], [0.75, 0.25]),
    *((BALL, p, (np.array(p) * 2).tolist(), uv) for p, uv in map(lambda d: on_ball(*d), [(1, 0, 0), (-1, 0.5, 0.2),
      (0.1, -0.7, 1), (0.3, 0.2, -1), (-0.3, 0.2, -1)])),
    (STRETCHED, (np.array(on_ball(0.3, 0.4, 0.5)[0]) * [1, 2, 0.5]).tolist(), [1, 1, 5], on_ball(0.3, 0.4, 0.5)[1]),
]  # fmt: skip


@pytest.mark.parametrize(("shape", "point", "away", "uv"), PLACES)
def test_where_textures_lie_on_shapes(gpu: Renderer, shape: Any, point: Any, away: Any, uv: Any) -> None:
    scene = {**scene_of(RAMPED, ALBEDO, shape), "camera": at(point, away, (0, 1, 0.01))}
    got = seen(gpu, scene, width=8, height=8, samples=4).mean((0, 1))
    assert got[:2] == pytest.approx(uv, abs=1e-3)


def test_a_checker_begins_with_its_first_colour(gpu: Renderer) -> None:
    tiles = {"t": {"type": "checker", "a": [0.9, 0.1, 0.2], "b": 0.25, "scale": [4, 2]}}
    got = seen(gpu, scene_of(tiles, {"albedo": {"texture": "t", "factor": [1, 1, 0.5]}}))
    want = np.where((np.add.outer(np.arange(32) // 16, np.arange(32) // 8) % 2 == 0)[..., None], [0.9, 0.1, 0.1],
                    [0.25, 0.25, 0.125])[::-1]  # fmt: skip
    np.testing.assert_allclose(got, want, rtol=1e-6)


def test_alpha_cuts_out(gpu: Renderer) -> None:
    """A texel's alpha is the chance that a ray meets the surface there; with a cutoff all or nothing."""
    alpha = np.zeros((4, 4, 4), np.uint8)
    alpha[..., 3] = np.array([0, 64, 128, 255])
    scene = scene_of({"t": {"asset": "a", "wrap": "clamp"}}, {"alpha": {"texture": "t", "channel": "a"}})
    scene["environment"] = {"type": "constant", "radiance": [1, 0, 0]}
    through = seen(gpu, scene, "color", 64, assets=Images(a=alpha), max_bounces=0)[..., 0].mean(0)
    want = 1 - np.interp((np.arange(32) + 0.5) / 8, np.arange(4) + 0.5, np.array([0, 64, 128, 255]) / 255)
    np.testing.assert_allclose(through, want, atol=0.02)
    scene["materials"]["m"]["alpha_cutoff"] = 0.5
    cut = seen(gpu, scene, "color", 64, assets=Images(a=alpha), max_bounces=0)[..., 0].mean(0)
    assert (cut[:19] == 1).all() and (cut[20:] == 0).all(), "the edge lies within a pixel"
    # The cutoff, too, may be a texture: here of an even alpha, and the other way round.
    scene["materials"]["m"] |= {"alpha": 0.5, "alpha_cutoff": {"texture": "t", "channel": "a"}}
    cut = seen(gpu, scene, "color", 64, assets=Images(a=alpha), max_bounces=0)[..., 0].mean(0)
    assert (cut[:19] == 0).all() and (cut[20:] == 1).all()
    scene["materials"]["m"] |= {"alpha": {"texture": "t", "channel": "a"}, "alpha_cutoff": 0.5}
    lamp = {"type": "point", "position": [0, 0, 1], "intensity": 1}
    floor = {"type": "quad", "origin": [-9, -9, -1], "u": [18, 0, 0], "v": [0, 18, 0], "material": "floor"}
    below = {"position": [0, 0, -0.5], "target": [0, 0, -1], "up": [0, 1, 0], "vfov": 150}
    lit = document([QUAD, floor], {**scene["materials"], "floor": {"type": "diffuse", "albedo": 1}}, lights=[lamp],
                   textures=scene["textures"], camera=below)  # fmt: skip
    shadow = seen(gpu, lit, "color", 16, assets=Images(a=alpha))[..., 0].mean(0)
    assert shadow[2] > 0.01 and shadow[-3] == 0, "light comes through where it is cut out, and only there"


def test_vertex_colours_multiply(gpu: Renderer) -> None:
    mesh = {
        "type": "mesh", "material": "m", "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
        "faces": [[0, 1, 2], [0, 2, 3]], "colors": [[1, 0, 0.5], [0, 1, 0.5], [0, 1, 0.5], [1, 0, 0.5]],
    }  # fmt: skip
    got = seen(gpu, scene_of({}, {"albedo": [0.5, 0.8, 1]}, mesh)).mean(0)
    x = (np.arange(32) + 0.5) / 32
    np.testing.assert_allclose(got, np.stack([0.5 - 0.5 * x, 0.8 * x, 0 * x + 0.5], 1), atol=1e-3)
    faint = {**mesh, "colors": [[*c, 0.25] for c in mesh["colors"]]}
    scene = scene_of({}, {}, faint, environment={"type": "constant", "radiance": 1})
    assert seen(gpu, scene, "color", 64, max_bounces=0)[..., 0].mean() == pytest.approx(0.75, abs=0.02)
    for cutoff, alpha, through in ((0.2, 1.0, 0), (0.3, 1.0, 1), (0.3, 0.5, 1), (0.1, 0.5, 0)):
        cut = scene_of({}, {"alpha": alpha, "alpha_cutoff": cutoff}, faint, environment=scene["environment"])
        assert (seen(gpu, cut, "color", 4, max_bounces=0)[..., 0] == through).all()


EVERY = {
    "disney": ["base_color", "subsurface", "metallic", "specular", "specular_tint", "roughness", "anisotropic",
               "sheen", "sheen_tint", "clearcoat", "clearcoat_gloss"],
    "principled": ["base_color", "metallic", "roughness", "transmission", "ior", "attenuation_color", "sheen_color",
                   "attenuation_distance", "specular_color", "anisotropic_rotation", "sheen_roughness", "sheen",
                   "clearcoat", "clearcoat_roughness", "specular"],
    "metal_rough": ["base_color", "metallic", "roughness"],
    "blinn_phong": ["diffuse", "specular", "shininess", "ambient"],
}  # fmt: skip
NEEDED: dict[str, dict[str, Any]] = {
    "metal_rough": {"base_color": 0.5, "metallic": 0.25, "roughness": 0.5},
    "blinn_phong": {"diffuse": 0.5, "specular": 0.5, "shininess": 5},
    "principled": {"transmission": 0.5, "attenuation_distance": 1, "clearcoat": 0.5, "sheen": 0.5, "anisotropic": 1},
    "disney": {"anisotropic": 0.5, "clearcoat": 0.5, "sheen": 0.5},
}
FACTORS = {"ior": 2.0, "shininess": 20, "anisotropic_rotation": 90}


FLAT = Images(flat=np.full((2, 3, 3), 0.75, np.float32))


@pytest.mark.parametrize(("model", "name"), [(model, name) for model, names in EVERY.items() for name in names])
def test_a_texture_of_one_value_is_that_value(gpu: Renderer, model: str, name: str) -> None:
    """Every parameter, through the picture: the same samples give the same light but for rounding. Materials that no
    shape has make one kernel of all parameters', which would take 4 s each to compile."""
    textured = {each: {"texture": "t", "factor": FACTORS.get(each, 1)} for each in EVERY[model]}
    given = {"type": model, **NEEDED[model]}
    others = {f"with {each}": {**given, each: reference} for each, reference in textured.items()}
    images = []
    for value in (0.75 * FACTORS.get(name, 1), textured[name]):
        scene = document([BALL], {"m": {**given, name: value}, **others}, textures={"t": {"asset": "flat"}},
                         environment={"type": "constant", "radiance": [1, 0.5, 0.25]},
                         lights=[{"type": "point", "position": [3, 4, 5], "intensity": 90}])  # fmt: skip
        images.append(render(gpu, scene, 4, assets=FLAT, max_bounces=3, width=16, height=16)[..., :3])
    different = np.abs(images[1] - images[0]) > 1e-3 * (1 + images[0])
    assert different.mean() < 0.02, "a choice on the edge may fall otherwise, no more"


def refused(scene: dict[str, Any]) -> list[str]:
    with pytest.raises(InvalidDocument) as caught:
        pack(parse_scene(scene), Shelf(**IMAGES))
    return [error.pointer for error in caught.value.errors]


def test_what_cannot_be_is_refused_at_its_place() -> None:
    rgb, grey = {"t": {"asset": "rgb"}}, {"t": {"asset": "grey"}}
    bump = {"normal_map": {"texture": "t"}}
    assert refused(scene_of(rgb, {"alpha": {"texture": "t", "channel": "a"}})) == ["/materials/m/alpha/channel"]
    assert refused(scene_of(grey, bump)) == ["/materials/m/normal_map/texture"]
    assert refused(scene_of(rgb, bump, BARE)) == ["/shapes/0/uvs"]
    assert refused(scene_of(rgb, ALBEDO, QUAD, {**BARE})) == ["/shapes/1/uvs"]
    second = {"t": {"asset": "rgb", "uv": 1}}
    assert refused(scene_of(second, ALBEDO)) == ["/shapes/0/material"]
    assert refused(scene_of(second, ALBEDO, {**BARE, "uvs": [[0, 0], [1, 0], [0, 1]]})) == ["/shapes/0/material"]


def test_floats_beyond_the_range_are_clamped_with_a_word(gpu: Renderer) -> None:
    wild = np.array([[[2, 0.5, -1], [0.5, 0.5, 0.5]]], np.float32)
    scene = scene_of({"t": {"asset": "wild", "wrap": "clamp", "scale": [0.01, 1]}}, ALBEDO)
    result = pack(parse_scene(scene), Images(wild=wild))
    assert result.warnings == ["/materials/m/albedo: 1 texels of 't' are clamped to 0..1"]
    np.testing.assert_allclose(seen(gpu, scene, assets=Images(wild=wild))[:, :8].mean((0, 1)), [1, 0.5, 0], atol=1e-6)
    assert not pack(parse_scene(scene_of({"t": {"asset": "rgb"}}, ALBEDO)), Images(**IMAGES)).warnings


def test_a_float_image_that_is_srgb_and_linear_is_there_twice() -> None:
    scene = scene_of({"a": {"asset": "floats", "color_space": "srgb"}, "b": {"asset": "floats"}},
                     {"albedo": {"texture": "a"}, "emission": {"texture": "b"}})  # fmt: skip
    made = pack(parse_scene(scene), Images(**IMAGES))
    assert made.arrays.textures is not None and len(made.arrays.textures.floats) == 2 * (
        24 + texture_records.level_texels(4, 6)
    )
    beyond = int((IMAGES["floats"] > 1).any(axis=2).sum())
    assert made.warnings == [f"/materials/m/albedo: {beyond} texels of 'a' are clamped to 0..1"]


def test_members_share_a_look_where_they_can() -> None:
    """Metallic-roughness and colour with opacity are one image each in glTF: no more looks than images."""
    material = {"type": "metal_rough", "base_color": {"texture": "c"}, "metallic": {"texture": "t", "channel": "b"},
                "roughness": {"texture": "t", "channel": "g"}}  # fmt: skip
    scene = document([QUAD], {"m": material, "n": {**material, "roughness": 0.5}},
                     textures={"c": {"asset": "rgb"}, "t": {"asset": "rgba"}})  # fmt: skip
    slots = pack(parse_scene(scene), Images(**IMAGES)).arrays.textures.slots
    assert slots == {"base_color": 0, "roughness": 1, "metallic": 1}
    assert set(texture_records.TEXTURABLE) <= set(layout.Material.members)


def preprocessed(entry: str, defines: dict[str, object]) -> str:
    """What the driver compiles: the text without what conditions leave out."""
    known, out, taken = dict(defines), [], [True]
    done = [True]  # whether a branch of the conditional was taken
    for line in KernelSource(entry, defines).text.splitlines():
        word, _, rest = line.strip().partition(" ")
        if word in ("#if", "#elif"):
            words = {name: str(value).rstrip("u") for name, value in known.items()}
            asked = re.sub(r"[A-Za-z_]\w*", lambda m: words[m[0]], rest.split("//")[0])  # noqa: B023
            yes = bool(eval(re.sub(r"!(?!=)", " not ", asked.replace("&&", " and ").replace("||", " or "))))
        if word == "#ifdef":
            yes = rest in known
        if word in ("#if", "#ifdef"):
            taken.append(taken[-1] and yes)
            done.append(yes)
        elif word in ("#elif", "#else"):
            taken[-1] = taken[-2] and not done[-1] and (word == "#else" or yes)
            done[-1] = done[-1] or word == "#else" or yes
        elif word == "#endif":
            taken.pop()
            done.pop()
        elif taken[-1] and word == "#define":
            known[rest.split()[0]] = rest.partition(" ")[2]
        elif taken[-1] and not word.startswith(("#", "//")):
            out.append(line)
    return "\n".join(out)


@pytest.mark.parametrize("entry", ["pathtrace.comp", "guides.comp"])
def test_a_scene_without_textures_has_nothing_of_them_in_its_kernel(entry: str) -> None:
    shapes = [QUAD, BALL, BARE]
    texts = []
    for textures in ({}, {"t": {"asset": "rgb"}}):
        scene = document(shapes[:2] if textures else shapes, textures=textures)
        if textures:
            scene["materials"]["m"] = {"type": "diffuse", **ALBEDO}
        arrays = pack(parse_scene(scene), Images(**IMAGES)).arrays
        defines = features.defines(features.flags(arrays), RenderSettings(8, 8), features.counts(arrays))
        texts.append(preprocessed(entry, defines))
    normal_maps = "bool mapped = false", "Scatter normal_map_eval"
    for word in (
        "texture_",
        "TextureSlot",
        "uv_1",
        "Footprint ",
        "grow_u",
        "roughen",
        "handed",
        "vec4 texels[",
        *normal_maps,
    ):
        assert word not in texts[0].replace("_texture_", ""), word
    assert "texture_look" in texts[1]


def test_an_edit_of_a_factor_moves_numbers_only(gpu: Renderer) -> None:
    """In place, to the bit what a scene packed anew shows; and a scene packed anew finds its images on the device."""
    tone = {"t": {"asset": "sha256:rgb"}}
    shelf = Images(**{"sha256:rgb": IMAGES["rgb"]})
    scenes = [parse_scene(scene_of(tone, {"emission": 0.1, "albedo": {"texture": "t", "factor": f}},
                                   environment={"type": "constant", "radiance": 1})) for f in (1, 0.25)]  # fmt: skip
    assert scene_diff(*scenes) == SceneDiff(materials=True)
    packs = [pack(scene, shelf).arrays for scene in scenes]
    loaded = [gpu.load(arrays) for arrays in packs]
    assert loaded[0]._images.upload is loaded[1]._images.upload, "the images stand on the device once"
    loaded[0].edit(parameter_edit(packs[0], scenes[1], materials=True).apply(packs[0]))
    images = []
    for scene in loaded:
        made = gpu.picture(scene, RenderSettings(16, 16, max_bounces=2))
        made.trace(60.0, 4)
        images.append(made.read())
        made.release()
        scene.release()
    assert np.array_equal(*images) and images[0].std() > 0.01
    other = parse_scene(scene_of({"t": {"asset": "sha256:rgb", "wrap": "clamp"}}, {"albedo": {"texture": "t"}}))
    assert scene_diff(scenes[0], other).whole


def test_a_server_bounds_the_texels_of_a_scene() -> None:
    scene = parse_scene(scene_of({"t": {"asset": "rgb"}, "u": {"asset": "floats"}},
                                 {"albedo": {"texture": "t"}, "alpha": {"texture": "u"}}))  # fmt: skip
    pack(scene, Images(**IMAGES), limits=Few(max_texels=5 * 7 + 6 * 4))
    with pytest.raises(InvalidDocument) as caught:
        pack(scene, Images(**IMAGES), limits=Few(max_texels=5 * 7 + 6 * 4 - 1))
    (error,) = caught.value.errors
    assert error.pointer == "/textures/t/asset" and "room for 34 more" in error.detail
