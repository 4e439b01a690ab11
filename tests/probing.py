"""Runs the kernels of tests/shaders/probes, which expose one shader function each."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from gpu import Renderer, layout
from gpu.device.tables import Tables
from gpu.device.textures import linear_texture
from gpu.kernels import features
from gpu.kernels.cache import KernelCache
from gpu.kernels.flag_table import FLAGS
from gpu.kernels.source import SHADERS
from gpu.layout import bindings
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from gpu.picture import filters
from tests.families import EXACT

PROBES = Path(__file__).parent / "shaders" / "probes"


def with_sliders(model: str) -> frozenset[str]:
    """The flag of a material model, and those that its sliders can raise."""
    return frozenset(n for n, flag in FLAGS.items() if model in (n, *flag.raised_with, *flag.compiled_with))


DISNEY_FLAGS = with_sliders("HAS_DISNEY")
# All flags of the production model.
PRINCIPLED_FLAGS = with_sliders("HAS_PRINCIPLED") | {"HAS_ATTENUATION"}
OPENPBR_FLAGS = with_sliders("HAS_OPENPBR")


def materials(**members: Any) -> np.ndarray:
    """One `layout.Material` with the contract's defaults, but for what is given."""
    out = np.zeros(1, layout.Material.dtype)
    defaults = {"base_color": 0.5, "roughness": 0.5, "specular": 0.5, "sheen_tint": 0.5, "clearcoat_gloss": 1.0}
    defaults["opacity"] = 1.0
    defaults |= {"specular_color": 1.0, "attenuation_color": 1.0, "sheen_roughness": 0.5}
    defaults |= {"film_weight": 1.0, "film_ior": 1.4}
    for name in ("ior", "attenuation_distance", "clearcoat_roughness", "sheen_color", "diffuse_transmission_color"):
        defaults[name] = layout.ABSENT
    for name, value in {**defaults, **members}.items():
        out[name] = value
    return out


def openpbr(**members: Any) -> np.ndarray:
    """One of the model `openpbr` with the specification's defaults, but for what is given."""
    defaults = {"base_weight": 1, "base_color": 0.8, "specular": 1, "roughness": 0.3, "ior": 1.5, "sheen_color": 1}
    defaults |= {"clearcoat_roughness": 0, "coat_ior": 1.6, "coat_color": 1, "coat_darkening": 1}
    return materials(**{"model": NUMBERS["openpbr"], **defaults, **members})


def rare(record: np.ndarray) -> frozenset[str]:
    """The flags that a material raises for code which kernels have only where a scene needs it."""
    members = {"HAS_CONDUCTOR": "conductor_eta", "HAS_THIN_WALLS": "thin_walled", "HAS_FILM": "film_thickness"}
    raised = frozenset(flag for flag, member in members.items() if (record[member] > 0).any())
    if "HAS_FILM" in raised and (record["metallic"] > 0).any():
        raised |= {"HAS_METAL_FILM"}
    return raised if EXACT else raised | {"HAS_CONDUCTOR", "HAS_THIN_WALLS"}  # that more in one kernel


class Prober:
    """Kernels, buffers and uniforms for probes on the context of a Renderer; see `prober_of`."""

    def __init__(self, renderer: Renderer) -> None:
        self.context = renderer.context
        self._kernels = KernelCache(self.context, (PROBES, SHADERS))

    @cached_property
    def _tables(self) -> Tables:
        return Tables(self.context)

    def run(
        self,
        entry: str,
        count: int,
        inputs: Mapping[Slot, np.ndarray] | None = None,
        outputs: tuple[Slot, ...] = (Slot.OUTPUT,),
        defines: Mapping[str, object] | None = None,
        raised: frozenset[str] = frozenset(),
        frame: np.ndarray | None = None,
        filter_name: str = "box",
        microfacets: np.ndarray | None = None,
        measured: np.ndarray | None = None,
        **uniforms: Any,
    ) -> list[np.ndarray]:
        """(count, 4) float32 of each output slot after one run over `count` invocations.

        `microfacets` and `measured` are the words of these members of `SceneArrays`.
        """
        kernel = self._kernels.get(entry, {**features.defines(raised), **(defines or {})})
        made = {slot: self.context.buffer(np.ascontiguousarray(a).tobytes()) for slot, a in (inputs or {}).items()}
        made |= {slot: self.context.buffer(reserve=16 * count) for slot in outputs}
        for slot, buffer in made.items():
            buffer.bind_to_storage_buffer(int(slot))
        table = np.zeros((features.FILTER_TABLE_SIZE + 1, 4), np.float32)
        table[:, :2] = filters.table(filter_name, features.FILTER_TABLE_SIZE)
        blocks = [self.context.buffer(table.tobytes())]
        frame = np.zeros((), layout.Uniforms.dtype) if frame is None else frame
        blocks.append(self.context.buffer(frame.tobytes()))
        blocks[0].bind_to_uniform_block(bindings.FILTER_BLOCK)
        blocks[1].bind_to_uniform_block(bindings.UNIFORM_BLOCK)
        for name, value in {**uniforms, "count": count}.items():
            if name in kernel:  # else nothing depends on it
                kernel[name].value = value
        for unit, texture in self._tables.textures(raised).items():
            texture.use(unit)
        given = {bindings.MICROFACETS_TEXTURE: microfacets, bindings.MEASURED_TEXTURE: measured}
        lab = {u: linear_texture(self.context, words, 4, "u4") for u, words in given.items() if words is not None}
        for unit, texture in lab.items():
            texture.use(unit)
        kernel.run(-(-count // 64))
        results = [np.frombuffer(made[slot].read(), np.float32).reshape(count, 4) for slot in outputs]
        for buffer in (*made.values(), *blocks, *lab.values()):
            buffer.release()
        return results


@cache
def prober_of(renderer: Renderer) -> Prober:
    """The one of that renderer: kernels that are not released stay, and take 7 MB each."""
    return Prober(renderer)
