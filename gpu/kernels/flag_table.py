"""The flags, which say what code a scene needs: a row for each.

A flag only removes code that the scene cannot reach; choices that change pixels are settings (`features.defines`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

import numpy as np

from gpu import layout
from gpu.arrays import SceneArrays
from gpu.kernels import caustics, media, textures_glsl
from gpu.kernels.deltas import filmed, goes_straight, mirrors, transmits
from gpu.kernels.flag import ANYWHERE, Asks, Flag
from gpu.kernels.shape_kinds import records
from gpu.layout import CameraKind, LightKind, ShapeBit, ShapeKind, microfacet_records, texture_records
from gpu.layout.measured_records import MeasuredKind
from gpu.layout.models import BY_NUMBER, COATED, COVERING, FLAGGED, NUMBERS, TRANSMITTING, Model, of, with_optional


def looped_count(scene: SceneArrays, kind: ShapeKind) -> int:
    """The number of shapes of a kind that stand in the kernel's loop; they come first among their records."""
    return scene.large.get(kind, 0) if kind in scene.bvh_kinds else len(records(scene, kind))


def _linear(kind: ShapeKind) -> Asks:
    return lambda s: looped_count(s, kind) > 0


def _tree(kind: ShapeKind) -> Asks:
    return lambda s: kind in s.bvh_kinds


def _round(kind: ShapeKind) -> Asks:
    return lambda s: bool((records(s, kind)["shape"] & np.uint32(ShapeBit.ROUND)).any())


def _light(kind: LightKind) -> Asks:
    return lambda s: bool((s.lights["kind"] == kind).any())


def _camera(kind: CameraKind) -> Asks:
    return lambda s: bool(s.camera["kind"] == kind)


def _sun_disks(s: SceneArrays) -> bool:
    return bool(((s.lights["kind"] == LightKind.DIRECTIONAL) & (s.lights["spread"] > 0)).any())


def _hidden(s: SceneArrays) -> bool:
    return any(bool((records(s, kind)["shape"] & np.uint32(ShapeBit.HIDDEN)).any()) for kind in ShapeKind)


def _any_of(models: Iterable[Model]) -> Asks:
    return lambda s: bool(of(s.materials, models).any())


def _optional(member: str) -> Asks:
    """True if a material has it above 0: the first channel of one that has several."""

    def asks(s: SceneArrays) -> bool:
        values = s.materials[member]
        if values.ndim > 1:
            values = values[:, 0]
        return bool((of(s.materials, with_optional(member)) & (values > 0)).any())

    return asks


def _records(s: SceneArrays, model: str) -> np.ndarray:
    """The records of the materials of a model that has some besides `layout.Material`."""
    number = NUMBERS[model]
    row = BY_NUMBER[number]
    assert row.record is not None
    words = getattr(s, row.records).reshape(-1)[: len(s.materials) * row.record.words]
    records: np.ndarray = np.ascontiguousarray(words).view(row.record.dtype)
    found: np.ndarray = records[s.materials["model"][: len(records)] == number]
    return found


def _term(kind: str, value: int) -> Asks:
    return lambda s: bool((_records(s, "microfacet")[kind] == value).any())


def _thin_walls(s: SceneArrays) -> bool:
    return bool((transmits(s.materials) & (s.materials["thin_walled"] > 0)).any())


def _goes_straight(s: SceneArrays) -> bool:
    """True if there are lights, and surfaces that rays to them pass."""
    return len(s.lights) > 0 and bool(goes_straight(s.materials).any())


def _disperses(s: SceneArrays) -> bool:
    parts = (s.materials["dispersion"] > 0) & ~(s.materials["thin_walled"] > 0)
    return bool((transmits(s.materials) & parts).any())


def _spreads(s: SceneArrays, model: Model) -> bool:
    """True if kernels need the lobes of a model: not where all such materials only mirror or refract, and there is
    clear glass, so that their paths take the short loop of path/delta_chain.glsl."""
    m = s.materials
    given = of(m, (model,))
    sure = mirrors(m) & (m["roughness"] != np.float32(layout.TEXTURED))
    spared = (sure & transmits(m)).any() and not _normal_mapped(s)
    return bool(given.any() and (not spared or (given & ~sure).any()))


