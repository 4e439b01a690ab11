"""The store of uploads, files beside a scene, and what is kept in memory of both."""

from __future__ import annotations

import os
import re
import struct
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from service.formats import MeshData
from service.formats.cache import ParsedCache
from service.formats.formats import sniff
from service.formats.types import AssetLimits
from service.problems import AssetError, NotFound, Unavailable, UnsupportedMedia
from service.server.assets import AssetStore, FileAssets
from tests import asset_files as make
from tests.asset_files import OBJ, TRIANGLE

PIXELS = np.random.default_rng(11).random((8, 16, 3)).astype(np.float32)
EXR = make.exr(PIXELS)
FACE = OBJ[OBJ.index(b"f") :]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AssetStore]:
    store = AssetStore(tmp_path_factory.mktemp("data"))
    yield store
    store.close()


def triangles(mesh: MeshData) -> np.ndarray:
    return mesh.vertices[mesh.faces]


@pytest.mark.parametrize(
    ("data", "content_type", "filename", "format"),
    [
        (EXR, "image/png", "x.obj", "exr"),
        (b"#?RGBE\n", None, None, "hdr"),
        (make.stl(np.zeros((1, 3, 3))), None, "x.ply", "stl"),
        (b"solid " + bytes(74) + struct.pack("<I", 1) + bytes(50), None, None, "stl"),
        (make.stl_text(np.zeros((1, 3, 3))), None, None, "stl"),
        (make.stl_text(np.zeros((1, 3, 3))).replace(b"\n", b"\r"), None, None, "stl"),
        (make.embedded(make.gltf()), "text/plain", None, "gltf"),
        (b"# made by hand\n\nmtllib a.mtl\n" + OBJ, None, None, "obj"),
        (b"# of old\r\r" + OBJ.replace(b"\n", b"\r"), None, None, "obj"),
        (b"hello", "model/gltf-binary; x=y", "x.png", "glb"),
        (b"hello", "application/octet-stream", "A.B.JPG", "jpeg"),
        (b"hello", None, None, None),
        (b"hello", "text/plain", "hello", None),
        (b" " * 70000, None, None, None),
    ],
)
def test_kind_by_bytes_then_type_then_name(
    data: bytes, content_type: str | None, filename: str | None, format: str | None
) -> None:
    assert sniff(data, content_type, filename) == format


def test_what_an_upload_is_told(store: AssetStore) -> None:
    info = store.add(OBJ)
    assert re.fullmatch("sha256:[0-9a-f]{64}", info.id)
    assert (info.kind, info.bytes, info.vertices, info.triangles, info.width) == ("mesh", len(OBJ), 3, 1, None)
    assert info.bounds == [np.min(TRIANGLE, axis=0).tolist(), np.max(TRIANGLE, axis=0).tolist()]
    info = store.add(EXR)
    assert (info.kind, info.width, info.height, info.channels, info.triangles) == ("image", 16, 8, 3, None)


def test_assets_survive_a_restart(tmp_path: Path) -> None:
    first = AssetStore(tmp_path)
    info = first.add(OBJ)
    assert first.add(OBJ, "image/png") == info
    first.close()
    second = AssetStore(tmp_path)
    assert (second.info(info.id), second.read(info.id)) == (info, OBJ)
    assert np.array_equal(triangles(second.mesh(info.id)), [TRIANGLE])
    second.close()
    assert (
        len(list((tmp_path / "assets").iterdir())) == 2
    )  # the bytes and what is known of them: nothing half-written


def test_refused_bytes_are_not_kept(tmp_path: Path) -> None:
    store = AssetStore(tmp_path)
    with pytest.raises(AssetError):
        store.add(OBJ[:-4])
    with pytest.raises(UnsupportedMedia, match="OBJ, PLY"):
        store.add(b"hello")
    with pytest.raises(AssetError, match="empty"):
        store.add(b"")
    assert not list(tmp_path.rglob("*"))
    store.close()


