"""Kernels compiled ahead: in another process, into the driver's disk cache, from where loading takes some ms."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import Any

import numpy as np

from gpu import bindings, features, layout, meter, resolve
from gpu import context as contexts
from gpu.arrays import HEAVY, SHAREABLE, SceneArrays
from gpu.errors import CompileError
from gpu.layout import ShapeKind
from gpu.program import Source
from gpu.settings import TONE_MAPS, RenderSettings
from gpu.texels import BYTES, KINDS

ENTRY, GUIDES = "pathtrace.comp", "guides.comp"  # those that depend on the scene; the others: `common`
_BUFFER = 1 << 16  # bytes; zeros for whatever is bound, and no pixel looks at it
_QUICK_S = 0.04  # of processor time: no compiler was at work
_LOOKS = 8  # for a kernel in the disk cache, which drivers write behind our back


@dataclass(frozen=True)
class Recipe:
    """All that the machine code of a picture's kernel depends on, but the driver.

    `textures` are (unit, channels, dtype, width, height): code for sides that are powers of two differs, their
    length does not matter, so that they are given as 1 or 3.
    """

    defines: tuple[tuple[str, object], ...]
    textures: tuple[tuple[int, int, str, int, int], ...]
    entry: str = ENTRY

    @property
    def text(self) -> str:
        return Source(self.entry, dict(self.defines)).text

    def digest(self, driver: str) -> str:
        return sha256(repr((driver, self.text, self.textures)).encode()).hexdigest()[:32]


def recipe(arrays: SceneArrays, settings: RenderSettings, raised: frozenset[str], entry: str = ENTRY) -> Recipe:
    """What a picture of `arrays` needs compiled where these flags are raised: its kernel, or that of its GUIDES."""
    defines = features.defines(raised, settings, features.counts(arrays))
    return Recipe(tuple(defines.items()), _textures(arrays, raised), entry)


def moved_recipe(arrays: SceneArrays, settings: RenderSettings) -> Recipe | None:
    """What a stream will need when it first moves a large mesh of this scene; None where it has none, or instances.
    A guess where there are small meshes beside it, some of which may stand in the kernel's loop.
    """
    if len(arrays.instances):
        return None
    owners = arrays.triangles["shape"] & np.uint32(~(layout.SINGLE_SIDED | layout.HIDDEN) & layout.NONE)
    counts, lamps = np.bincount(owners), np.bincount(owners, arrays.triangles["light"] != layout.NONE)
    if not ((counts >= HEAVY) & (lamps == 0)).any():
        return None
    small = ((counts > 0) & ((counts < SHAREABLE) | (lamps > 0))).any()
    kinds = arrays.bvh_kinds | {ShapeKind.TRIANGLE, ShapeKind.INSTANCE}
    large = {**arrays.large, ShapeKind.TRIANGLE: arrays.large.get(ShapeKind.TRIANGLE, 0) if small else 0}
    one = np.zeros(1, layout.Instance.dtype)
    apart = replace(arrays, instances=one, bvh_kinds=kinds, large=large)
    return recipe(apart, settings, features.flags(apart, True))


def touched_recipes(arrays: SceneArrays, settings: RenderSettings) -> list[Recipe]:
    """What a stream will need when it first touches a slider of `principled` that is not compiled in with the others.
    A guess for meshes, of which only those of the material that is stretched get tangents.
    """
    has = features.flags(arrays, True)
    if "HAS_PRINCIPLED" not in has:
        return []
    along = {"HAS_TANGENTS"} if "HAS_SMOOTH_NORMALS" in has else set()
    clear, stretched = {"HAS_TRANSMISSION"}, {"HAS_ANISOTROPIC", *along}
    asked = {has | clear, has | stretched, has | clear | stretched} - {has}
    return [recipe(arrays, settings, raised) for raised in sorted(asked, key=len)]


def full_recipe(arrays: SceneArrays, settings: RenderSettings) -> Recipe:
    """The same with every flag raised, for a `scene.Everything`, which has something bound to every texture unit."""
    own = recipe(arrays, settings, features.everything())
    bound = {unit for unit, *_ in own.textures}
    bare = ((unit, channels, dtype, 1, 1) for unit, (channels, dtype) in KINDS.items() if unit not in bound)
    return replace(own, textures=(*own.textures, *bare))


def common() -> list[Recipe]:
    """The kernels of any scene: what a picture is shown with, and what the noise meter and `adaptive` ask of it."""
    shown = [("resolve.comp", resolve.defines(curve, dtype)) for curve in TONE_MAPS for dtype in ("u1", "f4")]
    metered = [("meter.comp", meter.defines(weigh)) for weigh in (0, 1)]
    entries = [*shown, *metered, ("areas.comp", features.defines(frozenset()))]
    return [Recipe(tuple(defines.items()), (), entry) for entry, defines in entries]


def _textures(a: SceneArrays, raised: frozenset[str]) -> tuple[tuple[int, int, str, int, int], ...]:
    height, width = (1, 1) if a.environment is None else a.environment.texels.shape[:2]
    out = [(bindings.ENVIRONMENT_TEXTURE, 4, "f4", _side(width), _side(height))]
    rows = [
        (bindings.UVS_TEXTURES[0], a.triangle_uvs, 2, "f4"),
        (bindings.UVS_TEXTURES[1], a.triangle_uvs_1, 2, "f4"),
        (bindings.COLORS_TEXTURE, a.corner_colors if "HAS_VERTEX_COLORS" in raised else a.triangle_colors, 4, "f2"),
        (bindings.INSTANCES_TEXTURE, a.instances, 4, "u4"),
    ]
    if a.textures is not None:
        rows += [(bindings.BYTES_TEXTURE, a.textures.texels, 4, "f1")]
        rows += [(bindings.FLOATS_TEXTURE, a.textures.floats, 4, "f4")]
    if "HAS_LIGHT_TREE" in raised:
        rows += [(bindings.LIGHT_TREE_TEXTURE, a.light_words, 4, "u4")]
    for unit, values, channels, dtype in rows:
        if len(values):
            height = -(-values.nbytes // (bindings.TEXELS_A_ROW * channels * BYTES[dtype]))
            out.append((unit, channels, dtype, _side(bindings.TEXELS_A_ROW), _side(height)))
    return tuple(out)


def _side(length: int) -> int:
    return 1 if length & (length - 1) == 0 else 3


def edited(arrays: SceneArrays, edits: dict[str, Any]) -> SceneArrays:
    """The arrays after `Scene.edit` of these."""
    changes: dict[str, Any] = {name: edits[name] for name in ("camera", "materials") if name in edits}
    if "environment" in edits and arrays.environment is not None:
        rotation, scale = edits["environment"]
        changes["environment"] = replace(arrays.environment, rotation=rotation, scale=scale)
    if "texture_words" in edits and arrays.textures is not None:
        changes["textures"] = replace(arrays.textures, words=edits["texture_words"])
    return replace(arrays, **changes, **edits.get("moved", {}))


class Ahead:
    """A context in a process of its own that only compiles. Raises ContextError where there is none to be had."""

    def __init__(self, device: int | None = None) -> None:
        self._context = contexts.create(device)
        self._zeros = self._context.buffer(bytes(_BUFFER))
        self._tables: dict[int, Any] = {}

    def compile(self, wanted: Recipe) -> tuple[float, bool]:
        """Milliseconds, and whether the next one finds it in the driver's disk cache. Raises CompileError."""
        began = time.perf_counter()
        first_s = self._once(wanted)
        milliseconds = (time.perf_counter() - began) * 1e3
        if first_s < _QUICK_S:
            return milliseconds, True
        for look in range(_LOOKS):
            time.sleep(0.002 * 2**look)
            if self._once(wanted) < max(_QUICK_S, first_s / 4):
                return milliseconds, True
        return milliseconds, False

    def _once(self, wanted: Recipe) -> float:
        """Compiles to machine code by running over no pixel; the processor time that it took (s)."""
        text = wanted.text
        textures = [self._texture(*kind) for kind in wanted.textures]
        if dict(wanted.defines).get("HAS_PRINCIPLED_LOBES"):
            for unit, table in self._energy().items():
                table.use(unit)
        start = time.process_time()
        try:
            kernel = self._context.compute_shader(text)
        except Exception as error:  # moderngl.Error is not importable without its binary parts
            raise CompileError(str(error)) from error
        for slot in range(len(bindings.Slot)):
            self._zeros.bind_to_storage_buffer(slot)
        for block in (bindings.FRAME_BLOCK, bindings.FILTER_BLOCK, *bindings.COUNTED.values()):
            self._zeros.bind_to_uniform_block(block)
        kernel.run(1, 1)
        self._context.finish()
        seconds = time.process_time() - start
        for thing in (kernel, *textures):
            thing.release()
        return seconds

    def _texture(self, unit: int, channels: int, dtype: str, width: int, height: int) -> Any:
        zeros = np.zeros((height, width, channels * BYTES[dtype]), np.uint8)
        texture = self._context.texture((width, height), channels, zeros, alignment=1, dtype=dtype)
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        texture.use(unit)
        return texture

    def _energy(self) -> dict[int, Any]:
        from gpu.scene import upload_tables

        self._tables = self._tables or upload_tables(self._context)
        return self._tables
