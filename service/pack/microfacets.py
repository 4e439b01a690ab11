"""The terms of the model `microfacet` as the renderer's words, with tables of those that have no closed form."""

from __future__ import annotations

import math

import numpy as np

from gpu.layout.microfacet_records import TERMS, Distribution, Microfacet
from gpu.tables import microfacet as tables
from service.document import Scene
from service.document.material.microfacet import MicrofacetMaterial
from service.document.texture import ScalarTexture


def pack_microfacets(scene: Scene) -> np.ndarray:
    """(n, 4) uint32 as `gpu.layout.microfacet_records` says; empty where no material is of that model."""
    records = np.zeros(len(scene.materials), Microfacet.dtype)
    rows: list[np.ndarray] = []
    first = len(records) * Microfacet.words // 4
    found = False
    for record, material in zip(records, scene.materials.values(), strict=True):
        if isinstance(material, MicrofacetMaterial):
            found = True
            made = _fill(record, material)
            record["table"] = first
            first += sum(map(len, made))
            rows += made
    if not found:
        return np.zeros((0, 4), np.uint32)
    return np.concatenate([part.view(np.uint32).reshape(-1, 4) for part in (records, *rows)])


def _fill(record: np.void, material: MicrofacetMaterial) -> list[np.ndarray]:
    """The rows of the material's table. Sets all members of `record` except the place where the table begins."""
    for kind, terms in TERMS.items():
        record[kind] = terms[getattr(material, kind).upper()]
    record["gamma"], record["diffuse_roughness"] = material.gamma, material.diffuse_roughness
    record["conductor_eta"] = material.conductor_eta or (1.0, 1.0, 1.0)
    record["conductor_k"] = material.conductor_k or (0.0, 0.0, 0.0)
    low, high = record["alpha_low"], record["alpha_high"] = material.alpha_range
    distribution = Distribution[material.distribution.upper()]
    masks = material.geometry.startswith("smith") and distribution not in tables.CLOSED_MASKING
    if not masks and distribution in tables.CLOSED_FACTOR:
        return []
    textured = isinstance(material.alpha, ScalarTexture)
    alphas = tables.row_alphas(distribution, low, high) if textured else [material.alpha]
    rows = [tables.row(distribution, alpha, material.gamma, masks) for alpha in alphas]
    offset = tables.ROW_OFFSETS.get(distribution, 0.0)
    start, end = math.log(low + offset), math.log(high + offset)
    record["rows"], record["row_texels"], record["row_offset"] = len(rows), len(rows[0]), offset
    record["row_start"], record["row_scale"] = start, (len(rows) - 1) / (end - start)
    return rows