def test_unknown_and_wrong_references(store: AssetStore) -> None:
    unknown = "sha256:" + "0" * 64
    for ask in (store.read, store.info):
        for id in (unknown, "sha256:../../etc/passwd", "", unknown.upper()):
            with pytest.raises(NotFound):
                ask(id)
    with pytest.raises(AssetError, match="no asset"):
        store.mesh(unknown)
    with pytest.raises(AssetError, match="not the id"):
        store.image("studio.exr")
    with pytest.raises(AssetError, match="is a mesh; an image is needed"):
        store.image(store.add(OBJ).id)
    with pytest.raises(AssetError, match="is an image; a mesh is needed"):
        store.mesh(store.add(EXR).id)


def test_builtin_assets_need_no_upload(tmp_path: Path) -> None:
    calls = []

    def builtin() -> dict[str, bytes]:
        calls.append(1)
        return {"sha256:" + "a" * 64: EXR, "sha256:" + "b" * 64: OBJ}

    store = AssetStore(tmp_path, None, builtin)
    assert not calls  # generating them takes time
    assert np.array_equal(store.image("sha256:" + "a" * 64).pixels, PIXELS)
    assert store.info("sha256:" + "b" * 64).triangles == 1 and store.read("sha256:" + "b" * 64) == OBJ
    assert not list(tmp_path.rglob("*"))
    store.close()


def test_a_full_disk_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(fd: int) -> None:
        raise OSError(28, "No space left on device")

    store = AssetStore(tmp_path)
    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(Unavailable, match="No space"):
        store.add(OBJ)
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]
    store.close()


def test_what_is_kept_stays_below_its_bound() -> None:
    parsed = MeshData(np.zeros((10, 3)), np.zeros((0, 3), np.int32), None)  # 240 bytes
    loader = ParsedCache(AssetLimits(cache_bytes=500))
    calls: list[str] = []

    def parse(key: str) -> MeshData:
        calls.append(key)
        return parsed

    for key in "abacab":
        loader.load(key, partial(parse, key))
    assert calls == ["a", "b", "c", "b"]  # a was used last when c came


def test_a_large_file_stays_for_its_first_use() -> None:
    """It is larger than all that may be kept; else it would be parsed for its upload, and again for its scene."""
    small, large = (MeshData(np.zeros((size, 3)), np.zeros((0, 3), np.int32), None) for size in (10, 30))
    loader = ParsedCache(AssetLimits(cache_bytes=500))
    calls: list[str] = []

    def load(key: str, mesh: MeshData, ahead: bool = False) -> None:
        assert loader.load(key, lambda: calls.append(key) or mesh, ahead) is mesh  # type: ignore[func-returns-value]

    load("large", large, ahead=True)
    load("small", small, ahead=True)
    load("large", large, ahead=True)  # it is uploaded again
    assert loader.bytes == 720 + 240
    load("large", large)
    assert calls == ["large", "small"] and loader.bytes == 240
    load("large", large)  # nobody knows whether there will be another use
    load("small", small)
    assert calls == ["large", "small", "large"] and loader.bytes == 240
    load("large", large, ahead=True)
    loader.shrink(200)
    assert loader.bytes == 720
    loader.shrink(200)
    assert loader.bytes == 0


def test_an_uploaded_mesh_is_parsed_once_for_its_first_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = AssetStore(tmp_path)
    parsed = []
    parse = store.loader.sandbox.parse
    monkeypatch.setattr(store.loader.sandbox, "parse", lambda *given: parsed.append(1) or parse(*given))
    monkeypatch.setattr(store.loader.sandbox, "limits", replace(store.loader.sandbox.limits, cache_bytes=10))
    id = store.add(OBJ).id
    assert len(store.mesh(id).faces) == 1 and parsed == [1]
    store.close()


