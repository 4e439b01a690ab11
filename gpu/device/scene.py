"""A scene on the device: its buffers, its flags, and the numbers that change without an upload."""

from __future__ import annotations

import logging
import math
from functools import partial
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from gpu import context as contexts
from gpu import layout
from gpu.arrays import EnvironmentArrays, SceneArrays
from gpu.device import buffers, lamps, tables
from gpu.device.textures import IMAGE_UNITS, KINDS, bound_textures, linear_texture, placeholder
from gpu.device.uploads import Buffer, SharedUploads, Taken, Textures, UploadCache
from gpu.errors import GpuError
from gpu.footprint import unshared_bytes
from gpu.kernels import features
from gpu.layout import LightKind, bindings
from gpu.layout.bindings import Slot
from gpu.settings import RenderSettings

log = logging.getLogger(__name__)

_BLOCKS = {layout.BUFFERS[name][1]: block for name, block in bindings.COUNTED.items()}
_BLOCK_MAX = 16384  # bytes of a uniform block on every driver; of a longer buffer kernels see the first records
RADIANCE_MAX = 1e20  # most of a texel times the environment's scale
# The least chance that the surface that the camera sees is followed by reflection, and by refraction, in scenes with
# a lamp or a sun. By their light alone a lamp in clear glass is picked one time in 25: it shows as white dots. In
# other scenes the chances are those of the light, which is less noise where both sides are about as bright.
GLINT_CHANCE = 1 / 3


class _Environment(NamedTuple):
    """An environment on the device, and the greatest factor by which it may be brighter."""

    texels: Any
    cells: Any
    scale_max: float
    bytes: int

    def release(self) -> None:
        self.texels.release()
        self.cells.release()


def _words(flags: frozenset[str]) -> tuple[str, ...]:
    return tuple(sorted(flag.removeprefix("HAS_").lower() for flag in flags))


def material_words(arrays: SceneArrays) -> np.ndarray:
    """(materials, n) uint32: each material, followed by its slots and uses of textures."""
    records = np.ascontiguousarray(arrays.materials)
    words = records.view(np.uint32).reshape(len(records), layout.Material.words)
    return words if arrays.textures is None else np.concatenate([words, arrays.textures.words], axis=1)


