"""A glTF file in a pose: an animation at a time, a variant of its materials."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from service.cli.program import main
from service.formats.types import Pose
from service.problems import AssetError, NotFound
from service.server.assets import AssetStore
from service.server.assets.posing import posed_scene
from tests.gltf_files import QUAD, QUAD_FACES, Gltf
from tests.service.formats.scenes import corners, imported
from tests.serving import Server

CORNERS = QUAD_FACES.reshape(-1, 3)


def posed(store: AssetStore, file: Gltf, time: float, name: str = "move") -> list[dict[str, Any]]:
    shapes: list[dict[str, Any]] = posed_scene(
        store, store.add(file.glb()).id, Pose(animation=name, time=time)
    ).document["shapes"]
    return shapes


def matrix(store: AssetStore, file: Gltf, time: float) -> np.ndarray:
    (shape,) = posed(store, file, time)
    return np.reshape(shape.get("transform", {"matrix": np.eye(4)})["matrix"], (4, 4))


def moving(path: str, how: str, times: list[float], values: Any) -> Gltf:
    file = Gltf()
    node = file.node(mesh=file.mesh(), translation=[0, 0, 7])
    file.animation("move", (node, path, how, times, values))
    return file


@pytest.mark.parametrize(
    ("how", "values", "expected"),
    [
        ("LINEAR", [[2, 0, 0], [4, 0, 0], [4, 8, 0]], {-1: 2, 1: 2, 2: 3, 3: 4, 9: 4}),
        ("STEP", [[2, 0, 0], [4, 0, 0], [4, 8, 0]], {0: 2, 2.9: 2, 3: 4}),
        # Hermite from 2 to 4 with slopes of 1 and 0 over 2 s: at half time (2 + 4) / 2 + 2 (1 - 0) / 8.
        ("CUBICSPLINE", [[9, 0, 0], [2, 0, 0], [1, 0, 0], [0, 0, 0], [4, 0, 0], [9, 9, 9], [0, 0, 0], [4, 8, 0],
                         [9, 9, 9]], {0: 2, 1: 2, 2: 3.25, 3: 4, 5: 4}),
    ],
)  # fmt: skip
def test_a_node_is_where_its_animation_has_it(
    store: AssetStore, how: str, values: Any, expected: dict[float, float]
) -> None:
    """Keys at 1, 3 and 4 s; before the first and after the last it stands still."""
    file = moving("translation", how, [1, 3, 4], values)
    found = {time: matrix(store, file, time)[0, 3] for time in expected}
    assert found == pytest.approx(expected)
    assert imported(store, file).document["shapes"][0]["transform"]["matrix"][11] == 7, "at rest as it was saved"


def test_rotations_turn_at_constant_speed_the_shorter_way(store: AssetStore) -> None:
    keys = Rotation.from_euler("yxz", [[0, 0, 0], [150, 20, 0]], degrees=True)
    quaternions = keys.as_quat() * [[1], [-1]]  # the same rotation, on the far side of the sphere
    file = moving("rotation", "LINEAR", [0, 2], quaternions)
    for time in (0, 0.6, 1.4, 2):
        expected = Slerp([0, 2], keys)(time).as_matrix()
        assert np.allclose(matrix(store, file, time)[:3, :3], expected, atol=1e-6)


def test_skins_and_morph_targets_are_posed(store: AssetStore) -> None:
    """At half time: two vertices follow the joint by half of 6, and the target counts 0.25, not its 1 at rest."""
    file = Gltf()
    joints = [file.node(), file.node()]
    shares = np.array([[1, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0]], "<f4")
    target = {"POSITION": file.accessor(np.tile(np.array([0, 4, 0], "<f4"), (4, 1)))}
    rows = {"POSITION": QUAD, "JOINTS_0": np.tile(np.array([0, 1, 0, 0], np.uint8), (4, 1)), "WEIGHTS_0": shares}
    mesh = file.mesh(file.primitive(rows, targets=[target]), weights=[1.0])
    node = file.node(mesh=mesh, skin=file.add("skins", {"joints": joints}))
    file.animation(
        "move", (joints[1], "translation", "LINEAR", [0, 1], [[0, 0, 0], [0, 0, 6]]),
        (node, "weights", "LINEAR", [0, 1], [0, 0.5]),
    )  # fmt: skip
    (shape,) = posed(store, file, 0.5)
    expected = QUAD + np.array([[0, 1, 0], [0, 1, 0], [0, 1, 3], [0, 1, 3]])
    assert np.allclose(corners(store, shape), expected[CORNERS])
    (shape,) = imported(store, file).document["shapes"]
    assert np.allclose(corners(store, shape), (QUAD + np.array([0, 4, 0]))[CORNERS])


def test_keys_may_be_sparse_and_normalised(store: AssetStore) -> None:
    """A key that is replaced, and rotations as 16-bit fractions."""
    file = Gltf()
    node = file.node(mesh=file.mesh())
    turn = file.accessor(np.array([[0, 0, 0, 32767], [0, 0, 32767, 0]], np.int16), normalized=True)
    times = file.accessor(np.array([0, 1], "<f4"))
    index = {"bufferView": file.view(b"\1"), "componentType": 5121}
    late = {"count": 1, "indices": index, "values": {"bufferView": file.view(np.array([4], "<f4").tobytes())}}
    file.tree["accessors"][times]["sparse"] = late
    channel = {"sampler": 0, "target": {"node": node, "path": "rotation"}}
    file.add("animations", {"samplers": [{"input": times, "output": turn}], "channels": [channel]})
    (shape,) = posed(store, file, 2, "Animation 1")
    assert np.allclose(np.reshape(shape["transform"]["matrix"], (4, 4))[:2, :2], [[0, -1], [1, 0]], atol=1e-6)
    assert imported(store, file).animations == [{"name": "Animation 1", "duration": 4.0}]


def test_a_variant_has_its_materials(store: AssetStore) -> None:
    """What it does not name stays; of two variants of one name the second is numbered."""
    file = Gltf()
    for name in ("plain", "red", "blue"):
        file.add("materials", {"name": name})
    mappings = [{"material": 1, "variants": [0]}, {"material": 2, "variants": [1]}]
    primitive = file.primitive(material=0, extensions={"KHR_materials_variants": {"mappings": mappings}})
    file.node(mesh=file.mesh(primitive))
    file.node(mesh=file.mesh(file.primitive(material=0)))
    file.tree["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "x"}, {"name": "x"}]}}
    found = imported(store, file)
    assert found.variants == ["x", "x 2"] and [s["material"] for s in found.document["shapes"]] == ["plain"] * 2
    id = store.add(file.glb()).id
    for variant, material in (("x", "red"), ("x 2", "blue")):
        document = posed_scene(store, id, Pose(variant)).document
        assert [shape["material"] for shape in document["shapes"]] == [material, "plain"]
        assert document["materials"].keys() == {material, "plain"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda tree: tree["accessors"][3].update(count=1),
            "/animations/0/samplers/0/output: has 6 numbers for 1 keys of 3",
        ),
        (lambda tree: tree["animations"][0]["samplers"][0].update(interpolation="CUBIC"), "must be LINEAR, STEP or"),
        (lambda tree: tree["animations"][0]["channels"][0]["target"].update(path="colour"), "must be one of transl"),
        (lambda tree: tree["animations"][0]["channels"][0].update(sampler=3), "refers to sampler 3 of 1"),
        (
            lambda tree: tree["nodes"][0].update(matrix=[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            "must not be",
        ),
        (lambda tree: tree["animations"][0]["channels"][0]["target"].update(path="weights"), "no morph targets"),
    ],
)
def test_what_is_wrong_with_an_animation_is_told_where_it_is_played(
    store: AssetStore, change: Any, message: str
) -> None:
    """The file is read without it."""
    file = moving("translation", "LINEAR", [0, 1], [[0, 0, 0], [1, 1, 1]])
    change(file.tree)
    with pytest.raises(AssetError) as refusal:
        posed(store, file, 0.5)
    assert message in str(refusal.value)


def test_times_that_do_not_rise_are_refused(store: AssetStore) -> None:
    with pytest.raises(AssetError, match="/animations/0/samplers/0/input: must be finite times"):
        posed(store, moving("translation", "LINEAR", [0, 2, 1], np.zeros((3, 3))), 0.5)


def test_an_animation_that_cannot_be_read_is_not_listed(store: AssetStore) -> None:
    file = moving("translation", "LINEAR", [0, 1], [[0, 0, 0], [1, 1, 1]])
    file.tree["animations"][0]["samplers"][0]["input"] = 99
    found = imported(store, file)
    assert not found.animations and found.warnings[0]["pointer"] == "/animations/0/samplers/0/input"
    with pytest.raises(NotFound, match="the file has no animations"):
        posed(store, file, 0)


def test_over_rest(server: Server) -> None:
    http: httpx.Client = server.http
    file = moving("translation", "LINEAR", [0, 2], [[0, 0, 0], [6, 0, 0]])
    info = http.post("/v1/assets", content=file.glb()).json()
    assert info["animations"] == [{"name": "move", "duration": 2.0}] and "variants" not in info
    url = f"/v1/assets/{info['id']}"
    assert http.get(url, headers={"accept": "application/json"}).json() == info
    assert http.get(url, headers={"accept": "application/json, */*"}).content == file.glb()
    posed = http.get(f"{url}/scene?animation=move&time=0.5")
    shape = posed.json()["shapes"][0]
    assert shape["transform"]["matrix"][3] == 1.5
    assert json.loads(posed.headers["sunbox-bounds"]) == [[0.5, -1, 0], [2.5, 1, 0]]
    for query, status, pointer, told in (
        ("animation=walk", 404, "/animation", "it has 'move'"),
        ("variant=red", 404, "/variant", "the file has no variants"),
        ("time=1", 422, "/time", "animation"),
        ("animation=move&time=nan", 422, "/time", "finite"),
        ("animations=move", 422, "/animations", ""),
    ):
        answer = http.get(f"{url}/scene?{query}")
        (error,) = answer.json()["errors"]
        assert (answer.status_code, error["pointer"]) == (status, pointer) and told in error["detail"]


def test_on_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_DATA_DIR", str(tmp_path / "data"))
    model, document = tmp_path / "m.glb", tmp_path / "s.json"
    model.write_bytes(moving("translation", "LINEAR", [0, 2], [[0, 0, 0], [6, 0, 0]]).glb())
    assert main(["import", str(model), "-o", str(document), "--animation", "move", "--time", "1"]) == 0
    assert json.loads(document.read_text())["shapes"][0]["transform"]["matrix"][3] == 3
    assert "note" not in capsys.readouterr().err
    document.unlink()
    assert main(["import", str(model), "-o", str(document), "--animation", "walk"]) == 2
    assert "'move'" in capsys.readouterr().err and not document.exists()
    assert main(["import", str(model), "-o", str(document), "--time", "1"]) == 2
    assert main(["import", str(model), "-o", str(document)]) == 0
    assert "move (2 s)" in capsys.readouterr().err
