"""Documents with `microfacet`: what is refused and where, and what becomes of the rest."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from gpu.layout.microfacet_records import TERMS, Microfacet
from gpu.tables.microfacet import INTERVALS, ROWS
from service.document import parse_scene
from service.document.material.microfacet import ALPHA_RANGES, GAMMA_RANGES
from service.pack import pack, pack_materials, pack_microfacets
from service.problems import InvalidDocument
from tests.documents import Shelf

Doc = dict[str, Any]
CAMERA = {"position": [0, 0, 1], "target": [0, 0, 0]}


def scene(*materials: Doc, **more: Any) -> Doc:
    named = {f"m{i}": {"type": "microfacet", **material} for i, material in enumerate(materials)}
    return {"version": 1, "camera": CAMERA, "materials": named, "shapes": [], **more}


REFUSED: list[tuple[Doc, str, str]] = [
    *[({"distribution": d, "alpha": high * 1.01}, "/alpha", "must be") for d, (_, high) in ALPHA_RANGES.items()],
    *[
        ({"distribution": name, "alpha": low * 0.99}, "/alpha", name)
        for name, (low, _) in ALPHA_RANGES.items()
        if low
    ],
    *[
        ({"distribution": name, "gamma": high * 1.01}, "/gamma", f"{high:g}")
        for name, (_, high) in GAMMA_RANGES.items()
    ],
    ({"gamma": 1001}, "/gamma", "1000"),
    ({"distribution": "gtr", "gamma": 0.05}, "/gamma", "0.1"),
    *[({"distribution": name, "geometry": "schlick_ggx"}, "/geometry", name) for name in ("phong", "abc", "sgd")],
    ({"fresnel": "conductor", "conductor_k": 1}, "/conductor_eta", "required"),
    ({"fresnel": "conductor", "conductor_eta": 1}, "/conductor_k", "required"),
    ({"conductor_eta": [1, 0, 1]}, "/conductor_eta", "y"),
    ({"conductor_k": -1}, "/conductor_k", "between"),
    ({"ior": 4.1}, "/ior", "4"),
    ({"alpha_cutoff": 0.5}, "/alpha_cutoff", "opacity"),
    ({"gamma": {"texture": "t"}}, "/gamma", "number"),
    ({"distribution": "blinn"}, "/distribution", "phong"),
]


@pytest.mark.parametrize(("material", "pointer", "word"), REFUSED, ids=lambda case: json.dumps(case))
def test_what_is_refused_says_where_and_what_would_be_right(material: Doc, pointer: str, word: str) -> None:
    with pytest.raises(InvalidDocument) as caught:
        parse_scene(scene(material, textures={"t": {"type": "checker", "a": 0, "b": 1}}))
    (error,) = caught.value.errors
    assert error.pointer == f"/materials/m0{pointer}" and word in error.detail


def records(document: Doc) -> tuple[np.ndarray, np.ndarray]:
    """The materials' records, and all texels as floats."""
    words = pack_microfacets(parse_scene(document))
    count = len(document["materials"])
    return words[: count * Microfacet.words // 4].reshape(-1).view(Microfacet.dtype), words.view(np.float32)


def test_terms_and_parameters_are_in_the_record() -> None:
    for kind, terms in TERMS.items():
        for term in terms:
            chosen = {kind: term.name.lower(), "conductor_eta": [0.2, 0.4, 1.4], "conductor_k": 2, "gamma": 1.5}
            (record,), _ = records(scene({**chosen, "diffuse_roughness": 0.3}))
            assert record[kind] == term and record["gamma"] == 1.5
            assert record["diffuse_roughness"] == np.float32(0.3)
            assert record["conductor_eta"].tolist() == np.float32([0.2, 0.4, 1.4]).tolist()
            assert record["conductor_k"].tolist() == [2, 2, 2]


def test_tables_are_only_where_no_closed_form_is() -> None:
    for distribution, geometry, texels in (
        ("ggx", "smith", 0), ("beckmann", "smith_correlated", 0), ("phong", "kelemen", 0), ("gtr", "implicit", 0),
        ("phong", "smith", 1 + INTERVALS), ("gtr", "smith", 1 + INTERVALS), ("abc", "implicit", 1),
        ("gaussian", "smith_correlated", 1 + INTERVALS),
    ):  # fmt: skip
        (record,), all_texels = records(scene({"distribution": distribution, "geometry": geometry}))
        assert record["row_texels"] == texels and len(all_texels) == Microfacet.words // 4 + texels


def test_materials_find_their_records_and_tables() -> None:
    document = scene({"distribution": "abc", "alpha": 50}, {}, {"distribution": "abc", "alpha": 50})
    document["materials"]["m1"] = {"type": "diffuse", "albedo": 0.5}
    packed, texels = records(document)
    assert pack_materials(parse_scene(document))["number"].tolist() == [0, 1, 2]
    first, _, last = (int(record["table"]) for record in packed)
    assert last == first + 1 + INTERVALS
    assert np.array_equal(texels[first:last], texels[last:]) and len(texels) == last + 1 + INTERVALS


def test_a_textured_alpha_gets_a_table_of_its_range_and_warnings_by_it() -> None:
    textures = {"t": {"type": "checker", "a": 0.001, "b": 0.5}}
    document = scene({"distribution": "gaussian", "alpha": {"texture": "t"}}, textures=textures)
    (record,), _ = records(document)
    assert record["rows"] == ROWS
    assert (record["alpha_low"], record["alpha_high"]) == tuple(np.float32(ALPHA_RANGES["gaussian"]))
    (warning,) = pack(parse_scene(document), Shelf()).warnings
    assert "/materials/m0/alpha" in warning and "0.01..2" in warning


def test_no_words_without_such_a_material() -> None:
    document = scene()
    document["materials"]["m"] = {"type": "diffuse", "albedo": 0.5}
    assert pack_microfacets(parse_scene(document)).shape == (0, 4)
