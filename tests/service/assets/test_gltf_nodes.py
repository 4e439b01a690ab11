"""Very many nodes: read in time, and where they stand."""

from __future__ import annotations

import json
import time

import numpy as np
import pytest

from service.assets.errors import ParseError
from service.assets.gltf.importer import read_scene
from service.assets.types import AssetLimits
from tests.gltf_files import Gltf

LIMITS = AssetLimits()


def many(count: int) -> Gltf:
    """Nodes with one mesh, each with a place, a turn and a scale."""
    file = Gltf()
    mesh = file.mesh()
    for k in range(count):
        file.node(mesh=mesh, translation=[k, 0, 0], rotation=[0, 0, 0, 1], scale=[0.5, 0.5, 0.5], name=f"node {k}")
    return file


def test_twenty_thousand_nodes_take_as_long_as_a_few_readings_of_their_text() -> None:
    """In processor time: about 10 readings. With numpy for each node it took several times as long."""
    file = many(20_000)
    data, text = file.glb(), json.dumps(file.tree)
    seconds, text_seconds = [], []
    for _ in range(3):
        began = time.process_time()
        json.loads(text)
        between = time.process_time()
        shapes = read_scene(data, LIMITS).document["shapes"]
        text_seconds.append(between - began)
        seconds.append(time.process_time() - between)
    assert min(seconds) < 20 * min(text_seconds)
    assert len(shapes) == 20_000 and shapes[7]["transform"]["matrix"][:4] == [0.5, 0, 0, 7]


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
