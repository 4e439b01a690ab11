"""The flags, which say what code a scene needs: a table, flag -> predicate over the arrays.

A flag only removes code that the scene cannot reach; choices that change pixels are settings (`defines`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from gpu import layout
from gpu.arrays import SceneArrays
from gpu.kernels import textures_glsl
from gpu.layout import LightKind, MaterialModel, ShapeKind, microfacet_records, texture_records
from gpu.settings import ESTIMATORS, SAMPLERS, RenderSettings

FILTER_TABLE_SIZE = 512


def _looped(scene: SceneArrays, kind: ShapeKind, records: str) -> int:
    """The number of shapes of a kind that stand in the kernel's loop; they come first among their records."""
    return scene.large.get(kind, 0) if kind in scene.bvh_kinds else len(getattr(scene, records))


def _linear(kind: ShapeKind, records: str) -> Callable[[SceneArrays], bool]:
    return lambda s: _looped(s, kind, records) > 0


def _tree(kind: ShapeKind) -> Callable[[SceneArrays], bool]:
    return lambda s: kind in s.bvh_kinds


def _light(kind: LightKind) -> Callable[[SceneArrays], bool]:
    return lambda s: bool((s.lights["kind"] == kind).any())


def _hidden(records: np.ndarray) -> bool:
    return bool((records["shape"] & np.uint32(layout.HIDDEN)).any())


def _model(model: MaterialModel) -> Callable[[SceneArrays], bool]:
    return lambda s: bool((s.materials["model"] == model).any())


def _disney(member: str) -> Callable[[SceneArrays], bool]:
    models = (MaterialModel.DISNEY, MaterialModel.PRINCIPLED)
    return lambda s: bool((np.isin(s.materials["model"], models) & (s.materials[member] > 0)).any())


def _microfacets(s: SceneArrays) -> np.ndarray:
    """The records of the materials of that model."""
    words = s.microfacets.reshape(-1)[: len(s.materials) * microfacet_records.Microfacet.words]
    records: np.ndarray = np.ascontiguousarray(words).view(microfacet_records.Microfacet.dtype)
    found: np.ndarray = records[s.materials["model"][: len(records)] == MaterialModel.MICROFACET]
    return found


def _term(kind: str, value: int) -> Callable[[SceneArrays], bool]:
    return lambda s: bool((_microfacets(s)[kind] == value).any())


def _terms() -> dict[str, Callable[[SceneArrays], bool]]:
    """A flag for each term of `microfacet` that has code of its own: HAS_MICROFACET_DISTRIBUTION_GTR."""
    plain = microfacet_records.PLAIN
    every = [(kind, term) for kind, terms in microfacet_records.TERMS.items() for term in terms]
    own = [(kind, term) for kind, term in every if plain.get(kind) != term]
    return {f"HAS_MICROFACET_{kind.upper()}_{term.name}": _term(kind, term) for kind, term in own}


def _transmits(materials: np.ndarray) -> np.ndarray:
    m = materials
    out: np.ndarray = (m["model"] == MaterialModel.PRINCIPLED) & (m["transmission"] > 0) & (m["metallic"] < 1)
    return out


def _mirrors(materials: np.ndarray) -> np.ndarray:
    """Materials that only mirror or refract, by their own numbers; textures may add others, or take some away."""
    m = materials
    whole = (m["metallic"] >= 1) | (m["transmission"] >= 1)
    bare = (m["clearcoat"] <= 0) & (m["sheen"] <= 0)
    out: np.ndarray = (
        (m["model"] == MaterialModel.PRINCIPLED) & (m["roughness"] < layout.LEAST_ROUGHNESS) & whole & bare
    )
    return out


def _spreads(s: SceneArrays) -> bool:
    """Whether kernels need the lobes of `principled`: not where all such materials only mirror or refract, and among
    them is clear glass, whose paths then take the short loop of path/delta_chain.glsl."""
    m = s.materials
    given = m["model"] == MaterialModel.PRINCIPLED
    sure = _mirrors(m) & (m["roughness"] != np.float32(layout.TEXTURED))
    spared = (sure & _transmits(m)).any() and not _mapped(s, "normal", "coat_normal")
    return bool(given.any() and (not spared or (given & ~sure).any()))


def _slot_flags(scene: SceneArrays) -> np.ndarray:
    """The flags of all slots in use."""
    if scene.textures is None:
        return np.zeros(0, np.uint32)
    slots, _ = textures_glsl.records(scene.textures)
    flags: np.ndarray = slots["flags"][slots["width"] > 0]
    return flags


def _slot(flag: int, kind: int = 0) -> Callable[[SceneArrays], bool]:
    return lambda s: bool((_slot_flags(s) & (flag | kind) == flag).any())


