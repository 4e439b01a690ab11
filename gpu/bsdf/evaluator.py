"""Values, densities and albedos of one material, in slices of bounded time between which the caller renders pictures.

A material comes as a scene that holds it and nothing else.
Directions are in the frame of `shaders/bsdf/bsdf_alone.glsl`: z is the outward normal, x the tangent.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from gpu import context as contexts
from gpu import layout
from gpu.arrays import SceneArrays
from gpu.bsdf import kernels as bare_kernels
from gpu.bsdf import lobes as single
from gpu.device.tables import Tables
from gpu.device.textures import KINDS, bound_textures, linear_texture
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.layout import BSDF_GROUP, bindings, models
from gpu.layout.bindings import Slot

DELTAS = 3  # as in shaders/bsdf/bsdf.glsl
BATCH = 64  # samples of one invocation: their sums in single precision are right to 4e-6
SLICE_S = 0.01  # seconds of a slice
_FIRST = 1024  # invocations of the first slice; the time that a slice takes decides the size of the next one
_MOST = 1 << 16  # invocations of any slice, which bounds the buffers


@dataclass(frozen=True)
class BsdfValues:
    """For n directions wo and m directions wi: `f` (n, m, 3), 1/sr, without the cosine, transmission as basic
    radiance; `pdf` (n, m), 1/sr. Perfectly specular lobes, which are in neither: `delta_wi` (n, DELTAS, 3),
    `delta_weight` (n, DELTAS, 3), and `delta_probability` (n, DELTAS), 0 where there is none. All float32.

    Where they were asked for, `lobes` (k, n, m, 3) are the parts that add up to `f`, and `lobe_names` (k,) their
    names, such as "diffuse"; else k is 0.
    """

    f: np.ndarray
    pdf: np.ndarray
    delta_wi: np.ndarray
    delta_weight: np.ndarray
    delta_probability: np.ndarray
    lobes: np.ndarray
    lobe_names: np.ndarray


@dataclass(frozen=True)
class BsdfAlbedo:
    """The mean factor by which `samples` samples multiply radiance, reflected and transmitted, (n, 3) float64, and
    its standard error (n, 3)."""

    albedo: np.ndarray
    error: np.ndarray


@dataclass(frozen=True)
class BsdfTerms:
    """Terms for n directions: `distribution` (n,), 1/sr, `geometry` (n,) and `fresnel` (n, 3), all float32. Where
    `has_facets` (n,) is false the surface is a perfect mirror, which has only the last of them."""

    distribution: np.ndarray
    geometry: np.ndarray
    fresnel: np.ndarray
    has_facets: np.ndarray


class BsdfEvaluator:
    """Made by `Renderer.bsdf`. Tables are uploaded when they are first needed, and stay."""

    def __init__(self, context: Any, kernels: KernelCache) -> None:
        self._context, self._kernels = context, kernels
        self._tables = Tables(context)

    def values(
        self,
        material: SceneArrays,
        wo: np.ndarray,
        wi: np.ndarray,
        slice_s: float = SLICE_S,
        paired: bool = False,
        lobes: bool = False,
    ) -> Generator[None, None, BsdfValues]:
        """Evaluate a material for every pair of `wo` (n, 3) and `wi` (m, 3), unit length. With `paired` each wo is
        taken with the wi of the same index: m must be n, and is 1 in the result. With `lobes` each lobe is evaluated
        alone, too.

        Raises CompileError, OutOfMemory.
        """
        n, m = len(wo), 1 if paired else len(wi)
        model = models.BY_NUMBER[int(material.materials["model"][0])]
        alone, names = (model.lobes, model.lobe_names) if lobes else ((), ())
        found = []
        work = self._dispatch(material, bare_kernels.VALUES, {"wo_count": n, "wi_count": m, "wi_step": int(paired)})
        try:
            work.give(np.concatenate([wo, wi]))
            work.make(Slot.OUTPUT, 16 * n * m)
            work.make(Slot.MOMENTS, 32 * DELTAS * n)
            for lobe in (single.EVERY, *alone):
                for _ in work.slices(n * m, slice_s, lobe_shown=int(lobe)):
                    yield
                found.append(work.read(Slot.OUTPUT).reshape(n, m, 4))
            wi_, weight = np.moveaxis(work.read(Slot.MOMENTS).reshape(n, DELTAS, 2, 4), 2, 0)
        finally:
            work.release()
        whole, *parts = found
        shown = np.stack([part[..., :3] for part in parts]) if parts else np.zeros((0, n, m, 3), np.float32)
        return BsdfValues(
            whole[..., :3],
            whole[..., 3],
            wi_[..., :3],
            weight[..., :3],
            wi_[..., 3],
            lobes=shown,
            lobe_names=np.array(names, np.str_),
        )

    def albedo(
        self, material: SceneArrays, wo: np.ndarray, samples: int, slice_s: float = SLICE_S
    ) -> Generator[None, None, BsdfAlbedo]:
        """Sample a material as a path does, `samples` times from each of `wo` (n, 3), unit length.

        The scatter of a batch tells the error of a single sample.

        Raises CompileError, OutOfMemory.
        """
        mean, deviation = yield from self._sampled(material, wo, samples, slice_s)
        if samples == 1:
            _, deviation = yield from self._sampled(material, wo, BATCH, slice_s)
        return BsdfAlbedo(mean, deviation / np.sqrt(samples))

    def _sampled(
        self, material: SceneArrays, wo: np.ndarray, samples: int, slice_s: float
    ) -> Generator[None, None, tuple[np.ndarray, np.ndarray]]:
        """The mean of the samples and their standard deviation, (n, 3) each; that of one sample is 0."""
        n, batches = len(wo), -(-samples // BATCH)
        sums = np.zeros((2, n, 3))
        work = self._dispatch(material, bare_kernels.ALBEDO, {"batches": batches, "batch": BATCH, "samples": samples})
        try:
            work.give(wo)
            work.make(Slot.OUTPUT, 32 * min(_MOST, n * batches))
            for first, count in work.slices(n * batches, slice_s):
                part = work.read(Slot.OUTPUT, 32 * count).reshape(count, 2, 4).astype(np.float64)
                rows = np.arange(first, first + count) // batches
                for total, each in zip(sums, (part[:, 0], part[:, 1]), strict=True):
                    np.add.at(total, rows, each[:, :3])
                yield
        finally:
            work.release()
        mean = sums[0] / samples
        # Rounding may leave a variance slightly below 0 where all samples are alike.
        variance = np.maximum(sums[1] / samples - mean**2, 0.0) * (samples / max(samples - 1, 1))
        return mean, np.sqrt(variance)

    def terms(
        self, material: SceneArrays, wo: np.ndarray, wi: np.ndarray, slice_s: float = SLICE_S
    ) -> Generator[None, None, BsdfTerms]:
        """The terms of a material of microfacets: D at the normals `wi` (n, 3), F at their cosines, and G between the
        direction `wo` (1, 3) and each of `wi`, taken as a direction and mirrored at the surface's normal.

        Raises CompileError, OutOfMemory.
        """
        work = self._dispatch(material, bare_kernels.TERMS, {})
        try:
            work.give(np.concatenate([wo, wi]))
            work.make(Slot.OUTPUT, 32 * len(wi))
            for _ in work.slices(len(wi), slice_s):
                yield
            facets, rest = np.moveaxis(work.read(Slot.OUTPUT).reshape(len(wi), 2, 4), 1, 0)
        finally:
            work.release()
        return BsdfTerms(facets[:, 3], rest[:, 0], facets[:, :3], rest[:, 1] > 0)

    def release(self) -> None:
        self._tables.release()

    def _dispatch(self, material: SceneArrays, entry: str, uniforms: dict[str, int]) -> _Dispatch:
        contexts.use(self._context)
        bare = bare_kernels.bare(material)
        flags = features.evaluating(bare)
        kernel = self._kernels.get(entry, bare_kernels.defines(bare, flags, entry))
        work = _Dispatch(self._context, self._kernels, kernel, self._tables.textures(flags), uniforms)
        try:
            work.upload(bare, flags)
        except BaseException:
            work.release()
            raise
        return work


class _Dispatch:
    """A kernel with its buffers, for one evaluation. Between slices the context and the kernel serve other work, so
    each slice binds its buffers and sets its uniforms again."""

    def __init__(
        self, context: Any, kernels: KernelCache, kernel: Any, tables: dict[int, Any], uniforms: dict[str, int]
    ) -> None:
        self._context, self._kernels, self._kernel = context, kernels, kernel
        self._tables, self._uniforms = tables, uniforms
        self._buffers: dict[Slot, Any] = {}
        self._blocks: dict[int, Any] = {}
        self._textures: dict[int, Any] = {}
        kernels.hold(kernel)

    def upload(self, material: SceneArrays, flags: frozenset[str]) -> None:
        """Upload the material, and what else its kernels read."""
        record = np.ascontiguousarray(material.materials).view(np.uint8)
        self._blocks[bindings.COUNTED["material"]] = contexts.allocate(self._context, record)
        self._blocks[bindings.UNIFORM_BLOCK] = contexts.allocate(self._context, layout.Uniforms.dtype.itemsize)
        self._blocks[bindings.UNIFORM_BLOCK].clear()
        for unit, texels in bound_textures(material, flags).items():
            self._textures[unit] = linear_texture(self._context, texels, *KINDS[unit])

    def give(self, directions: np.ndarray) -> None:
        """Upload directions (n, 3), which kernels read as vec4."""
        padded = np.zeros((len(directions), 4), np.float32)
        padded[:, :3] = directions
        padded[np.abs(padded) < np.finfo(np.float32).tiny] = (
            0.0  # whether shaders see subnormals is the driver's choice
        )
        self._buffers[Slot.SUM] = contexts.allocate(self._context, padded)

    def make(self, slot: Slot, size: int) -> None:
        """Allocate a buffer of `size` bytes, which the kernel writes."""
        self._buffers[slot] = contexts.allocate(self._context, size)

    def read(self, slot: Slot, size: int = -1) -> np.ndarray:
        """The first `size` bytes of a buffer, or all of them, as float32."""
        contexts.use(self._context)
        return np.frombuffer(self._buffers[slot].read(size), np.float32)

    def slices(self, total: int, slice_s: float, **uniforms: int) -> Iterator[tuple[int, int]]:
        """Run over `total` invocations in parts (first, count) of about `slice_s` seconds, each done when yielded."""
        first, size = 0, _FIRST
        while first < total:
            count = min(size, total - first)
            began = time.perf_counter()
            self._run(first, count, uniforms)
            seconds = time.perf_counter() - began
            yield first, count
            first += count
            growth = min(max(slice_s / max(seconds, 1e-6), 0.25), 4.0)
            size = min(max(int(size * growth) // BSDF_GROUP, 1) * BSDF_GROUP, _MOST)

    def _run(self, first: int, count: int, uniforms: dict[str, int]) -> None:
        contexts.use(self._context)
        for slot, buffer in self._buffers.items():
            buffer.bind_to_storage_buffer(int(slot))
        for block, buffer in self._blocks.items():
            buffer.bind_to_uniform_block(block)
        for unit, texture in (*self._tables.items(), *self._textures.items()):
            texture.use(unit)
        for name, value in {**self._uniforms, **uniforms, "first": first, "count": count}.items():
            self._kernel[name].value = value
        contexts.dispatch(self._context, self._kernel, -(-count // BSDF_GROUP))
        contexts.finish(self._context)

    def release(self) -> None:
        contexts.use(self._context)
        for thing in (*self._buffers.values(), *self._blocks.values(), *self._textures.values()):
            thing.release()
        self._kernels.let_go(self._kernel)
