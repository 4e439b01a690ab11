"""Defines that kernels are compiled with: the flags of a scene, before and after edits, and the numbers of its
records."""

from __future__ import annotations

from collections.abc import Container, Mapping
from itertools import combinations

import numpy as np

from gpu import layout
from gpu.arrays import SceneArrays
from gpu.kernels import light_kinds, textures_glsl
from gpu.kernels.flag import ANYWHERE, beside
from gpu.kernels.flag_table import FLAGS, looped_count
from gpu.kernels.shape_kinds import LOOPED
from gpu.layout import ShapeKind
from gpu.layout.models import DELTA, FLAGGED, TABULATED, TRANSMITTING
from gpu.layout.pixel_layers import SPLAT_BYTES
from gpu.settings import ESTIMATORS, SAMPLERS, RenderSettings

FILTER_TABLE_SIZE = 512
FILMS = ("HAS_FILM", "HAS_METAL_FILM")


def everything() -> frozenset[str]:
    """All flags."""
    return frozenset(FLAGS)


def common() -> frozenset[str]:
    """The flags that are not rare. A kernel with all flags takes LLVM more than ten minutes and 7 GB."""
    return frozenset(flag.name for flag in FLAGS.values() if flag.in_general)


def flags(scene: SceneArrays, editing: bool = False) -> frozenset[str]:
    """The flags that `scene` raises; with `editing`, also those that its kernels have before a slider raises them."""
    raised = frozenset(flag.name for flag in FLAGS.values() if flag.asks(scene))
    return raised | {flag.name for flag in FLAGS.values() if editing and beside(flag.raised_with, raised)}


def camera_flags(scene: SceneArrays) -> frozenset[str]:
    """Those flags that the scene's camera raises by itself."""
    return frozenset(flag.name for flag in FLAGS.values() if flag.of_camera and flag.asks(scene))


def needed(raised: frozenset[str]) -> frozenset[str]:
    """Those of the flags that a picture needs: the others only spare work."""
    return frozenset(name for name in raised if not FLAGS[name].spares)


def grown(raised: frozenset[str], scene: SceneArrays) -> frozenset[str]:
    """The flags of a scene after an edit: those that were raised before, and those that it needs now."""
    return raised | needed(flags(scene, True))


def touched(raised: frozenset[str], anywhere: bool = True) -> list[frozenset[str]]:
    """The flags after the first touches of sliders whose code is compiled ahead, the smallest sets first. Without
    `anywhere`, sliders of any scene are left out."""
    groups: dict[str, list[str]] = {}
    for flag in FLAGS.values():
        for name in flag.compiled_with:
            if name in raised or (anywhere and flag.compiled_with == ANYWHERE):
                groups.setdefault(name, []).append(flag.name)
    combined = (some for group in groups.values() for n in range(len(group)) for some in combinations(group, n + 1))
    found = {raised.union(some, _following(raised, frozenset(some))) for some in combined}
    if anywhere:
        found |= {raised | {flag.name} for flag in FLAGS.values() if beside(flag.alone_with, raised)}
    return sorted(found - {raised}, key=lambda flags: (len(flags), sorted(flags)))


def _following(raised: frozenset[str], more: frozenset[str]) -> frozenset[str]:
    """The flags that come along when `more` are raised, too."""
    after = raised | more
    return frozenset(f.name for f in FLAGS.values() if beside(f.follows, more) and after.issuperset(f.follows))


def evaluating(material: SceneArrays) -> frozenset[str]:
    """The flags of kernels that evaluate the only material of a scene, while its sliders and menus are moved. What
    lies under its surface has no part in that."""
    raised = grown(frozenset(), material) - {"HAS_MEDIA", "HAS_SCATTERING", "HAS_WALKS"}
    return raised | {flag.name for flag in FLAGS.values() if beside(flag.evaluated_with, raised)}


def needs_tables(raised: Container[str]) -> bool:
    """True if kernels with these flags look up the tables of what microfacets lose."""
    return any(model.flag in raised for model in TABULATED)


def draws_towards_lamps(raised: frozenset[str]) -> bool:
    """True if distances in media are drawn towards lamps."""
    return raised >= {"HAS_MEDIA", "HAS_SCATTERING"} and not raised.isdisjoint(light_kinds.NEAR)