class Scene:
    """Uploaded arrays. Made by `Renderer.load`; several pictures may be taken of one scene."""

    def __init__(
        self,
        context: Any,
        arrays: SceneArrays,
        editing: bool,
        shared: SharedUploads,
        everything: bool = False,
        raised: frozenset[str] = frozenset(),
    ) -> None:
        self._context = context
        self._shared = shared
        self._editing = editing
        self._everything = everything
        self._raised = raised
        self.arrays = arrays
        self._raised = self._flags()
        self._looped = features.looped(arrays)
        self._lamps = self._brightest()
        self._buffers: dict[Slot, Any] = {}
        self._details: dict[int, Any] = {}  # textures by unit
        self._images: Taken[Textures] | None = None
        self._measured: Taken[Textures] | None = None
        self._lit: Taken[_Environment] | None = None
        self._tables: dict[str, Taken[Textures]] = {}
        self.bytes = unshared_bytes(arrays)  # on the device, without what other scenes have, too
        self.uploaded = 0  # bytes that edits which move shapes have uploaded
        try:
            self._upload_all()
        except GpuError:
            self.release()
            raise
        count = sum(len(getattr(arrays, n)) for n in ("spheres", "quads", "boxes", "ellipsoids", "triangles"))
        log.info("loaded scene", {"shapes": count, "lights": len(arrays.lights), "materials": len(arrays.materials)})

    def _upload_all(self) -> None:
        for slot in buffers.BUFFERS:
            self._buffers[slot] = buffers.shared(self._context, slot, self.arrays)
        self._buffers[Slot.MATERIALS] = buffers.upload(self._context, self._materials())
        self._upload_details()
        self._lit = self._take_environment(self.arrays.environment)
        self._take_tables()

    def _materials(self) -> np.ndarray:
        return material_words(self.arrays)

    def _upload_details(self) -> None:
        """Make the textures of the images' texels and of the triangles' corners that the scene's kernels read."""
        bound = bound_textures(self.arrays, self._raised)
        measured = bound.pop(bindings.MEASURED_TEXTURE, None)
        if measured is not None:
            make = partial(self._upload_images, {bindings.MEASURED_TEXTURE: measured})
            self._measured = self._shared.measured.take(self.arrays.measured_key, make)
        for unit, values in bound.items():
            if unit not in IMAGE_UNITS:
                self._details[unit] = linear_texture(self._context, values, *KINDS[unit])
        key = self.arrays.textures.key if self.arrays.textures is not None else ""
        images = {unit: values for unit, values in bound.items() if unit in IMAGE_UNITS}
        self._images = self._shared.images.take(key, partial(self._upload_images, images))
        if self._everything:  # its kernels read every unit; another scene's texture may still be bound there
            missing = KINDS.keys() - self._details.keys() - images.keys()
            missing -= {bindings.MEASURED_TEXTURE} if measured is not None else set()
            self._details |= {unit: placeholder(self._context, unit) for unit in missing}

    def _upload_images(self, images: dict[int, np.ndarray]) -> Textures:
        return Textures(
            {unit: linear_texture(self._context, values, *KINDS[unit]) for unit, values in images.items()}
        )

    def _take_tables(self) -> None:
        for name in tables.needed(self._raised):
            if name not in self._tables:
                self._tables[name] = self._shared.tables.take(name, partial(tables.upload, self._context, name))

    def _flags(self) -> frozenset[str]:
        """The flags of its kernels, by its arrays and by the flags that it had before."""
        if self._everything:
            return features.common() | features.flags(self.arrays)
        if self._editing and self._raised:
            return features.grown(self._raised, self.arrays)
        return features.flags(self.arrays, self._editing)

    def _brightest(self) -> np.ndarray | None:
        return lamps.brightest(self.arrays) if features.draws_towards_lamps(self._raised) else None

    def _upload_environment(self, e: EnvironmentArrays | None) -> _Environment:
        """Raises SceneTooLarge, OutOfMemory."""
        texels = np.zeros((1, 1, 4), np.float32)
        scale_max = RADIANCE_MAX
        cells = np.zeros(0, layout.EnvironmentCell.dtype)
        if e is not None:
            texels = np.dstack([e.texels, e.probability]).astype(np.float32)
            cells = e.cells
            peak = float(e.texels.max()) + (max(e.sun.radiance) if e.sun is not None else 0.0)
            scale_max = RADIANCE_MAX / max(peak, 1.0)
        height, width = texels.shape[:2]
        buffer = buffers.upload(self._context, cells)
        texture = contexts.texture(self._context, (width, height), 4, "f4", np.ascontiguousarray(texels))
        texture.filter = (self._context.NEAREST, self._context.NEAREST)
        return _Environment(texture, buffer, scale_max, texels.nbytes + buffer.size)

    def _take_environment(self, e: EnvironmentArrays | None) -> Taken[_Environment]:
        """Raises SceneTooLarge, OutOfMemory."""
        key = "none" if e is None else e.key
        return self._shared.environments.take(key, partial(self._upload_environment, e))

    @property
    def _environment(self) -> _Environment:
        assert self._lit is not None
        return self._lit.upload

    def defines(self, settings: RenderSettings) -> dict[str, object]:
        """The defines that its kernels are compiled with."""
        return features.defines(self._raised, settings, features.counts(self.arrays))

    @property
    def looks(self) -> UploadCache[Buffer]:
        """The tables of displays on the device, which all scenes of its context share."""
        return self._shared.looks

    @property
    def flags(self) -> frozenset[str]:
        return self._raised

    @property
    def features(self) -> tuple[str, ...]:
        """The features that its kernels are compiled for, in words: "bvh", "sun_disks"."""
        return _words(self._raised)

    @property
    def spared(self) -> tuple[str, ...]:
        """The features that its kernels are not compiled for."""
        return _words(features.everything() - self._raised)

    def edit(self, arrays: SceneArrays, flags: frozenset[str] | None = None) -> None:
        """Change to `arrays`, which a `SceneEdit` made of the scene's own, and upload what differs, nothing else.

        `flags` are those of its kernels then, where the caller has found them already. The caller resets the scene's
        pictures. Raises SceneTooLarge, OutOfMemory, and then changes nothing.
        """
        contexts.use(self._context)
        old, lab, lit = self.arrays, None, None
        if arrays.microfacets is not old.microfacets and not np.array_equal(arrays.microfacets, old.microfacets):
            lab = linear_texture(self._context, arrays.microfacets, *KINDS[bindings.MICROFACETS_TEXTURE])
        was, is_ = old.environment, arrays.environment
        if was is not None and is_ is not None and not is_.has_map_of(was):
            lit = self._take_environment(is_)
        try:
            self.uploaded += buffers.move(self._context, old, arrays, self._buffers, self._details)
        except GpuError:
            if lit is not None:
                lit.release()
            raise
        self.arrays = arrays
        if lab is not None:
            if bindings.MICROFACETS_TEXTURE in self._details:  # false where this edit adds the first such material
                self._details[bindings.MICROFACETS_TEXTURE].release()
            self._details[bindings.MICROFACETS_TEXTURE] = lab
        if lit is not None:
            assert self._lit is not None
            self._lit.release()
            self._lit = lit
        same_materials = arrays.materials is old.materials and arrays.textures is old.textures
        if len(arrays.materials) and not same_materials:
            self._buffers[Slot.MATERIALS].write(np.ascontiguousarray(self._materials()).view(np.uint8))
        self._looped = features.looped(arrays)
        self._raised = self._flags() if flags is None else flags
        self._lamps = self._brightest()
        self._take_tables()
        self.bytes = unshared_bytes(arrays)

    def bind(self) -> None:
        """Bind every buffer of the scene to its slot."""
        for slot, buffer in self._buffers.items():
            buffer.bind_to_storage_buffer(int(slot))
            if slot in _BLOCKS:
                buffer.bind_to_uniform_block(_BLOCKS[slot], size=min(buffer.size, _BLOCK_MAX))
        self._environment.cells.bind_to_storage_buffer(int(Slot.ENVIRONMENT_CELLS))
        self._environment.texels.use(bindings.ENVIRONMENT_TEXTURE)
        taken = (*self._tables.values(), self._images, self._measured)
        shared = [each.upload for each in taken if each is not None]
        for unit, texture in chain(*(textures.items() for textures in (*shared, self._details))):
            texture.use(unit)

    def write_uniforms(self, uniforms: np.ndarray) -> None:
        """Fill the scene's part of a `layout.Uniforms` record."""
        a = self.arrays
        uniforms["camera"] = a.camera
        uniforms["node_origin"] = a.node_origin
        uniforms["node_scale"] = a.node_scale
        uniforms["node_count"] = a.node_count
        uniforms["node_first"], uniforms["instance_shift"] = len(a.instance_nodes), a.instance_shift
        uniforms["light_count"] = len(a.lights)
        for member, count in self._looped.items():
            uniforms[member] = count
        suns = np.flatnonzero((a.lights["kind"] == LightKind.DIRECTIONAL) & (a.lights["spread"] > 0))
        uniforms["sun_first"], uniforms["sun_count"] = suns.min(initial=len(a.lights)), len(suns)
        if self._lamps is not None:
            for member, values in zip(lamps.MEMBERS, self._lamps, strict=True):
                uniforms[member] = values
        uniforms["moment_scale"] = 1.0 / a.radiance_scale
        if len(suns) or (a.environment and a.environment.sun) or (a.materials["emission"] > 0).any():
            uniforms["glint_chance"] = GLINT_CHANCE
        uniforms["environment_turn"] = (1.0, 0.0)
        if a.environment is not None:
            e = a.environment
            uniforms["environment_turn"] = (math.cos(e.rotation), math.sin(e.rotation))
            uniforms["environment_scale"] = min(e.scale, self._environment.scale_max)
            uniforms["environment_background"] = e.background
            uniforms["environment_cube"] = e.cube
            if e.sun is not None:
                uniforms["environment_sun"] = e.sun.direction
                uniforms["environment_sun_cap"] = e.sun.cap
                uniforms["environment_sun_radiance"] = e.sun.radiance
                uniforms["environment_sun_share"] = e.sun_share
            uniforms["environment_probability"] = a.lights["probability"][
                a.lights["kind"] == LightKind.ENVIRONMENT
            ].sum()

    def release(self) -> None:
        contexts.use(self._context)
        for buffer in self._buffers.values():
            buffer.release()
        for texture in self._details.values():
            texture.release()
        for taken in (*self._tables.values(), self._images, self._measured, self._lit):
            if taken is not None:
                taken.release()
