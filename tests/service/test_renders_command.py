"""`sunbox renders`: what it says to a server, and what it makes of the answers."""

from __future__ import annotations

import json
import re
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from service.cli.program import main
from tests.serving import ENDLESS, SCENE, SMALL, Server

OBJ = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n"
MESH = {"type": "mesh", "asset": "meshes/one.obj", "material": "ball"}
SHORT = [f"--set={name}={value}" for name, value in SMALL.items()]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A scene file with a mesh beside it."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "one.obj").write_text(OBJ)
    path = tmp_path / "scene.json"
    path.write_text(json.dumps({**SCENE, "shapes": [*SCENE["shapes"], MESH]}))
    return path


class Command:
    """`sunbox renders` with this server: its exit code, and what it printed."""

    def __init__(self, url: str, capture: pytest.CaptureFixture[str]) -> None:
        self._url, self._capture = url, capture

    def __call__(self, *arguments: object) -> tuple[int, str, str]:
        code = main(["renders", "--server", self._url, *map(str, arguments)])
        said = self._capture.readouterr()
        return code, said.out, said.err

    def submitted(self, *arguments: object) -> str:
        code, out, err = self("submit", *arguments)
        assert code == 0, err
        return out.strip()


@pytest.fixture
def command(server: Server, capsys: pytest.CaptureFixture[str]) -> Command:
    return Command(server.url, capsys)


def test_a_render_from_its_scene_to_its_picture(
    command: Command, server: Server, scene: Path, tmp_path: Path
) -> None:
    """The mesh beside the scene is uploaded, and the picture is the one that the command makes by itself."""
    id = command.submitted(scene, *SHORT, "--seed", 7, "--label", "from a shell", "--priority", 3)
    assert re.fullmatch("[0-9a-f]{32}", id)  # one that began with a hyphen would be read as an option
    assert command("wait", id)[:2] == (0, "done\n")
    code, out, _ = command("show", id)
    told = json.loads(out)
    assert code == 0 and told["label"] == "from a shell" and told["priority"] == 3
    assert told["settings"]["seed"] == 7 and told["samples"] == SMALL["max_samples"]
    assert command("fetch", id, "-o", tmp_path / "a.exr", "--aov", "all")[0] == 0
    assert main(["render", str(scene), *SHORT, "--seed", "7", "-o", str(tmp_path / "b.npy")]) == 0
    assert command("fetch", id, "-o", tmp_path / "a.npy")[0] == 0
    assert (tmp_path / "a.npy").read_bytes() == (tmp_path / "b.npy").read_bytes()
    again = command.submitted(tmp_path / "a.exr")
    assert command("wait", again)[0] == 0
    assert server.http.get(f"/v1/renders/{again}").json()["settings"] == told["settings"]


def test_lists_go_over_all_pages(command: Command, scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sunbox.async_client.PAGE", 2)
    ids = [command.submitted(scene, *SHORT, "--label", "pages") for _ in range(5)]
    for id in ids:
        command("wait", id)

    def listed(*arguments: object) -> list[str]:
        code, out, _ = command("list", *arguments)
        head, *rows = out.splitlines()
        assert code == 0 and head.split() == ["ID", "STATE", "SAMPLES", "SECONDS", "PRIO", "LABEL"]
        return [row.split()[0] for row in rows]

    assert listed("--label", "pages") == ids[::-1]
    assert listed("--label", "pages", "--limit", 3) == ids[:1:-1]
    assert listed("--label", "pages", "--state", "done") == ids[::-1]
    assert listed("--label", "pages", "--state", "failed") == []


def test_a_cancelled_render_is_not_done(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "endless.json"
    path.write_text(json.dumps(SCENE))
    id = command.submitted(path, *(f"--set={name}={value}" for name, value in ENDLESS.items()))
    assert command("cancel", id)[0] == 0
    assert command("wait", id)[:2] == (1, "cancelled\n")
    code, _, err = command("cancel", id)
    assert code == 0 and "cancelled already" in err and command("show", id)[0] == 0  # it stays
    assert command("delete", id)[0] == 0
    code, _, err = command("show", id)
    assert code == 2 and "Gone" in err
    under_way = command.submitted(path, *(f"--set={name}={value}" for name, value in ENDLESS.items()))
    assert command("delete", under_way)[0] == 0 and command("show", under_way)[0] == 2


def test_the_same_name_is_the_same_render(command: Command, scene: Path) -> None:
    named = "--idempotency-key", f"shell {scene}"
    id = command.submitted(scene, *SHORT, *named)
    assert command.submitted(scene, *SHORT, *named) == id
    code, _, err = command("submit", scene, *SHORT, "--seed", 8, *named)
    assert code == 2 and "Not possible in this state" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["submit", "SCENE", "--set", "width=0"], "/width"),
        (["submit", "SCENE", "--label", "x" * 201], "/label"),
        (["submit", "SCENE", "--priority", "11"], "/priority"),
        (["submit", "nowhere.json"], "nowhere.json"),
        (["submit", "MESH"], "sunbox import"),
        (["list", "--state", "ended"], "/state"),
        (["show", "x" * 22], "Not found"),
        (["wait", "../info"], "Not Found"),
        (["fetch", "x" * 22, "-o", "a.jpeg"], ".png"),
        (["cancel", "x" * 22], "Not found"),
    ],
)
def test_mistakes(command: Command, scene: Path, arguments: list[str], said: str) -> None:
    given = {"SCENE": str(scene), "MESH": str(scene.parent / "meshes" / "one.obj")}
    code, out, err = command(*(given.get(each, each) for each in arguments))
    assert code == 2 and out == "" and said in err, err


def test_a_mesh_that_is_not_there_is_named(command: Command, scene: Path) -> None:
    (scene.parent / "meshes" / "one.obj").unlink()
    code, _, err = command("submit", scene)
    assert code == 2 and "meshes/one.obj" in err


def test_what_is_no_server(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["renders", "--server", "sunbox.example", "list"]) == 2
    assert "--server 'sunbox.example'" in capsys.readouterr().err
    assert main(["renders", "--server", "http://127.0.0.1:1", "list"]) == 1
    assert "127.0.0.1:1: " in capsys.readouterr().err


def test_the_first_key_is_sent(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """To the server of SUNBOX_HOST and SUNBOX_PORT."""
    heard: list[tuple[str, str | None]] = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            heard.append((self.path, self.headers["authorization"]))
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"[]")

        def log_message(self, *_: Any) -> None: ...

    with HTTPServer(("127.0.0.1", 0), Handler) as listens:
        threading.Thread(target=listens.handle_request).start()
        monkeypatch.setenv("SUNBOX_HOST", "0.0.0.0")
        monkeypatch.setenv("SUNBOX_PORT", str(listens.server_port))
        monkeypatch.setenv("SUNBOX_API_KEY", "anna,bert")
        assert main(["renders", "list", "--limit", "7"]) == 0
    assert heard == [("/v1/renders?limit=7", "Bearer anna")]
    capsys.readouterr()