# Units, to a picture's scale of radiance, in which light is summed that comes to a pixel from elsewhere. 64 bits hold
# eight million times that radiance.
SPLAT_UNITS = 2.0**40
# Of that many samples the first two have paths of light. With some in each, a sample would take 2.8 to 4.4 times as
# long, and what other paths find, which is most of a picture, would be noisier after equal time.
LIGHT_PERIOD = 8
# Pixels whose sums every driver can bind at once, as light may come to any of them.
MOST_SPLATTED = (1 << 27) // SPLAT_BYTES


def traces_caustics(raised: Container[str], settings: RenderSettings) -> bool:
    """True if caustics are traced from the lights. With "auto" they are where that errs less at equal time; never
    where samples follow what was found, nor where surfaces become rough on the way, nor in pictures that a kernel
    cannot bind as a whole."""
    able = not settings.adaptive and settings.filter_glossy == 0 and settings.width * settings.height <= MOST_SPLATTED
    flag = {"light": "HAS_CAUSTICS", "auto": "HAS_SHARP_CAUSTICS"}.get(settings.caustics)
    return able and flag is not None and flag in raised


# Numbers of records that kernels are compiled for, so that loops over them unroll and picks among them need no
# varying index. 0: they are too many for that to gain time, or in the tree. docs/development.md says what each gains.
COUNTS = {f"{kind.name}_COUNT": kind for kind in LOOPED}
FEW = {"MATERIAL_COUNT": "materials", "LIGHT_COUNT": "lights"}
_FEW_MAX = 64
_BLOCK_BYTES = 16384  # bytes that a uniform block may have with every driver
PICK_MAX = 2
UNIFORM_BLOCKS = 1  # 0: records that are few are in storage buffers, too (gpu/kernels/layout_glsl.py)


def _loop(name: str) -> str:
    """The name of the define for the turns of a loop over shapes; another one counts the shapes that stand in it."""
    return name.replace("_COUNT", "_LOOP")


def looped(scene: SceneArrays) -> dict[str, int]:
    """The number of shapes of each kind that stand in the kernel's loops, by their member of `layout.Uniforms`."""
    return {f"looped_{records}": looped_count(scene, kind) for kind, records in LOOPED.items()}


# The defines of a kernel that shows what others are compiled for. Its rays begin a new walk down the tree after each
# layer that they pass: in a kernel with every kind of shape, one walk past all layers takes LLVM 160 s longer.
SOON: dict[str, object] = {"OPACITY_WALK": 0, "SHADE_ONCE": 1}


def loops_from_uniforms() -> dict[str, object]:
    """The defines of a kernel that reads from the uniforms how many turns its loops make."""
    turns: dict[str, object] = {_loop(name): f"uniforms.looped_{LOOPED[kind]}" for name, kind in COUNTS.items()}
    return turns | SOON


def choices_from_uniforms() -> dict[str, object]:
    """The defines of a kernel that reads from the uniforms which estimator and which sampler it is for."""
    return {"ESTIMATOR": "int(uniforms.estimator)", "SAMPLER": "int(uniforms.sampler)"}


def counts(scene: SceneArrays) -> dict[str, object]:
    """The defines for the numbers of shapes in the kernel's loops, for the numbers of materials and lights where
    those are few, and for the places of textures."""
    out: dict[str, object] = {name: looped_count(scene, kind) for name, kind in COUNTS.items()}
    out |= {_loop(name): n for name, n in out.items()}
    few = {name: len(getattr(scene, records)) for name, records in FEW.items()}
    room = _BLOCK_BYTES // (layout.Material.dtype.itemsize + 16 * textures_glsl.groups(scene.textures))
    most = {"MATERIAL_COUNT": min(_FEW_MAX, room), "LIGHT_COUNT": _FEW_MAX}
    out |= {name: n if n <= most[name] else 0 for name, n in few.items()}
    return {**out, **textures_glsl.defines(scene.textures), "QUAD_LAMP": _quad_lamp(scene)}


