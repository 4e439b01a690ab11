"""Exports over HTTP and on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from service.cli.program import main
from sunbox import Client
from tests.calls import is_problem
from tests.serving import Server

QUAD: dict[str, Any] = {
    "type": "mesh",
    "vertices": [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]],
    "faces": [[0, 1, 2], [0, 2, 3]],
    "material": "m",
}
SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
    "lights": [{"type": "point", "position": [1, 2, 3], "intensity": 30}],
    "materials": {"m": {"type": "principled"}},
    "shapes": [QUAD],
}
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "m"}


def test_a_scene_is_answered_as_a_file_with_what_is_lost(server: Server) -> None:
    answer = server.http.post("/v1/export", json={"scene": SCENE, "format": "glb"})
    assert answer.status_code == 200 and answer.content[:4] == b"glTF"
    assert answer.headers["content-type"] == "model/gltf-binary" and answer.headers["sunbox-lost"] == "[]"
    lossy = server.http.post("/v1/export", json={"scene": {**SCENE, "shapes": [QUAD, BALL]}, "format": "glb"})
    (loss,) = json.loads(lossy.headers["sunbox-lost"])
    assert loss["pointer"] == "/scene/shapes/1" and "triangles" in loss["detail"]


def test_mistakes_are_named(server: Server) -> None:
    ask = {"scene": {**SCENE, "version": 2}, "format": "step"}
    assert is_problem(server.http.post("/v1/export", json=ask), 422, "/scene/version", "/format")
    away = {**QUAD, "asset": "sha256:" + "0" * 64}
    for name in ("vertices", "faces"):
        del away[name]
    missing = server.http.post("/v1/export", json={"scene": {**SCENE, "shapes": [away]}, "format": "glb"})
    assert is_problem(missing, 422, "/scene/shapes/0/asset")


def test_a_saved_material_is_answered_on_a_ball(server: Server) -> None:
    path = "/v1/documents/materials/export me"
    material = {"type": "principled", "base_color": [0.5, 0.25, 1], "subsurface": 0.5}
    assert server.http.put(path, json=material).status_code == 201
    answer = server.http.get(path, params={"format": "gltf"})
    tree = answer.json()
    assert answer.headers["content-type"] == "model/gltf+json"
    assert tree["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] == [0.5, 0.25, 1, 1]
    assert [each["pointer"] for each in json.loads(answer.headers["sunbox-lost"])] == ["/subsurface"]
    assert is_problem(server.http.get(path, params={"format": "glb"}), 422, "/format")
    assert server.http.post("/v1/assets", content=answer.content).json()["kind"] == "scene"
    server.http.delete(path)


def test_the_client_exports(server: Server) -> None:
    with Client(server.url) as client:
        made = client.export({**SCENE, "shapes": [BALL]})
    assert made.data[:4] == b"glTF" and [each["pointer"] for each in made.lost] == ["/scene/shapes/0"]


def test_the_command_line_exports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target = tmp_path / "scene.json", tmp_path / "scene.glb"
    source.write_text(json.dumps({**SCENE, "shapes": [BALL]}))
    assert main(["export", str(source), "-o", str(target)]) == 0
    assert target.read_bytes()[:4] == b"glTF" and "lost: /shapes/0: the sphere" in capsys.readouterr().err
    assert main(["export", str(source), "-o", str(tmp_path / "scene.step")]) == 2
    assert ".glb" in capsys.readouterr().err and not (tmp_path / "scene.step").exists()
