"""What Python and the shaders both say of a material's numbers: they must say the same."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, layout
from gpu.kernels import deltas
from gpu.layout.bindings import Slot
from gpu.layout.models import NUMBERS
from service.document.material.principled import index_of_specular, roughness_of_gloss
from tests.probing import PRINCIPLED_FLAGS, materials, prober_of


def records_of(cases: list[dict[str, Any]]) -> np.ndarray:
    out = np.zeros(len(cases), layout.Material.dtype)
    for i, case in enumerate(cases):
        out[i] = materials(model=NUMBERS["principled"])[0]
        for name, value in case.items():
            out[name][i] = value
    return out


def echoed(gpu: Renderer, records: np.ndarray) -> np.ndarray:
    """(n, 4): transmits, and 2 more where light may go straight through; only mirrors or refracts; index of
    refraction; the coat's roughness."""
    flags = PRINCIPLED_FLAGS | {"HAS_DISNEY", "HAS_THIN_WALLS", "HAS_STRAIGHT"}
    return prober_of(gpu).run("materials.comp", len(records), {Slot.MATERIALS: records}, raised=flags)[0]


def test_flags_are_raised_by_what_the_shaders_ask(gpu: Renderer) -> None:
    """Else glass between the two would meet a kernel without its lobes."""
    least = np.float32(layout.LEAST_ROUGHNESS)
    edges = {
        "model": (NUMBERS["principled"], NUMBERS["disney"]),
        "metallic": (0.0, 0.5, 1.0),
        "transmission": (0.0, 0.5, 1.0),
        "roughness": (0.0, np.nextafter(least, np.float32(0)), least, np.nextafter(least, np.float32(1))),
        "clearcoat": (0.0, 0.5),
        "sheen": (0.0, 0.5),
    }
    cases = list(itertools.product(*edges.values()))
    records = records_of([dict(zip(edges, case, strict=True)) for case in cases])
    found = echoed(gpu, records)
    assert np.array_equal(found[:, 0], deltas.transmits(records) + 2.0 * deltas.goes_straight(records))
    assert np.array_equal(found[:, 1], deltas.mirrors(records))
    assert 0 < found[:, 0].sum() < len(cases) and 0 < found[:, 1].sum() < len(cases)


def test_light_goes_straight_through_what_python_says(gpu: Renderer) -> None:
    given = np.float32(layout.TEXTURED)
    edges = {
        "transmission": (0.0, 0.5, given),
        "thin_walled": (0.0, 1.0),
        "roughness": (0.0, given, np.float32(layout.LEAST_ROUGHNESS)),
        "ior": (layout.ABSENT, 1.0, 1.5, given),
        "specular": (0.0, 0.5, given),
        "dispersion": (0.0, 0.02),
        "emission": (0.0, 1.0),
        "clearcoat_roughness": (layout.ABSENT, 0.0, given),
    }
    cases = list(itertools.product(*edges.values()))
    records = records_of([dict(zip(edges, case, strict=True)) for case in cases])
    straight = echoed(gpu, records)[:, 0] >= 2
    assert np.array_equal(straight, deltas.goes_straight(records))
    assert 0 < straight.sum() < len(cases)


def test_the_editor_shows_the_numbers_that_follow(gpu: Renderer) -> None:
    """A parameter that is not given follows from another one: what the schema says is what is rendered."""
    shares = np.linspace(0, 1, 11)
    records = records_of([{"specular": x, "clearcoat": 1, "clearcoat_gloss": x} for x in shares])
    found = echoed(gpu, records)
    assert found[:, 2] == pytest.approx([index_of_specular(x) for x in shares], rel=1e-6)
    assert found[:, 3] == pytest.approx([roughness_of_gloss(x) for x in shares], rel=1e-5)  # 0.1 - 0.099 in float32