def _mapped(s: SceneArrays, *names: str) -> bool:
    return s.textures is not None and any(name in s.textures.slots for name in names)


def _coat_apart(s: SceneArrays) -> bool:
    """Whether the normal of some coat differs from that of the layer below."""
    if s.textures is None or not _mapped(s, "normal", "coat_normal"):
        return False
    names = list(s.textures.slots)
    _, uses = textures_glsl.records(s.textures)
    mapped = [
        uses["channel"][:, names.index(n)] != texture_records.CHANNEL_NONE
        for n in texture_records.NORMALS
        if n in names
    ]
    coated = (s.materials["model"] == MaterialModel.PRINCIPLED) & (s.materials["clearcoat"] > 0)
    return bool((np.any(mapped, axis=0) & coated).any())


def _thin(s: SceneArrays) -> bool:
    return bool((s.triangle_colors[..., 3] < 1).any())


def _veiled(s: SceneArrays) -> bool:
    """Whether the emission or the opacity of an emitting shape varies over its surface."""
    shines = (s.materials["emission"] > 0).any(axis=1)
    given = s.materials[shines]
    textured = (given[name] == np.float32(layout.TEXTURED) for name in ("emission", "opacity"))
    return any(bool(values.any()) for values in textured) or (len(given) > 0 and _thin(s))


def _camera(asks: Callable[[np.void], bool]) -> Callable[[SceneArrays], bool]:
    return lambda s: asks(s.camera)


# Flags that the camera alone decides (a `layout.Camera`): a camera that raises others needs another kernel.
CAMERA_FLAGS: dict[str, Callable[[np.void], bool]] = {
    "HAS_APERTURE": lambda camera: bool(camera["aperture_radius"] > 0),
}

