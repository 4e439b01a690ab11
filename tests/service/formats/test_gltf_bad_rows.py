"""Scenes of glTF with triangles and attributes that can't be used: all the rest is there."""

from __future__ import annotations

import numpy as np
import pytest

from service.formats import MeshData
from service.problems import AssetError
from service.server.assets import AssetStore
from tests.gltf_files import QUAD, Gltf
from tests.service.formats.scenes import imported, noted

INDICES, POSITION = "/meshes/0/primitives/0/indices", "/meshes/0/primitives/0/attributes/POSITION"


def shown(store: AssetStore, file: Gltf) -> tuple[MeshData, dict[str, str]]:
    """The mesh of the first shape, and the warnings."""
    found = imported(store, file)
    return store.mesh(found.document["shapes"][0]["asset"]), noted(found)


@pytest.mark.parametrize(
    ("mode", "indices", "left", "told"),
    [
        (4, [0, 1, 2, 0, 1, 9, 0, 2, 3], 2, "1 triangle is left out: refer to vertex 9; there are 4"),
        (4, [0, 1, 9, 8, 1, 2, 0, 2, 3], 1, "2 triangles are left out, the first: refer to vertex 9; there are 4"),
        (5, [0, 1, 3, 2, 65535], 2, "1 triangle is left out: refer to vertex 65535; there are 4"),
        (6, [0, 1, 2, 7, 2, 3], 2, "2 triangles are left out, the first: refer to vertex 7; there are 4"),
    ],
)
def test_indices_beyond_the_vertices(store: AssetStore, mode: int, indices: list[int], left: int, told: str) -> None:
    file = Gltf()
    file.node(mesh=file.mesh(file.primitive(indices=np.array(indices, "<u2"), mode=mode)))
    mesh, notes = shown(store, file)
    assert len(mesh.faces) == left and notes[INDICES] == told
    assert len(store.mesh(store.add(file.glb()).id).faces) == left


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e10])
def test_positions(store: AssetStore, bad: float) -> None:
    """The vertices that remain are the file's; the warning has the number of the file, whose first row is unused."""
    rows = np.concatenate([[[9, 9, 9]], QUAD, [[0, bad, 0]]]).astype("<f4")
    file = Gltf()
    file.node(mesh=file.mesh(file.primitive({"POSITION": rows}, np.array([1, 2, 3, 1, 2, 5, 1, 3, 4], "<u2"))))
    mesh, notes = shown(store, file)
    assert np.allclose(mesh.vertices[mesh.faces], QUAD[[[0, 1, 2], [0, 2, 3]]])
    assert notes[POSITION].startswith(
        "1 triangle is left out: item 5 of /accessors/0 is not finite or lies beyond 1e9 m"
    )
    merged = store.mesh(store.add(file.glb()).id)
    assert len(merged.faces) == 2 and len(merged.warnings) == 1


def test_a_primitive_of_which_nothing_remains(store: AssetStore) -> None:
    """The others are shown; alone it is refused with the reason."""
    file = Gltf()
    broken = file.primitive(indices=np.array([0, 1, 9], "<u2"))
    lost = file.primitive({"POSITION": QUAD * np.float32(np.nan)})
    file.node(mesh=file.mesh(broken, lost, file.primitive()))
    mesh, notes = shown(store, file)
    assert len(mesh.faces) == 2 and "refer to vertex 9" in notes[INDICES]
    assert "2 triangles are left out" in notes["/meshes/0/primitives/1/attributes/POSITION"]
    alone = Gltf()
    alone.node(mesh=alone.mesh(alone.primitive(indices=np.array([0, 1, 9], "<u2"))))
    with pytest.raises(AssetError, match="no triangles: 1 triangle is left out: refer to vertex 9; there are 4"):
        store.add(alone.glb())


@pytest.mark.parametrize("weight", [1.0, 0.5])
def test_morph_targets(store: AssetStore, weight: float) -> None:
    offsets = np.zeros((4, 3), "<f4")
    offsets[3] = np.nan
    file = Gltf()
    file.node(mesh=file.mesh(file.primitive(targets=[{"POSITION": file.accessor(offsets)}]), weights=[weight]))
    mesh, notes = shown(store, file)
    assert len(mesh.faces) == 1 and notes[POSITION].startswith("1 triangle is left out: item 3")