def test_a_file_that_many_want_is_parsed_once() -> None:
    loader = ParsedCache(AssetLimits())
    parsed = MeshData(np.zeros((1, 3)), np.zeros((1, 3), np.int32), None)
    began, go_on = threading.Event(), threading.Event()
    calls, found = [], []

    def parse() -> MeshData:
        calls.append(1)
        began.set()
        go_on.wait(5)
        return parsed

    threads = [threading.Thread(target=lambda: found.append(loader.load("k", parse))) for _ in range(4)]
    for thread in threads:
        thread.start()
    assert began.wait(5)
    time.sleep(0.05)
    go_on.set()
    for thread in threads:
        thread.join(5)
    assert calls == [1] and len(found) == 4 and all(one is parsed for one in found)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """scene/ with files in it, outside files and a link to one."""
    scene = tmp_path / "scene"
    (scene / "sub").mkdir(parents=True)
    (scene / "m.obj").write_bytes(OBJ)
    (scene / "e.exr").write_bytes(EXR)
    (scene / "notes.txt").write_bytes(b"hello")
    (scene / "empty.ply").write_bytes(b"")
    (tmp_path / "outside.obj").write_bytes(OBJ)
    (scene / "link.obj").symlink_to(tmp_path / "outside.obj")
    (scene / "inner.obj").symlink_to(scene / "m.obj")
    return scene


def test_files_beside_the_scene(folder: Path) -> None:
    with FileAssets(folder, []) as assets:
        for ref in ("m.obj", "./m.obj", "sub/../m.obj", "inner.obj"):
            assert np.array_equal(triangles(assets.mesh(ref)), [TRIANGLE])
        assert np.array_equal(assets.image("e.exr").pixels, PIXELS)


@pytest.mark.parametrize(
    ("ref", "reason"),
    [
        ("../outside.obj", "leaves the scene's folder; --asset-root"),
        ("sub/../../outside.obj", "leaves the scene's folder"),
        ("link.obj", "leaves the scene's folder"),
        ("/etc/hostname", "absolute"),
        ("t\0.png", "is not a file name"),
        ("", "is not a file name"),
        (".", "is a folder"),
        ("sub", "is a folder"),
        ("nosuch.obj", "no such file"),
        ("x" * 300, "too long"),
        ("m.obj/x", "directory|no such"),
        ("notes.txt", "is not a mesh or an image in a supported format"),
        ("empty.ply", "empty"),
        ("e.exr", "is an image; a mesh is needed"),
        ("sha256:" + "0" * 64, "no asset"),
    ],
)
def test_files_refused(folder: Path, ref: str, reason: str) -> None:
    with FileAssets(folder, []) as assets, pytest.raises(AssetError, match=reason):
        assets.mesh(ref)


def test_a_pipe_is_no_file(folder: Path) -> None:
    os.mkfifo(folder / "pipe.obj")
    with FileAssets(folder, []) as assets, pytest.raises(AssetError, match="not an ordinary file"):
        assets.mesh("pipe.obj")


def test_asset_roots_allow_more(folder: Path) -> None:
    with FileAssets(folder, [folder.parent]) as assets:
        for ref in ("../outside.obj", "link.obj", "outside.obj"):
            assert len(assets.mesh(ref).faces) == 1
        with pytest.raises(AssetError, match="leaves"):
            assets.mesh("../../outside.obj")


def test_ids_lead_to_the_store(folder: Path, store: AssetStore) -> None:
    id = store.add(OBJ).id
    with FileAssets(folder, [], store) as assets:
        assert assets.mesh(id) is store.mesh(id)
        assert len(assets.mesh("m.obj").faces) == 1
    assert len(store.mesh(id).faces) == 1  # still open


def test_a_changed_file_is_read_again(folder: Path) -> None:
    with FileAssets(folder, []) as assets:
        first = assets.mesh("m.obj")
        assert assets.mesh("m.obj") is first
        (folder / "m.obj").write_bytes(OBJ + FACE)
        assert len(assets.mesh("m.obj").faces) == 2


def test_a_file_is_taken_as_its_bytes_are(store: AssetStore) -> None:
    for data in (OBJ, EXR):
        with store.incoming() as file:
            store.receive(file, data[:7])
            store.receive(file, data[7:])
            info = store.add(file)
        assert (info.bytes, store.read(info.id)) == (len(data), data)
        assert store.add(data) == info
    with store.incoming() as file, pytest.raises(AssetError, match="empty"):
        store.add(file)