FLAGS: dict[str, Callable[[SceneArrays], bool]] = {
    "HAS_SPHERES": _linear(ShapeKind.SPHERE, "spheres"),
    "HAS_VAST_SPHERES": lambda s: bool((s.spheres["power"] < layout.NOT_VAST).any()),
    "HAS_QUADS": _linear(ShapeKind.QUAD, "quads"),
    "HAS_BOXES": _linear(ShapeKind.BOX, "boxes"),
    "HAS_ELLIPSOIDS": _linear(ShapeKind.ELLIPSOID, "ellipsoids"),
    "HAS_TRIANGLES": _linear(ShapeKind.TRIANGLE, "triangles"),
    "HAS_BVH": lambda s: bool(s.bvh_kinds),
    "HAS_BVH_SPHERES": _tree(ShapeKind.SPHERE),
    "HAS_BVH_QUADS": _tree(ShapeKind.QUAD),
    "HAS_BVH_BOXES": _tree(ShapeKind.BOX),
    "HAS_BVH_ELLIPSOIDS": _tree(ShapeKind.ELLIPSOID),
    "HAS_BVH_TRIANGLES": _tree(ShapeKind.TRIANGLE),
    "HAS_INSTANCES": lambda s: len(s.instances) > 0,
    "HAS_SINGLE_SIDED": lambda s: bool((s.triangles["shape"] & np.uint32(layout.SINGLE_SIDED)).any()),
    "HAS_SMOOTH_NORMALS": lambda s: len(s.triangle_normals) > 0,
    "HAS_TANGENTS": lambda s: s.tangents,
    "HAS_HIDDEN_SHAPES": lambda s: any(_hidden(getattr(s, records)) for records in (*COUNTS.values(), "instances")),
    "HAS_OPACITY": lambda s: bool((s.materials["opacity"] < 1).any()) or _thin(s),
    "HAS_TEXTURES": lambda s: s.textures is not None or len(s.triangle_colors) > 0,
    "HAS_BYTE_TEXELS": _slot(0, texture_records.SLOT_FLOATS | texture_records.SLOT_CHECKER),
    "HAS_FLOAT_TEXELS": _slot(texture_records.SLOT_FLOATS, texture_records.SLOT_CHECKER),
    "HAS_SRGB_TEXELS": _slot(texture_records.SLOT_SRGB),
    "HAS_CHECKERS": _slot(texture_records.SLOT_CHECKER),
    "HAS_UVS": lambda s: len(s.triangle_uvs) > 0,
    "HAS_UVS_1": lambda s: len(s.triangle_uvs_1) > 0,
    "HAS_VERTEX_COLORS": lambda s: len(s.triangle_colors) > 0,
    "HAS_NORMAL_MAPS": lambda s: _mapped(s, "normal", "coat_normal"),
    "HAS_COAT_NORMALS": _coat_apart,
    "HAS_TEXTURED_LIGHTS": _veiled,
    "HAS_EMISSION": lambda s: bool((s.materials["emission"] > 0).any()),
    "HAS_EMISSION_BOTH": lambda s: bool(
        ((s.materials["emission"] > 0).any(axis=1) & (s.materials["emission_sides"] == 2)).any()
    ),
    "HAS_LIGHTS": lambda s: len(s.lights) > 0,
    "HAS_MANY_LIGHTS": lambda s: len(s.lights) > 1,
    "HAS_LIGHT_TREE": lambda s: len(s.light_tree) > 0,
    "HAS_POINT_LIGHTS": _light(LightKind.POINT),
    "HAS_SPOT_LIGHTS": _light(LightKind.SPOT),
    "HAS_DIRECTIONAL_LIGHTS": _light(LightKind.DIRECTIONAL),
    "HAS_SUN_DISKS": lambda s: bool(((s.lights["kind"] == LightKind.DIRECTIONAL) & (s.lights["spread"] > 0)).any()),
    "HAS_SPHERE_LIGHTS": _light(LightKind.SPHERE),
    "HAS_QUAD_LIGHTS": _light(LightKind.QUAD),
    "HAS_TRIANGLE_LIGHTS": _light(LightKind.TRIANGLE),
    "HAS_ELLIPSOID_LIGHTS": _light(LightKind.ELLIPSOID),
    "HAS_ENVIRONMENT": lambda s: s.environment is not None,
    "HAS_ENVIRONMENT_IMAGE": lambda s: (
        s.environment is not None and s.environment.texels.size > 3 and not s.environment.cube
    ),
    "HAS_ENVIRONMENT_CUBE": lambda s: s.environment is not None and s.environment.cube,
    "HAS_SUN": lambda s: s.environment is not None and s.environment.sun is not None,
    **{name: _camera(asks) for name, asks in CAMERA_FLAGS.items()},
    "HAS_DISNEY": _model(MaterialModel.DISNEY),
    "HAS_SUBSURFACE": _disney("subsurface"),
    "HAS_SHEEN": _disney("sheen"),
    "HAS_ANISOTROPIC": _disney("anisotropic"),
    "HAS_CLEARCOAT": _disney("clearcoat"),
    "HAS_METAL_ROUGH": _model(MaterialModel.METAL_ROUGH),
    "HAS_BLINN_PHONG": _model(MaterialModel.BLINN_PHONG),
    "HAS_PHONG": _model(MaterialModel.PHONG),
    "HAS_AMBIENT": lambda s: bool((s.materials["ambient"] > 0).any()),
    "HAS_MICROFACET": _model(MaterialModel.MICROFACET),
    **_terms(),
    "HAS_MICROFACET_TABLES": lambda s: bool((_microfacets(s)["rows"] > 0).any()),
    "HAS_PRINCIPLED": _model(MaterialModel.PRINCIPLED),
    "HAS_PRINCIPLED_LOBES": _spreads,
    "HAS_TRANSMISSION": lambda s: bool(_transmits(s.materials).any()),
    "HAS_MIRRORS": lambda s: bool((_transmits(s.materials) & _mirrors(s.materials)).any()),
    "HAS_ATTENUATION": lambda s: bool((_transmits(s.materials) & (s.materials["attenuation_distance"] > 0)).any()),
}

# Flags that sliders of the camera can raise. While a scene is edited they are raised from the start: without an
# aperture its code costs less than 2 % of a sample's time (cornell-boxes, sphere-on-floor, point-lights).
EDITED_CAMERA = frozenset(CAMERA_FLAGS)

# Flags that a slider of a model can raise. While a scene is edited they are all raised with the model, so that no
# slider ever waits for the compiler. For `principled` two are left out because they are expensive: anisotropic
# highlights double its time and clear bodies add a fifth; the first use of such a slider compiles once.
_OPAQUE = ("HAS_SUBSURFACE", "HAS_SHEEN", "HAS_ANISOTROPIC", "HAS_CLEARCOAT")
EDITED = {
    "HAS_DISNEY": _OPAQUE,
    "HAS_PRINCIPLED": ("HAS_PRINCIPLED_LOBES", "HAS_SUBSURFACE", "HAS_SHEEN", "HAS_CLEARCOAT"),
    "HAS_BLINN_PHONG": ("HAS_AMBIENT",),
    "HAS_PHONG": ("HAS_AMBIENT",),
}


def everything() -> frozenset[str]:
    """All flags."""
    return frozenset(FLAGS)


def flags(scene: SceneArrays, editing: bool = False) -> frozenset[str]:
    """The flags that `scene` raises; with `editing`, also those that an edit of its materials could."""
    raised = {name for name, asks in FLAGS.items() if asks(scene)}
    if editing:
        raised |= {more for name in raised & set(EDITED) for more in EDITED[name]} | EDITED_CAMERA
    return frozenset(raised)


