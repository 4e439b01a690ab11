"""The client sends no file that a document names outside of the document's folder, by whatever call; and what JSON
cannot say is refused with its pointer."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sunbox
from sunbox.async_stream import AsyncStream
from sunbox.live import LivePicture
from sunbox.transport import Transport

NOBODY = "http://127.0.0.1:1"
WAYS = ["../secret.obj", "{outside}/secret.obj", "link.obj", "folder/../../secret.obj", "linked/secret.obj"]
PLACES: dict[str, Callable[[str], Any]] = {
    "/shapes/0/asset": lambda path: {"shapes": [{"type": "mesh", "asset": path, "material": "a"}]},
    "/environment/asset": lambda path: {"environment": {"type": "image", "asset": path}},
    "/environment/assets/+x": lambda path: {"environment": {"type": "cube", "assets": {"+x": path}}},
    "/textures/a~1b/asset": lambda path: {"textures": {"a/b": {"type": "image", "asset": path}}},
    "/materials/a/asset": lambda path: {"materials": {"a": {"type": "measured", "asset": path}}},
}
# Every call that takes a scene, and where that stands in the request.
CALLS: dict[str, tuple[str, Callable[[sunbox.AsyncClient, Any], Any]]] = {
    "render": ("/scene", lambda client, scene: client.render(scene)),
    "submit": ("/scene", lambda client, scene: client.submit(scene)),
    "batch": ("/scene", lambda client, scene: client.batch(scene, {"/a": [1]})),
    "stream": ("/scene", lambda client, scene: client.stream(scene).__aenter__()),
    "export": ("/scene", lambda client, scene: client.export(scene)),
    "compare": ("/a/scene", lambda client, scene: client.compare(scene, {})),
    "save": ("", lambda client, scene: client.save("scenes", "a", scene)),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The document's, with a file beside it, and links that lead out of it."""
    inside = tmp_path / "inside"
    (inside / "folder").mkdir(parents=True)
    (tmp_path / "secret.obj").write_text("secret")
    (inside / "own.obj").write_text("own")
    (inside / "link.obj").symlink_to(tmp_path / "secret.obj")
    (inside / "linked").symlink_to(tmp_path)
    monkeypatch.chdir(inside)
    return inside


@pytest.fixture
def sent(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """The files that are sent."""
    paths = list[Path]()

    async def upload_file(transport: Transport, path: Path) -> str:
        paths.append(path)
        return "sha256:" + "0" * 64

    monkeypatch.setattr(Transport, "upload_file", upload_file)
    return paths


def asked(call: str, scenes: Iterable[Any], **options: Any) -> list[sunbox.SunboxError]:
    """What a call ends with for each of these scenes, at a server that is not there."""
    errors = []

    async def run() -> None:
        async with sunbox.AsyncClient(NOBODY, patience=0, **options) as client:
            for scene in scenes:
                with pytest.raises(sunbox.SunboxError) as error:
                    await CALLS[call][1](client, scene)
                errors.append(error.value)

    asyncio.run(run())
    return errors


@pytest.mark.parametrize("call", CALLS)
def test_no_call_sends_a_file_from_outside(call: str, folder: Path, sent: list[Path]) -> None:
    scenes, pointers = list[Any](), list[str]()
    for way in WAYS:
        for pointer, document in PLACES.items():
            scene, file = document(way.format(outside=folder.parent)), folder / f"{len(scenes)}.json"
            file.write_text(json.dumps(scene))
            scenes += [scene, file.name, file]
            pointers += [CALLS[call][0] + pointer] * 3
    for error, pointer, scene in zip(asked(call, scenes), pointers, scenes, strict=True):
        assert isinstance(error, sunbox.Refused) and error.pointer == pointer and "asset_root" in str(error), scene
    assert sent == []


@pytest.mark.parametrize("call", CALLS)
def test_files_of_the_folder_and_of_asset_roots_are_sent(call: str, folder: Path, sent: list[Path]) -> None:
    document = PLACES["/shapes/0/asset"]
    errors = asked(call, [document(name) for name in ("own.obj", "folder/../own.obj", str(folder / "own.obj"))])
    assert all(isinstance(error, sunbox.Unreachable) for error in errors)
    assert sent == [folder / "own.obj"] * 3
    sent.clear()
    scenes = [document(way.format(outside=folder.parent)) for way in (*WAYS, "secret.obj")]
    for root in (folder.parent, [os.fspath(folder.parent)]):
        assert all(isinstance(error, sunbox.Unreachable) for error in asked(call, scenes, asset_root=root))
    assert set(sent) == {folder.parent / "secret.obj"}


def test_edits_send_no_file_from_outside(folder: Path, sent: list[Path]) -> None:
    async def run() -> None:
        transport = Transport(NOBODY, None, patience=0)
        scene = PLACES["/shapes/0/asset"]("../secret.obj")
        stream = AsyncStream(transport, {}, "png", {})
        for edit in (stream.update(scene), LivePicture(transport, scene, None, "png", {}).begin()):  # type: ignore[arg-type]
            with pytest.raises(sunbox.Refused, match="asset_root"):
                await edit
        await transport.close()

    asyncio.run(run())
    assert sent == []


@pytest.mark.parametrize("call", CALLS)
def test_what_json_cannot_say_is_refused_with_its_pointer(call: str) -> None:
    for number in (float("nan"), float("-inf"), np.float32("nan")):
        values = {"": number, "/1": [0.5, number, 1], "/1/0": np.array([[0, 1], [number, 1]])}
        errors = asked(call, [{"materials": {"a": {"roughness": value}}} for value in values.values()])
        for error, steps in zip(errors, values, strict=True):
            assert isinstance(error, sunbox.Refused) and "finite" in str(error)
            assert error.pointer == f"{CALLS[call][0]}/materials/a/roughness{steps}"


def test_settings_and_file_names_are_refused_with_their_place() -> None:
    async def run() -> None:
        async with sunbox.AsyncClient(NOBODY, patience=0) as client:
            with pytest.raises(sunbox.Refused) as refused:
                await client.submit({}, clamp=float("inf"))
            assert refused.value.pointer == "/settings/clamp"
            status = {"samples": 1, "noise": None, "warnings": [], "settings": {}}
            picture = sunbox.AsyncPicture(None, status)  # type: ignore[arg-type]
            for save in (picture.save("a.tiff"), client.batch_of("a").save_sheet("a.gif")):
                with pytest.raises(sunbox.Refused, match=r"must end in one of \.png") as refused:
                    await save
                assert refused.value.pointer == "/path"

    asyncio.run(run())
