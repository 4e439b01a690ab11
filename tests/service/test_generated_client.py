"""A client that a generator makes from openapi.json: its types are sound, and it renders and uploads."""

from __future__ import annotations

import compileall
import importlib
import json
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from service.document import presets
from service.server.routes.examples import ASSET, BATCH, RENDER, SCENE
from tests.serving import SMALL, Server

PACKAGE = "generated_sunbox_client"
# The generator knows few types of files; these are bytes like any other.
OVERRIDES = {mime: "application/octet-stream" for mime in ("image/png", "image/apng", "application/zip")}


@pytest.fixture(scope="module")
def package(server: Server, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The generated package's folder, made without a warning."""
    folder = tmp_path_factory.mktemp("generated")
    description, config = folder / "openapi.json", folder / "config.json"
    description.write_text(server.http.get("/openapi.json").text)
    config.write_text(json.dumps({"content_type_overrides": OVERRIDES, "post_hooks": []}))
    generate = [sys.executable, "-m", "openapi_python_client", "generate", "--meta", "none", "--fail-on-warning"]
    generate += ["--path", str(description), "--config", str(config), "--output-path", str(folder / PACKAGE)]
    done = subprocess.run(generate, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / PACKAGE


@pytest.fixture
def generated(package: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """`generated("models")`: a module of the package."""
    monkeypatch.syspath_prepend(str(package.parent))

    def module(name: str) -> ModuleType:
        return importlib.import_module(f"{PACKAGE}.{name}")

    return module


@pytest.mark.slow
def test_it_compiles_and_its_types_are_sound(package: Path) -> None:
    assert compileall.compile_dir(package, quiet=1)
    check = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--cache-dir", str(package.parent / "mypy")]
    done = subprocess.run([*check, "-p", PACKAGE], cwd=package.parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_its_models_hold_every_preset(generated: Any) -> None:
    """What a program reads, changes and sends back loses nothing on its way through the types."""
    scene = generated("models").Scene
    for name in (each["name"] for each in presets.names("scenes")):
        document = json.loads(json.dumps(presets.get("scenes", name)))
        assert scene.from_dict(document).to_dict() == document, name


def test_it_renders(server: Server, generated: Any) -> None:
    models, renders = generated("models"), generated("api.renders.render")
    client = generated("client").Client(server.url)
    body = models.RenderBody(
        scene=models.Scene.from_dict(SCENE), settings=models.Settings(width=32, height=24, max_samples=4)
    )
    picture = renders.sync(client=client, body=body)
    assert picture.payload.read().startswith(b"\x89PNG")
    body.scene.camera.vfov = 200.0
    problem = renders.sync(client=client, body=body)
    assert isinstance(problem, models.Problem) and problem.errors[0].pointer == "/scene/camera/vfov"


def test_its_render_lasts(server: Server, generated: Any) -> None:
    models, client = generated("models"), generated("client").Client(server.url)
    body = models.StartRenderBody.from_dict(RENDER | {"settings": SMALL, "label": "generated"})
    status = generated("api.renders.start_render").sync(client=client, body=body, wait=60)
    assert status.state == models.RenderState.DONE and status.samples == SMALL["max_samples"]
    image = generated("api.renders.get_render_image")
    exr = image.sync(status.id, client=client, format_=models.GetRenderImageFormat.EXR)
    assert exr.payload.read(4) == b"\x76\x2f\x31\x01"
    assert generated("api.renders.delete_render").sync_detailed(status.id, client=client).status_code == 204


def test_it_uploads(server: Server, generated: Any) -> None:
    models, client = generated("models"), generated("client").Client(server.url)
    file = generated("types").File(payload=ASSET.encode())
    asset = generated("api.assets.upload_asset").sync(client=client, body=file, filename="triangle.obj")
    assert asset.kind == models.AssetKind.MESH and asset.triangles == 1
    scene = generated("api.assets.get_asset_scene").sync(asset.id, client=client)
    assert isinstance(scene, models.Scene) and isinstance(scene.shapes[0], models.FileMeshShape)
    back = generated("api.assets.download_asset").sync(asset.id, client=client)
    assert back.payload.read() == ASSET.encode()


def test_it_runs_a_batch(server: Server, generated: Any) -> None:
    models, client = generated("models"), generated("client").Client(server.url)
    body = models.StartBatchBody.from_dict(BATCH | {"settings": SMALL})
    assert isinstance(body.over[0], models.ValuesAxis)
    started = generated("api.batches.start_batch").sync(client=client, body=body)
    status = generated("api.batches.get_batch").sync(started.id, client=client, wait=60)
    assert status.state == models.BatchState.DONE and status.counts["done"] == started.renders
    sheet = generated("api.batches.get_batch_sheet").sync(started.id, client=client)
    assert sheet.payload.read().startswith(b"\x89PNG")
    generated("api.batches.delete_batch").sync_detailed(started.id, client=client)