def _slot_flags(scene: SceneArrays) -> np.ndarray:
    """The flags of all slots in use."""
    if scene.textures is None:
        return np.zeros(0, np.uint32)
    slots, _ = textures_glsl.records(scene.textures)
    flags: np.ndarray = slots["flags"][slots["width"] > 0]
    return flags


def _slot(flag: int, kind: int = 0) -> Asks:
    return lambda s: bool((_slot_flags(s) & (flag | kind) == flag).any())


def _normal_mapped(s: SceneArrays) -> bool:
    """True if textures bend normals: normal maps or heights."""
    bending = (*texture_records.NORMALS, texture_records.HEIGHT)
    return s.textures is not None and any(name in s.textures.slots for name in bending)


def _has_heights(s: SceneArrays) -> bool:
    return s.textures is not None and texture_records.HEIGHT in s.textures.slots


def _coat_apart(s: SceneArrays) -> bool:
    """True if the normal of some coat differs from that of the layer below."""
    if s.textures is None or not _normal_mapped(s):
        return False
    names = list(s.textures.slots)
    _, uses = textures_glsl.records(s.textures)
    mapped = [
        uses["channel"][:, names.index(n)] != texture_records.CHANNEL_NONE
        for n in texture_records.NORMALS
        if n in names
    ]
    coated = of(s.materials, COATED) & (s.materials["clearcoat"] > 0)
    return bool((np.any(mapped, axis=0) & coated).any())


def _thin(s: SceneArrays) -> bool:
    return bool((s.triangle_colors[..., 3] < 1).any())


def _shines_both(s: SceneArrays) -> bool:
    return bool(((s.materials["emission"] > 0).any(axis=1) & (s.materials["emission_sides"] == 2)).any())


def _layers(materials: np.ndarray) -> np.ndarray:
    """True for each material if it has a layer that would lie over its emission."""
    found = [of(materials, [model]) & (materials[name] > 0) for model in COVERING for name in model.covers_emission]
    return np.asarray(np.any(found, axis=0))


def _layered(s: SceneArrays) -> bool:
    """True if some emission lies under a layer."""
    return bool((_layers(s.materials) & (s.materials["emission"] > 0).any(axis=1)).any())


def _nearly_layered(s: SceneArrays) -> bool:
    """True if one slider makes it lie under a layer, or lets what lies there shine."""
    shines = of(s.materials, COVERING) & (s.materials["emission"] > 0).any(axis=1)
    return bool((shines | _layers(s.materials)).any())


def _veiled(s: SceneArrays) -> bool:
    """True if the emission or the opacity of an emitting shape varies over its surface."""
    shines = (s.materials["emission"] > 0).any(axis=1)
    given = s.materials[shines]
    textured = (given[name] == np.float32(layout.TEXTURED) for name in ("emission", "opacity"))
    return any(bool(values.any()) for values in textured) or (len(given) > 0 and _thin(s))


def _where(flag: str) -> Asks:
    return lambda s: FLAGS[flag].asks(s)


def _always(_: SceneArrays) -> bool:
    return True


def _term_flags() -> Iterator[Flag]:
    """A flag for each term of `microfacet` that has code of its own: HAS_MICROFACET_DISTRIBUTION_GTR."""
    plain = microfacet_records.PLAIN
    for kind, terms in microfacet_records.TERMS.items():
        for term in terms:
            if plain.get(kind) != term:
                yield _of_microfacet(f"HAS_MICROFACET_{kind.upper()}_{term.name}", _term(kind, term))


def _model_flags() -> Iterator[Flag]:
    """A flag for each model but the first, and one for its lobes where scenes can do without them."""
    for model in FLAGGED:
        yield Flag(model.flag, _any_of((model,)), in_general=model.in_general)
        if model.lobes_flag != model.flag:
            spreads = partial(_spreads, model=model)
            yield Flag(model.lobes_flag, spreads, raised_with=(model.flag,), in_general=model.in_general)


def _flags_of(models: Iterable[Model]) -> tuple[str, ...]:
    return tuple(model.flag for model in models)


