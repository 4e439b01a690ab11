"""What meshes that share their triangles are packed as: once, with a record each."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gpu import scene_bytes
from gpu.layout import ShapeKind
from service.document import parse_scene
from service.formats import MeshData
from service.pack import PackCache, pack
from service.pack.geometry import instances
from tests.documents import MIRRORED, Few, Shelf, document, matrix_of, mesh, packed, refused, sphere
from tests.extremes.scenes import icosphere


def ball(divisions: int) -> MeshData:
    made = icosphere("m", divisions)
    return MeshData(np.array(made["vertices"]), np.array(made["faces"], np.int32), None)


SHELF = Shelf(ball=ball(3), large=ball(5), small=ball(2))


@pytest.fixture(autouse=True)
def worth(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever it spares."""
    monkeypatch.setattr(instances, "WORTH", 0)


def at(x: float, asset: str = "ball", **more: Any) -> dict[str, Any]:
    return mesh(asset=f"sha256:{asset}", transform={"translate": [x, 0, 0]}, **more)


def shared(*shapes: dict[str, Any], **more: Any) -> Any:
    return packed(*shapes, assets=SHELF, **more).arrays


@pytest.mark.parametrize(
    "shapes, standing, triangles",
    [
        ([at(0)], 0, 1280),
        ([at(0), at(3)], 2, 1280),
        ([at(0), at(3), at(6, smooth=False)], 2, 2560),
        ([at(0), at(3), at(6, smooth=False), at(9, smooth=False)], 4, 2560),
        ([at(0), at(3, material="lamp")], 0, 2560),  # lights know their triangles
        ([at(0), at(3, double_sided=False)], 0, 2560),
        ([at(0, "small"), at(3, "small")], 0, 640),
        ([at(0), at(3), at(5, "small"), sphere()], 2, 1600),
        ([at(0), at(3), mesh()], 2, 1292),  # a dozen of the scene's own, in the loop
        ([at(0), mesh(asset="sha256:ball", transform={"scale": [1, 1, 1e-12]})], 1, 2550),  # no ray gets in there
    ],
)
def test_which_meshes_share(shapes: list[dict[str, Any]], standing: int, triangles: int) -> None:
    arrays = shared(*shapes)
    assert (len(arrays.instances), len(arrays.triangles)) == (standing, triangles)
    assert (ShapeKind.INSTANCE in arrays.bvh_kinds) == (standing > 0)
    assert len(arrays.triangle_normals) == triangles


def test_few_triangles_are_not_worth_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """By what all meshes of the document would spare together."""
    monkeypatch.setattr(instances, "WORTH", 20480 + 1280)
    assert not len(shared(at(0, "large"), at(3, "large")).instances)
    assert len(shared(at(0, "large"), at(3, "large"), at(6), at(9)).instances) == 4


def test_written_out_twice_is_shared_too() -> None:
    made = icosphere("grey", 3)
    other = {**made, "vertices": (np.array(made["vertices"]) * 1.5).tolist()}
    arrays = packed(made, {**made, "transform": {"scale": 2}}, other).arrays
    assert len(arrays.instances) == 2 and len(arrays.triangles) == 2560
    assert sorted(arrays.instances["shape"]) == [0, 1]


def test_a_record_takes_the_triangles_to_their_place() -> None:
    arrays = shared(at(2), mesh(asset="sha256:ball", transform=MIRRORED, visible_to_camera=False))
    ball = SHELF.known["sha256:ball"]
    for record in arrays.instances:
        shape = int(record["shape"]) & 0xFFFF
        matrix = matrix_of(MIRRORED) if shape else matrix_of({"translate": [2, 0, 0]})
        axes = np.stack([record["axis_x"], record["axis_y"], [record[f"axis_z_{k}"] for k in "xyz"]], axis=1)
        rows = np.stack([record[f"row_{k}"] for k in "xyz"])
        np.testing.assert_allclose(rows @ axes, np.eye(3), atol=1e-6)
        own = arrays.triangles[record["first"] : record["first"] + 1280]
        found = np.concatenate([own[name] for name in ("v0", "v1", "v2")]) @ axes.T + record["center"]
        expected = ball.vertices @ matrix[:3, :3].T + matrix[:3, 3] - arrays.origin
        for axis in range(3):
            assert found[:, axis].min() == pytest.approx(expected[:, axis].min(), abs=1e-5)
            assert found[:, axis].max() == pytest.approx(expected[:, axis].max(), abs=1e-5)
        assert record["side"] == (-1 if shape else 1)
        assert (record["shape"] != shape) == (shape == 1)  # the camera looks through it


def test_a_hundred_take_the_memory_of_one() -> None:
    one, hundred = (scene_bytes(shared(*(at(3.0 * i, "large") for i in range(n)))) for n in (1, 100))
    assert hundred < 1.1 * one


def test_the_limit_counts_what_is_held() -> None:
    pair = [at(0), at(3)]
    assert len(shared(*pair, limits=Few(max_triangles=1280)).instances) == 2
    assert refused(*pair, assets=SHELF, limits=Few(max_triangles=1279)) == ["/shapes/0"]
    assert refused(*pair, at(5, "small"), assets=SHELF, limits=Few(max_triangles=1599)) == ["/shapes/2"]


def test_ids_that_32_bits_do_not_hold_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(instances, "MOST_SEEN", 3 * 2048)
    assert len(shared(at(0), at(3), at(6)).instances) == 3
    assert refused(at(0), at(3), at(6), at(9), assets=SHELF) == ["/shapes"]


def test_triangles_without_area_are_counted_for_each() -> None:
    data = ball(3)
    faces = np.concatenate([data.faces, [[0, 0, 1], [2, 2, 2]]]).astype(np.int32)
    shelf = Shelf(odd=MeshData(data.vertices, faces, None))
    found = packed(*(mesh(asset="sha256:odd", transform={"scale": 1 + i}) for i in range(2)), assets=shelf)
    assert len(found.arrays.instances) == 2 and len(found.arrays.triangles) == 1280
    told = [warning for warning in found.warnings if "degenerate" in warning]
    assert told == ["/shapes/0: 2 degenerate triangles skipped (here and in 1 more shape)"]


def test_what_moves_leaves_the_models_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    from gpu.accel import bvh

    grown = []
    build = bvh.build
    monkeypatch.setattr(bvh, "build", lambda low, *more, **k: grown.append(len(low)) or build(low, *more, **k))
    cache = PackCache()

    def trees(*shapes: dict[str, Any]) -> list[int]:
        """How many boxes are in each tree that was grown for these shapes, after those before."""
        grown.clear()
        found = pack(parse_scene(document(*shapes)), SHELF, cache)
        out = list(grown)
        fresh = pack(parse_scene(document(*shapes)), SHELF)
        for name, value in vars(found.arrays).items():
            other = getattr(fresh.arrays, name)
            assert np.array_equal(value, other) if isinstance(value, np.ndarray) else value == other, name
        assert found.warnings == fresh.warnings
        return out

    assert trees(at(0), at(3)) == [1280, 2]
    assert trees(at(0), at(5)) == [2]
    before, after = (pack(parse_scene(document(at(0), at(x))), SHELF, cache).arrays for x in (3, 6))
    assert after.triangles is before.triangles and after.instance_nodes is before.instance_nodes
    assert np.array_equal(before.instances != after.instances, [False, True])
    assert trees(at(0), at(5), sphere()) == []
    assert trees(at(0), at(5), at(8), sphere()) == [3]
    assert trees(at(0), at(5), at(0, "large"), at(8, "large")) == [20480, 4]
    assert trees(at(5), at(0, "large"), at(8, "large")) == [1282]