# Flags that only save work and change no picture: an edit that could raise one does not wait for the compiler.
SPARING = frozenset({"HAS_MIRRORS"})


def grown(raised: frozenset[str], scene: SceneArrays) -> frozenset[str]:
    """The flags of a scene after an edit: those that were raised before, and those that it needs now."""
    return raised | (flags(scene, True) - SPARING)


# Numbers of records that kernels are compiled for, so that loops over them unroll and picks among them need no
# varying index. 0: they are too many for that to gain time, or in the tree. docs/house.md says what each gains.
COUNTS: dict[str, str] = {
    "SPHERE_COUNT": "spheres",
    "QUAD_COUNT": "quads",
    "BOX_COUNT": "boxes",
    "ELLIPSOID_COUNT": "ellipsoids",
    "TRIANGLE_COUNT": "triangles",
}
FEW = {"MATERIAL_COUNT": "materials", "LIGHT_COUNT": "lights"}
_FEW_MAX = 64
_BLOCK_BYTES = 16384  # bytes that a uniform block may have with every driver
PICK_MAX = 2


def _loop(name: str) -> str:
    """The name of the define for the turns of a loop over shapes; another one counts the shapes that stand in it."""
    return name.replace("_COUNT", "_LOOP")


def looped(scene: SceneArrays) -> dict[str, int]:
    """The number of shapes of each kind that stand in the kernel's loops, by their member of `layout.Frame`."""
    kinds = zip(COUNTS.values(), ShapeKind, strict=False)
    return {f"looped_{records}": _looped(scene, kind, records) for records, kind in kinds}


def loops_from_frame() -> dict[str, object]:
    """The defines of a kernel that reads from the frame how many turns its loops make. Its rays begin a new walk down
    the tree after each layer that they pass: in a kernel with every kind of shape, one walk past all layers takes
    LLVM 160 s longer to compile."""
    return {_loop(name): f"frame.looped_{records}" for name, records in COUNTS.items()} | {"OPACITY_WALK": 0}


def counts(scene: SceneArrays) -> dict[str, object]:
    """The defines for the numbers of shapes in the kernel's loops, for the numbers of materials and lights where
    those are few, and for the places of textures."""
    kinds = zip(COUNTS.items(), ShapeKind, strict=False)  # instances are never looped over
    out: dict[str, object] = {name: _looped(scene, kind, records) for (name, records), kind in kinds}
    out |= {_loop(name): n for name, n in out.items()}
    few = {name: len(getattr(scene, records)) for name, records in FEW.items()}
    slots = {} if scene.textures is None else scene.textures.slots
    room = _BLOCK_BYTES // (layout.Material.dtype.itemsize + 16 * textures_glsl.groups(slots))
    most = {"MATERIAL_COUNT": min(_FEW_MAX, room), "LIGHT_COUNT": _FEW_MAX}
    out |= {name: n if n <= most[name] else 0 for name, n in few.items()}
    return {**out, **textures_glsl.defines(scene.textures), "QUAD_LAMP": _quad_lamp(scene)}


def _quad_lamp(scene: SceneArrays) -> int:
    """The index of the only emitting quad, where there is one and it stands in the kernel's loop; else -1."""
    lamps = np.flatnonzero(scene.quads["light"] != layout.NONE)
    return int(lamps[0]) if len(lamps) == 1 and lamps[0] < _looped(scene, ShapeKind.QUAD, "quads") else -1


def defines(
    raised: frozenset[str], settings: RenderSettings | None = None, shapes: Mapping[str, object] | None = None
) -> dict[str, object]:
    """The defines of a kernel: every flag as 0 or 1, numbers of records, and the settings that are compiled in."""
    out: dict[str, object] = {name: int(name in raised) for name in FLAGS}
    out |= {name: 0 for name in (*COUNTS, *map(_loop, COUNTS), *FEW)}
    out |= {"QUAD_LAMP": -1} | textures_glsl.defines(None) | dict(shapes or {})
    out["PICK_MAX"] = PICK_MAX
    out["FILTER_TABLE_SIZE"] = FILTER_TABLE_SIZE
    out |= {f"ESTIMATOR_{name.upper()}": i for i, name in enumerate(ESTIMATORS)}
    out["HAS_CLAMP"] = int(settings is not None and settings.clamp is not None)
    out["ADAPTIVE"] = int(settings is not None and settings.adaptive)
    out["ESTIMATOR"] = ESTIMATORS.index(settings.estimator) if settings else 0
    out["SAMPLER"] = SAMPLERS.index(settings.sampler) if settings else 0
    out["LOBE_CHOICE"] = 0
    out["OPACITY_WALK"] = 1
    return out
