"""Very many nodes: read in time, and where they stand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from service.formats.errors import ParseError
from service.formats.read.gltf.importer import read_scene
from service.formats.types import AssetLimits
from tests.counting import python_lines
from tests.gltf_files import Gltf

LIMITS = AssetLimits()


def many(count: int) -> Gltf:
    """Nodes with one mesh, each with a place, a turn and a scale."""
    file = Gltf()
    mesh = file.mesh()
    for k in range(count):
        file.node(mesh=mesh, translation=[k, 0, 0], rotation=[0, 0, 0, 1], scale=[0.5, 0.5, 0.5], name=f"node {k}")
    return file


def test_each_of_very_many_nodes_costs_the_same_and_little() -> None:
    """About 270 lines of Python, the libraries' included. With numpy for each node it were 460, and several times as
    long."""

    def read(count: int) -> int:
        data, shapes = many(count).glb(), list[Any]()
        lines = python_lines(lambda: shapes.extend(read_scene(data, LIMITS).document["shapes"]))
        assert len(shapes) == count and shapes[7]["transform"]["matrix"][:4] == [0.5, 0, 0, 7]
        return lines

    few, more, most = map(read, (1000, 2000, 4000))
    assert most - more == pytest.approx(2 * (more - few), rel=0.01)
    assert (most - more) / 2000 < 360


def test_a_long_chain() -> None:
    file = Gltf()
    file.node(mesh=file.mesh())
    file.node(False, mesh=0, translation=[0, 0, 1])
    for k in range(20_000):
        file.node(False, children=[k + 1], translation=[1, 0, 0])
    file.tree["scenes"][0]["nodes"].append(20_001)
    (_, last) = read_scene(file.glb(), LIMITS).document["shapes"]
    assert np.reshape(last["transform"]["matrix"], (4, 4))[:3, 3].tolist() == [20_000, 0, 1]


def test_more_shapes_than_a_document_holds() -> None:
    file = Gltf()
    file.node(mesh=file.mesh(*(file.primitive() for _ in range(11))))
    for _ in range(10_000):
        file.node(mesh=0)
    with pytest.raises(ParseError, match="more than the 100000 primitives allowed"):
        read_scene(file.glb(), LIMITS)


def test_shapes_have_the_names_of_their_nodes() -> None:
    """Paths: parts of a mesh by their materials, siblings of one name by numbers, what has none by its mesh."""
    file = Gltf()
    red, blue = (file.add("materials", {"name": name}) for name in ("red", "blue"))
    body = file.mesh(file.primitive(material=red), file.primitive(material=blue), name="body mesh")
    wheel = file.mesh(file.primitive(material=red), name="wheel mesh")
    left = file.node(False, name="Wheel", mesh=wheel)
    right = file.node(False, name="Wheel", mesh=wheel)
    file.node(name="Truck", mesh=body, children=[left, right])
    file.node(name="A/B", mesh=wheel)
    file.node(mesh=wheel)
    names = [shape["name"] for shape in read_scene(file.glb(), LIMITS).document["shapes"]]
    expected = ["Truck/body mesh/red", "Truck/body mesh/blue", "Truck/Wheel", "Truck/Wheel 2", "A-B", "wheel mesh"]
    assert sorted(names) == sorted(expected)
