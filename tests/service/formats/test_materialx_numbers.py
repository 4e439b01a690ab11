"""Numbers as MaterialX files write them."""

from __future__ import annotations

import pytest

from service.server.assets import AssetStore
from tests.mtlx_files import from_graph, graph, material, mtlx, node, surface, taken, value, wire

pytest.importorskip("MaterialX")

PARTED = [", ", ",", " ", "  ", " , ", "\t", "\n"]
NUMBERS = {
    "color3": ([0.5, 0.25, 0.125], "extract"), "color4": ([0.5, 0.25, 0.125, 1], "extract"),
    "vector2": ([0.5, 0.25], "extract"), "vector3": ([0.5, 0.25, 0.125], "extract"),
    "vector4": ([0.5, 0.25, 0.125, 1], "extract"), "matrix33": ([0.5, 0, 0, 0, 1, 0, 0, 0, 1], "transformmatrix"),
    "matrix44": ([0.5, *[0] * 4, 1, *[0] * 4, 1, *[0] * 4, 1], "transformmatrix"),
}  # fmt: skip


@pytest.mark.parametrize("type", NUMBERS)
def test_numbers_are_parted_by_commas_blanks_or_both(store: AssetStore, type: str) -> None:
    """Each number of every type, as the library reads them: through a node that makes a roughness of the first."""
    numbers, kind = NUMBERS[type]
    for parted in PARTED:
        text = f" {parted.join(map(str, numbers))} "
        nodes = {
            "extract": [node("extract", "x", "float", value("in", text, type), value("index", 0, "integer"))],
            "transformmatrix": [
                node("transformmatrix", "t", "vector3", value("in", "1 1 1", "vector3"), value("mat", text, type)),
                node("extract", "x", "float", wire("in", "t", "vector3"), value("index", 0, "integer")),
            ],
        }[kind]
        made = graph(*nodes, rough="x float")
        shader = surface(
            "gltf_pbr", from_graph("roughness", "rough", "float"), value("base_color", "1 0.5, 0", "color3")
        )
        imported = taken(store, mtlx(made, shader))
        assert material(imported)["roughness"] == 0.5 and material(imported)["base_color"] == [1, 0.5, 0]
        assert not imported.warnings