def _of_microfacet(name: str, asks: Asks) -> Flag:
    """A flag of the model `microfacet`, whose terms are rare and would cost the pictures of all other scenes time."""
    return Flag(name, asks, evaluated_with=("HAS_MICROFACET",), in_general=False)


def _of_measured(name: str, asks: Asks) -> Flag:
    """A flag of the model `measured`, likewise."""
    return Flag(name, asks, evaluated_with=("HAS_MEASURED",), in_general=False)


def _measured(kind: MeasuredKind) -> Asks:
    return lambda s: bool((_records(s, "measured")["kind"] == kind).any())


def _of_textures(name: str, asks: Asks, previewed: Asks = Flag.previewed) -> Flag:
    """A flag of textures, which are laid out anew for each scene."""
    return Flag(name, asks, previewed=previewed, in_general=False)


_NO_IMAGE = texture_records.SLOT_CHECKER | texture_records.SLOT_NOISE | texture_records.SLOT_COORDINATES
_STRETCHED = with_optional("anisotropic")
_ROWS = (
    Flag("HAS_SPHERES", _linear(ShapeKind.SPHERE)),
    Flag("HAS_VAST_SPHERES", lambda s: bool((s.spheres["power"] < layout.NOT_VAST).any())),
    Flag("HAS_QUADS", _linear(ShapeKind.QUAD), previewed=lambda s: len(s.boxes) > 0),  # of one that shines
    Flag("HAS_DISKS", _round(ShapeKind.QUAD), previewed=_round(ShapeKind.BOX)),  # the caps of a cylinder that shines
    Flag("HAS_BOXES", _linear(ShapeKind.BOX)),
    Flag("HAS_CYLINDERS", _round(ShapeKind.BOX), in_general=False),
    Flag("HAS_ELLIPSOIDS", _linear(ShapeKind.ELLIPSOID), in_general=False),
    Flag("HAS_TRIANGLES", _linear(ShapeKind.TRIANGLE)),
    Flag("HAS_BVH", lambda s: bool(s.bvh_kinds)),
    Flag("HAS_BVH_SPHERES", _tree(ShapeKind.SPHERE)),
    Flag("HAS_BVH_QUADS", _tree(ShapeKind.QUAD), in_general=False),
    Flag("HAS_BVH_BOXES", _tree(ShapeKind.BOX), in_general=False),
    Flag("HAS_BVH_ELLIPSOIDS", _tree(ShapeKind.ELLIPSOID), in_general=False),
    Flag("HAS_BVH_TRIANGLES", _tree(ShapeKind.TRIANGLE)),
    Flag("HAS_INSTANCES", lambda s: len(s.instances) > 0, in_general=False),  # rare, and a cost for all other scenes
    Flag("HAS_SINGLE_SIDED", lambda s: bool((s.triangles["shape"] & np.uint32(ShapeBit.SINGLE_SIDED)).any())),
    Flag("HAS_SMOOTH_NORMALS", lambda s: len(s.triangle_normals) > 0),
    # Of meshes whose highlight is stretched, and which have smooth normals.
    Flag(
        "HAS_TANGENTS",
        lambda s: s.tangents,
        follows=("HAS_ANISOTROPIC", "HAS_SMOOTH_NORMALS"),
        previewed=_where("HAS_SMOOTH_NORMALS"),
        in_general=False,
    ),
    Flag("HAS_HIDDEN_SHAPES", _hidden),
    Flag("HAS_OPACITY", lambda s: bool((s.materials["opacity"] < 1).any()) or _thin(s), compiled_with=ANYWHERE),
    _of_textures("HAS_TEXTURES", lambda s: s.textures is not None or len(s.triangle_colors) > 0),
    _of_textures("HAS_BYTE_TEXELS", _slot(0, texture_records.SLOT_FLOATS | _NO_IMAGE)),
    _of_textures("HAS_FLOAT_TEXELS", _slot(texture_records.SLOT_FLOATS, texture_records.SLOT_CHECKER)),
    _of_textures("HAS_SRGB_TEXELS", _slot(texture_records.SLOT_SRGB)),
    _of_textures("HAS_CHECKERS", _slot(texture_records.SLOT_CHECKER)),
    _of_textures("HAS_NOISES", _slot(texture_records.SLOT_NOISE)),
    _of_textures("HAS_SOLID_TEXTURES", _slot(texture_records.SLOT_SOLID)),
    _of_textures("HAS_PROJECTIONS", _slot(texture_records.SLOT_PROJECTED)),
    _of_textures("HAS_RAMPS", _slot(texture_records.SLOT_RAMP)),
    _of_textures("HAS_UVS", lambda s: len(s.triangle_uvs) > 0),
    _of_textures("HAS_UVS_1", lambda s: len(s.triangle_uvs_1) > 0),
    _of_textures("HAS_VERTEX_COLORS", lambda s: len(s.triangle_colors) > 0),
    _of_textures("HAS_NORMAL_MAPS", _normal_mapped),
    _of_textures("HAS_HEIGHTS", _has_heights),
    _of_textures("HAS_COAT_NORMALS", _coat_apart, previewed=_normal_mapped),
    _of_textures("HAS_TEXTURED_LIGHTS", _veiled, previewed=_where("HAS_TEXTURES")),
    Flag("HAS_LAYERED_LIGHTS", _layered, previewed=_nearly_layered, in_general=False),
    Flag("HAS_EMISSION", lambda s: bool((s.materials["emission"] > 0).any()), previewed=_always),
    Flag(
        "HAS_EMISSION_BOTH",
        _shines_both,
        previewed=lambda s: bool((s.materials["emission_sides"] == 2).any()),
        in_general=False,
    ),
    Flag("HAS_LIGHTS", lambda s: len(s.lights) > 0, previewed=_always),
    Flag("HAS_MANY_LIGHTS", lambda s: len(s.lights) > 1, previewed=_always),
    Flag("HAS_LIGHT_TREE", lambda s: len(s.light_tree) > 0, previewed=_always),
    Flag("HAS_POINT_LIGHTS", _light(LightKind.POINT)),
    Flag("HAS_SPOT_LIGHTS", _light(LightKind.SPOT)),
    Flag("HAS_DIRECTIONAL_LIGHTS", _light(LightKind.DIRECTIONAL)),
    Flag("HAS_SUN_DISKS", _sun_disks, previewed=_light(LightKind.DIRECTIONAL)),
    Flag("HAS_SPHERE_LIGHTS", _light(LightKind.SPHERE), previewed=lambda s: len(s.spheres) > 0),
    Flag("HAS_QUAD_LIGHTS", _light(LightKind.QUAD), previewed=lambda s: len(s.quads) + len(s.boxes) > 0),
    Flag("HAS_TRIANGLE_LIGHTS", _light(LightKind.TRIANGLE), previewed=lambda s: len(s.triangles) > 0),
    Flag(
        "HAS_ELLIPSOID_LIGHTS",
        _light(LightKind.ELLIPSOID),
        previewed=lambda s: len(s.ellipsoids) > 0,
        in_general=False,
    ),
    Flag("HAS_CYLINDER_LIGHTS", _light(LightKind.CYLINDER), previewed=_round(ShapeKind.BOX), in_general=False),
    Flag("HAS_ENVIRONMENT", lambda s: s.environment is not None),
    Flag("HAS_ENVIRONMENT_IMAGE", lambda s: (e := s.environment) is not None and e.texels.size > 3 and not e.cube),
    Flag("HAS_ENVIRONMENT_CUBE", lambda s: s.environment is not None and s.environment.cube, in_general=False),
    Flag("HAS_SUN", lambda s: s.environment is not None and s.environment.sun is not None),
    # Without an aperture its code costs less than 2 % of a sample's time (cornell-boxes, sphere-on-floor,
    # point-lights).
    Flag("HAS_APERTURE", lambda s: bool(s.camera["aperture_radius"] > 0), raised_with=ANYWHERE, of_camera=True),
    Flag("HAS_ORTHOGRAPHIC", _camera(CameraKind.ORTHOGRAPHIC), in_general=False, of_camera=True),
    Flag("HAS_PANORAMA", _camera(CameraKind.PANORAMA), in_general=False, of_camera=True),
    *_model_flags(),
    Flag("HAS_SUBSURFACE", _optional("subsurface"), raised_with=_flags_of(with_optional("subsurface"))),
    Flag("HAS_SHEEN", _optional("sheen"), raised_with=_flags_of(with_optional("sheen"))),
    # It doubles the time of a sample where the tables of stretched lobes are looked up.
    Flag(
        "HAS_ANISOTROPIC",
        lambda s: _optional("anisotropic")(s) or _optional("coat_anisotropy")(s),
        raised_with=_flags_of(model for model in _STRETCHED if not model.needs_tables),
        compiled_with=_flags_of(model for model in _STRETCHED if model.needs_tables),
    ),
    Flag(
        "HAS_DIFFUSE_ROUGHNESS",
        _optional("diffuse_roughness"),
        raised_with=_flags_of(with_optional("diffuse_roughness")),
        in_general=False,
    ),
    Flag("HAS_CLEARCOAT", _optional("clearcoat"), raised_with=_flags_of(with_optional("clearcoat"))),
    Flag(
        "HAS_CONDUCTOR",
        _optional("conductor_eta"),
        evaluated_with=_flags_of(with_optional("conductor_eta")),
        previewed=_any_of(with_optional("conductor_eta")),
        in_general=False,
    ),
    # Films on what is no metal, and films on metals, have code of their own, which is long.
    Flag(
        "HAS_FILM",
        lambda s: bool((filmed(s.materials) & (s.materials["metallic"] < 1)).any()),
        alone_with=_flags_of(with_optional("film_thickness")),
        in_general=False,
    ),
    Flag(
        "HAS_METAL_FILM",
        lambda s: bool((filmed(s.materials) & (s.materials["metallic"] > 0)).any()),
        alone_with=_flags_of(with_optional("film_thickness")),
        in_general=False,
    ),
    Flag(
        "HAS_AMBIENT",
        lambda s: bool((s.materials["ambient"] > 0).any()),
        raised_with=_flags_of(with_optional("ambient")),
        in_general=False,
    ),
    *_term_flags(),
    _of_microfacet("HAS_MICROFACET_TABLES", lambda s: bool((_records(s, "microfacet")["rows"] > 0).any())),
    _of_measured("HAS_MEASURED_ANGLES", _measured(MeasuredKind.HALF_DIFFERENCE)),
    _of_measured("HAS_MEASURED_ADAPTIVE", _measured(MeasuredKind.ADAPTIVE)),
    _of_measured("HAS_MEASURED_LIMITS", lambda s: bool((_records(s, "measured")["limits"] > 0).any())),
    # It adds a fifth to the time of a sample of `principled`.
    Flag(
        "HAS_TRANSMISSION",
        lambda s: bool(transmits(s.materials).any()),
        compiled_with=_flags_of(TRANSMITTING),
    ),
    Flag("HAS_MIRRORS", lambda s: bool((transmits(s.materials) & mirrors(s.materials)).any()), spares=True),
    Flag(
        "HAS_THIN_WALLS",
        _thin_walls,
        alone_with=("HAS_TRANSMISSION",),
        evaluated_with=_flags_of(TRANSMITTING),
        in_general=False,
    ),
    # Rays to lights pass panes and boundaries of index 1.
    Flag("HAS_STRAIGHT", _goes_straight, alone_with=("HAS_TRANSMISSION",), in_general=False),
    Flag("HAS_DISPERSION", _disperses, alone_with=("HAS_TRANSMISSION",), in_general=False),
    # They raise no code: `features.defines` asks for caustics where a setting does not forbid them.
    Flag("HAS_CAUSTICS", caustics.may_throw, previewed=_always, of_settings=True),
    Flag("HAS_SHARP_CAUSTICS", caustics.throws, previewed=_always, of_settings=True),
    Flag("HAS_ATTENUATION", media.attenuates, previewed=_any_of(TRANSMITTING)),
    Flag("HAS_MEDIA", media.fills, in_general=False),
    Flag("HAS_PRIORITIES", media.ranks, in_general=False),
    Flag("HAS_SCATTERING", media.scatters, alone_with=("HAS_MEDIA",), in_general=False),
    Flag("HAS_WALKS", media.walks, in_general=False),
    Flag("HAS_GLOWING_MEDIA", media.glows, alone_with=("HAS_MEDIA",), in_general=False),
)
FLAGS = {flag.name: flag for flag in _ROWS}
