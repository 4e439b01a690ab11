"""Whichever field of a document changes: what `scene_diff` does not name is packed as before, and no flag missed."""

from __future__ import annotations

import copy
import random
import secrets
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest
from pydantic import BaseModel

from gpu.kernels import features
from service.document import Scene, parse_scene
from service.document.document import Parsed
from service.document.material.measured import MeasuredMaterial
from service.pack import PackCache, pack
from service.problems import InvalidDocument
from service.server.streams.scene_diff import BLINDING, scene_diff
from tests.documents import Shelf, cube_data, picture

Json = dict[str, Any]

RNG = np.random.default_rng(1)
BYTES, FLOATS, SOLID = (f"sha256:{digit * 64}" for digit in "123")
SHELF = Shelf(**{
    "1" * 64: picture(RNG.random((4, 4, 3)), is_8bit=True), "2" * 64: picture(RNG.random((4, 4, 3))),
    "3" * 64: cube_data(),
})  # fmt: skip
TEXTURES = {
    "image": {"asset": BYTES}, "other": {"asset": FLOATS}, "checker": {"type": "checker", "a": 0.2, "b": 0.9},
    "noise": {"type": "noise"},
    "ramp": {"type": "ramp", "stops": [{"position": 0.2, "color": 0.1}, {"position": 0.8, "color": 0.9}],
             "input": {"texture": "noise"}},
}  # fmt: skip
MESH = {
    "type": "mesh", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]], "material": "m",
    "uvs": [[0, 0], [1, 0], [0, 1]],
}  # fmt: skip
TURN = [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
SHAPES = [
    {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m", "transform": {"translate": [1, 0, 0]}},
    {"type": "quad", "origin": [-3, -1, 3], "u": [6, 0, 0], "v": [0, 0, -6], "material": "m"},
    {"type": "disk", "center": [0, 3, 0], "normal": [0, -1, 0], "radius": 1, "material": "m"},
    {"type": "cylinder", "base": [0, 0, 0], "axis": [0, 1, 0], "radius": 0.5, "material": "m"},
    {"type": "box", "min": [2, 0, 0], "max": [3, 1, 1], "material": "grey", "transform": {"matrix": TURN}},
    MESH, {"type": "mesh", "asset": SOLID, "material": "grey"},
]  # fmt: skip
LIGHTS = [
    {"type": "point", "position": [0, 3, 0], "intensity": 4},
    {"type": "spot", "position": [0, 3, 0], "direction": [0, -1, 0], "intensity": 4, "inner_angle": 20,
     "outer_angle": 30},
    {"type": "directional", "direction": [0, -1, 0], "irradiance": 1},
]  # fmt: skip
ENVIRONMENTS = [
    {"type": "constant", "radiance": 0.5}, {"type": "image", "asset": FLOATS},
    {"type": "cubemap", "assets": {f"{sign}{axis}": FLOATS for axis in "xyz" for sign in "pn"}},
    {"type": "sky", "sun_elevation": 30, "sun_azimuth": 40},
]  # fmt: skip
MODELS = ("diffuse", "disney", "principled", "metal_rough", "blinn_phong", "phong", "microfacet", "openpbr")
REQUIRED = {
    "diffuse": {"albedo": 0.5}, "metal_rough": {"base_color": 0.5, "metallic": 0.5, "roughness": 0.5},
    "blinn_phong": {"diffuse": 0.4, "specular": 0.4, "shininess": 20},
    "phong": {"diffuse": 0.4, "specular": 0.4, "shininess": 20},
    "microfacet": {"conductor_eta": [0.2, 0.4, 1.4], "conductor_k": 2},
}  # fmt: skip
# What any field is changed to, if it may be that; the choices of a field that has some come beside these.
VALUES = (
    0, 0.3, 1, 2.5, 40, 1e7, False, True, None, "image", "checker", "grey", "m", BYTES, FLOATS, [0.2, 0.5, 0.8],
    [0, 0, 0], [2, 3], [0.3, 0.1, 0.6, 1], [[0, 0, 1]] * 3, [[0, 0], [1, 0], [1, 1]], [[0, 2, 1]],
    [[0, 0, 0], [2, 0, 0], [0, 2, 1]],
    np.diag([2.0, 1, 1, 1]).ravel().tolist(),
    {"texture": "image"}, {"texture": "image", "factor": 0}, {"texture": "checker", "factor": 0.5},
    [{"position": 0.5, "color": 0.3}, {"position": 1, "color": 0}],
    {"texture": "other", "scale": 0.5}, {"texture": "other", "channel": "g"}, {"translate": [0, 1, 0]},
    {"scattering": 1},
)  # fmt: skip


def material(model: str, **more: Any) -> Json:
    return {"type": model, **REQUIRED.get(model, {}), **more}


def document(first: Json, environment: Json | None = None, **more: Any) -> Json:
    scene = {
        "version": 1, "camera": {"position": [0, 1, 6], "target": [0, 0, 0]}, "textures": TEXTURES,
        "materials": {"m": first, "grey": material("diffuse")}, "shapes": SHAPES, **more,
    }  # fmt: skip
    return scene if environment is None else {**scene, "environment": environment}


def textured(model: str) -> Json:
    """With a texture, of factor 1, wherever there may be one, but for `microfacet`'s alpha: each distribution would
    have a table of hundreds of rows made."""
    out = material(model)
    for name in type(parse_scene(document(out)).materials["m"]).model_fields:
        if (model, name) == ("microfacet", "alpha"):
            continue
        for reference in ({"texture": "image"}, {"texture": "other"}):
            try:
                parse_scene(document({**out, name: reference}))
            except InvalidDocument:
                continue
            out[name] = reference
            break
    return out


def bases() -> Iterator[tuple[Json, tuple[str | int, ...]]]:
    """Documents, each with the part whose fields are changed."""
    plain = material("principled")
    for environment in ENVIRONMENTS:
        yield document(plain, environment), ("environment",)
    seen = {"position": [0, 1, 4], "target": [0, 0, 0]}
    for camera in ({**seen, "type": "orthographic", "height": 3}, {**seen, "type": "panorama"}):
        yield {**document(plain, ENVIRONMENTS[0]), "camera": camera}, ("camera",)
    for part in ("camera", "lights", "textures", "shapes"):
        yield document(textured("principled"), ENVIRONMENTS[0], lights=LIGHTS), (part,)
    fog = {"absorption": 0.5, "scattering": 1, "g": 0.2, "emission": 0.1}
    for medium in (fog, {"albedo": 0.5, "radius": 0.1}):
        filled = document(material("principled", transmission=1), {**ENVIRONMENTS[0], "medium": medium})
        filled["shapes"] = [{**each, "medium": medium} for each in SHAPES if each["type"] in ("sphere", "box")]
        yield filled, ("environment", "medium")
        yield filled, ("shapes",)
    for model in MODELS:
        for each in (material(model), textured(model)):
            yield document(each), ("materials", "m")
    yield document(material("diffuse", emission=2)), ("materials", "m")
    yield document(material("principled", conductor_eta=0.2, conductor_k=3)), ("materials", "m")


def members(value: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[tuple[str | int, ...], BaseModel]]:
    """The models within a scene, with where they stand."""
    if isinstance(value, BaseModel):
        yield path, value
        inner: Any = {name: getattr(value, name) for name in type(value).model_fields}
    else:
        inner = value
    pairs = inner.items() if isinstance(inner, dict) else enumerate(inner) if isinstance(inner, list) else ()
    for key, each in pairs:
        yield from members(each, (*path, key))


def choices(annotation: Any) -> Iterator[Any]:
    """The values of the Literals within an annotation."""
    if get_origin(annotation) is Literal:
        yield from get_args(annotation)
    else:
        for part in get_args(annotation):
            yield from choices(part)


def models(annotation: Any) -> set[type[BaseModel]]:
    """The models within an annotation, and theirs."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return {annotation}.union(*(models(field.annotation) for field in annotation.model_fields.values()))
    return set().union(*map(models, get_args(annotation)))


def values(model: BaseModel, name: str) -> Iterator[Any]:
    """What the field may be changed to; some of it may be refused."""
    yield from VALUES
    yield from choices(type(model).model_fields[name].annotation)
    now = getattr(model, name)
    if isinstance(now, tuple) and len(now) == 3:
        yield [1.25 * x + 0.25 for x in now]


def changed(base: Json, path: tuple[str | int, ...], name: str, value: Any) -> Json:
    """A copy that shares with `base` what is the same, as a merge patch does; None takes the field away."""
    if path:
        out = copy.copy(base)
        out[path[0]] = changed(base[path[0]], path[1:], name, value)
        return out
    return {k: v for k, v in base.items() if k != name} | ({} if value is None else {name: value})


def differences(old: Any, new: Any) -> set[str]:
    """The names of the members of a dataclass that differ."""
    found = set()
    for field in fields(old):
        a, b = getattr(old, field.name), getattr(new, field.name)
        if type(a) is not type(b):
            found.add(field.name)
        elif is_dataclass(a):
            found |= {f"{field.name}.{each}" for each in differences(a, b)}
        elif not (np.array_equal(a, b) if isinstance(a, np.ndarray | np.void) else a == b):
            found.add(field.name)
    return found


CHANGES = {
    "camera": {"camera"},
    "materials": {"materials", "microfacets", "textures.words"},
    "environment": {"environment.rotation", "environment.scale"},
}


@pytest.mark.parametrize("share", [0.3, pytest.param(1.0, marks=pytest.mark.slow)])
def test_what_is_not_named_is_packed_as_before(share: float) -> None:
    """Each field of the schema is changed in turn, to values that it may have; `make long-test` tries all of them."""
    missed, met = list[str](), set[tuple[type, str]]()
    seed = secrets.randbits(32)
    print("seed", seed)
    drawn = random.Random(seed)
    for base, part in bases():
        before, cache = Parsed(base, parse_scene(base)), PackCache()
        arrays = pack(before.scene, SHELF, cache).arrays
        raised = features.flags(arrays)
        for path, model in members(before.scene):
            if path[: len(part)] != part:
                continue
            for name in type(model).model_fields:
                for value in values(model, name):
                    if (type(model), name) in met and drawn.random() > share:
                        continue
                    new = changed(base, path, name, value)
                    try:
                        scene = parse_scene(new, before=before)
                        named = scene_diff(before.scene, scene)
                        if scene == before.scene:
                            continue
                        met.add((type(model), name))
                        if named.whole:
                            continue
                        packed = pack(scene, SHELF, cache).arrays
                    except InvalidDocument:
                        continue
                    allowed = set().union(*(parts for what, parts in CHANGES.items() if getattr(named, what)))
                    if packed.radiance_scale <= 2 * BLINDING * arrays.radiance_scale:  # the old one is near enough
                        allowed.add("radiance_scale")
                    wrong = differences(arrays, packed) - allowed
                    wrong |= features.flags(packed) - features.grown(raised, packed)
                    if wrong:
                        missed.append(f"{'/'.join(map(str, path))}/{name}={value}: {wrong}")
    assert not missed, missed
    fields_of = {
        (model, name)
        for model in models(Scene) - {Scene, MeasuredMaterial}  # that one needs a file; see test_measured
        for name, field in model.model_fields.items()
        if name not in ("type", "name")  # names change nothing
        and not isinstance(field.annotation, type(BaseModel))  # whose own fields were changed
    }
    assert not fields_of - met, sorted((m.__name__, n) for m, n in fields_of - met)