def _quad_lamp(scene: SceneArrays) -> int:
    """The index of the only emitting quad, where there is one and it stands in the kernel's loop; else -1."""
    lamps = np.flatnonzero(scene.quads["light"] != layout.NONE)
    return int(lamps[0]) if len(lamps) == 1 and lamps[0] < looped_count(scene, ShapeKind.QUAD) else -1


def _shades_once(raised: frozenset[str]) -> bool:
    """True if a kernel has the BSDF's code once, for lamps and for the path's own direction. Where that is long, LLVM
    takes a sixth less time then (11 s instead of 28 with ten models), and samples take
    no longer, but where paths walk below surfaces. A box of matt walls would gain nothing, and lose 15 %."""
    is_longest = not raised.isdisjoint(FILMS) or len([m for m in FLAGGED if m.lobes_flag in raised]) > 3
    return is_longest or (needs_tables(raised) and "HAS_WALKS" not in raised)


def defines(
    raised: frozenset[str], settings: RenderSettings | None = None, shapes: Mapping[str, object] | None = None
) -> dict[str, object]:
    """The defines of a kernel: every flag as 0 or 1, numbers of records, what any of its models can do, and the
    settings that are compiled in."""
    out: dict[str, object] = {name: int(name in raised) for name, flag in FLAGS.items() if not flag.of_settings}
    out |= {name: 0 for name in (*COUNTS, *map(_loop, COUNTS), *FEW)}
    out["ANY_MEDIA"] = int(not raised.isdisjoint(("HAS_MEDIA", "HAS_SCATTERING")))
    out["ANY_EQUIANGULAR"] = int(draws_towards_lamps(raised))
    out["ANY_CHAINS"] = int(not raised.isdisjoint(("HAS_BVH", "HAS_MIRRORS", "HAS_PRIORITIES", "HAS_WALKS")))
    for name, kinds in light_kinds.GROUPS.items():
        out[name] = int(not raised.isdisjoint(light_kinds.flags(kinds)))
    out["ANY_TRANSMITS"] = int(any(model.flag in raised for model in TRANSMITTING))
    out["ANY_FILM"] = int(not raised.isdisjoint(FILMS))
    out["ANY_NEEDS_TABLES"] = int(any(model.flag in raised for model in TABULATED))
    out["ANY_VEILS"] = int(not raised.isdisjoint(("HAS_OPACITY", "HAS_STRAIGHT", "HAS_PRIORITIES")))
    ordered = raised.issuperset(("HAS_STRAIGHT", "HAS_ATTENUATION")) or "HAS_PRIORITIES" in raised
    out["SHADOW_MEDIA"] = int(ordered)
    out |= {"QUAD_LAMP": -1} | textures_glsl.defines(None) | dict(shapes or {})
    out["PICK_MAX"] = PICK_MAX
    out["UNIFORM_BLOCKS"] = UNIFORM_BLOCKS
    out["FILTER_TABLE_SIZE"] = FILTER_TABLE_SIZE
    out |= {f"ESTIMATOR_{name.upper()}": i for i, name in enumerate(ESTIMATORS)}
    out["HAS_CLAMP"] = int(settings is not None and settings.clamp is not None)
    out["HAS_FILTER_GLOSSY"] = int(settings is not None and settings.filter_glossy > 0)
    if out["HAS_FILTER_GLOSSY"]:  # what is perfectly specular by itself gets lobes
        out |= {model.lobes_flag: 1 for model in DELTA if model.flag in raised}
    out["ADAPTIVE"] = int(settings is not None and settings.adaptive)
    out["ESTIMATOR"] = ESTIMATORS.index(settings.estimator) if settings else 0
    out["CAUSTICS"] = int(settings is not None and traces_caustics(raised, settings))
    out["REVERSED"] = 0
    out["LIGHT_PERIOD"] = f"{LIGHT_PERIOD}u"
    out["SPLAT_UNITS"] = f"{SPLAT_UNITS:.1f}"
    out["SAMPLER"] = SAMPLERS.index(settings.sampler) if settings else 0
    out["LOBE_CHOICE"] = 0
    out["OPACITY_WALK"] = 1
    out["SHADE_ONCE"] = int(_shades_once(raised))
    return out
