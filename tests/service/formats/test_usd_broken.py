"""USD files of strangers: nothing outside of them is opened, and what is broken costs a child at most."""

from __future__ import annotations

import importlib.util
import random
import zipfile
from pathlib import Path

import numpy as np
import pytest

from service.formats.cache import refused
from service.formats.errors import MissingExtra, ParseError
from service.formats.read.zips import importer as zips
from service.formats.sandbox import readers
from service.formats.types import AssetLimits
from service.problems import ANSWERS, AssetError, NotProvided
from service.server.assets import AssetStore
from tests.parsing import one_child
from tests.usd_files import PNG, material, mesh, texture, usda, usdc, usdz

MUTANTS = 40


@pytest.mark.usd
def test_nothing_outside_of_the_upload_is_opened(store: AssetStore, tmp_path: Path) -> None:
    """Files that are there, by absolute and relative paths, as layers, payloads, sublayers and images."""
    (tmp_path / "secret.usda").write_bytes(usda(f'def Xform "Secret"\n{{\n{mesh("Inside")}\n}}'))
    (tmp_path / "secret.usda").chmod(0o644)
    outside = f"{tmp_path}/secret.usda"
    climbing = "../" * 20 + outside[1:]
    text = "".join(
        f'def "P{k}" (\n {arc} = @{path}@</Secret>\n)\n{{\n}}\n'
        for k, (arc, path) in enumerate([
            ("references", outside), ("payload", outside), ("references", climbing),
            ("references", f"{outside}[a.usda]"), ("references", f"file://{outside}"),
        ])
    )  # fmt: skip
    look = material(
        "Look", "color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>", texture("Look", f"{tmp_path}/a.png")
    )
    (tmp_path / "a.png").write_bytes(PNG(np.zeros((1, 1, 3), np.uint8)))
    head = f"metersPerUnit = 1\n    subLayers = [@{outside}@]"
    root = usda(look + text + mesh("Own", "rel material:binding = </Look>"), head)
    for data in (root, usdz({"a.usda": root})):
        found = store.scene(store.add(data).id)
        assert [shape["name"] for shape in found.document["shapes"]] == ["Own"]
        assert not found.document["textures"]
        told = " ".join(warning["detail"] for warning in found.warnings)
        assert "secret.usda" in told and "a.png" in told and "save the scene as a .usdz" in told


@pytest.mark.usd
@pytest.mark.parametrize("path", ["/etc/passwd", "file:///etc/passwd", "foo", "foo.bin", "missing.usda", "../x.usda",
                                  "http://127.0.0.1:9/x", "x.abc", "x.obj"])  # fmt: skip
@pytest.mark.parametrize("arc", ["references", "payload", "prepend references", "subLayers"])
def test_what_a_layer_refers_to_and_is_not_there_is_told(store: AssetStore, path: str, arc: str) -> None:
    """By whatever suffix, alone and in a package; once for each place."""
    head = f"metersPerUnit = 1\n    subLayers = [@{path}@]" if arc == "subLayers" else "metersPerUnit = 1"
    other = "" if arc == "subLayers" else f'def "P" (\n {arc} = @{path}@\n)\n{{\n}}\n'
    root = usda(other + mesh("Own"), head)
    for data in (root, usdz({"a.usda": root})):
        found = store.scene(store.add(data).id)
        assert [shape["name"] for shape in found.document["shapes"]] == ["Own"]
        (told,) = found.warnings
        assert path in told["detail"] and "left out" in told["detail"]


@pytest.mark.usd
def test_layers_are_known_by_their_bytes_and_other_files_are_told(store: AssetStore) -> None:
    def of(path: str) -> bytes:
        return usda(f'def "P" (\n references = @{path}@</Door>\n)\n{{\n}}\n' + mesh("Own"))

    door = {"parts/door": usda(mesh("Door")), "a.png": PNG(np.zeros((1, 1, 3), np.uint8))}
    found = store.scene(store.add(usdz({"a.usda": of("parts/door"), **door})).id)
    (told,) = found.warnings
    assert {shape["name"] for shape in found.document["shapes"]} == {"Own", "P"} and "not used" in told["detail"]
    found = store.scene(store.add(usdz({"a.usda": of("a.png"), "a.png": door["a.png"]})).id)
    (told,) = found.warnings
    assert "'a.png'" in told["detail"] and "no USD layer" in told["detail"]


@pytest.mark.usd
@pytest.mark.slow
def test_packages_that_lead_out_or_blow_up_are_refused(store: AssetStore) -> None:
    from service.formats.read.usd.importer import read_scene

    root = usda(mesh("Sign"))
    bomb = usdz({"a.usda": root, "b.png": bytes(200 << 20)}, zipfile.ZIP_DEFLATED)
    for data, words in (
        (usdz({"a.usda": root, "../b.png": b"x"}), "leads out of its folder"),
        (usdz({"a.usda": root, "/etc/b.png": b"x"}), "leads out of its folder"),
        (bomb, "are allowed, for a zip of"),
        (usdz({"a.usda": b"nonsense"}), "neither with #usda nor"),
        (root.replace(b"[4]", b"[400]"), "corners make its faces"),
        (root.replace(b"2, 3]", b"2, 9]"), "names vertex 9; there are 4"),
        (root.replace(b"(1, 1, 0)", b"(1, nan, 0)"), "not finite"),
        (root.replace(b"def Mesh", b"def Nonsense"), "no triangles"),
        (root.replace(b"(1, 1, 0)", b"(1, 1"), "cannot be read"),
    ):
        with pytest.raises(ParseError, match=words):
            read_scene(data, AssetLimits())
    with pytest.raises(AssetError, match=r"the USD file: a\.usda: it is no USD layer"):
        store.add(usdz({"a.usda": b"nonsense"}))


@pytest.mark.usd
@pytest.mark.slow
def test_instances_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight levels of ten instances each, an instancer within itself, and too many places."""
    from service.formats.read.usd import importer, walk

    monkeypatch.setattr(walk, "MOST_PRIMS", 2_000)
    levels = "".join(
        f'class Xform "L{k}"\n{{\n'
        + "".join(f'def "C{j}" (\n instanceable = true\n references = </L{k + 1}>\n)\n{{\n}}\n' for j in range(10))
        + "}\n"
        for k in range(8)
    )
    many = levels + f'class Xform "L8"\n{{\n{mesh("Sign")}\n}}\ndef "Top" (\n references = </L0>\n)\n{{\n}}\n'
    head = 'def PointInstancer "P"\n{\nrel prototypes = '
    circle = f"{head}</P>\nint[] protoIndices = [0]\npoint3f[] positions = [(0, 0, 0)]\n}}"
    crowd = f"{head}</Sign>\nint[] protoIndices = {[0] * 100_001}\n}}"
    for text, words in ((many, "2000 prims allowed"), (circle, "in a circle"), (mesh("Sign") + crowd, "are allowed")):
        with pytest.raises(ParseError, match=words):
            importer.read_scene(usda(text), AssetLimits())


@pytest.mark.usd
@pytest.mark.slow
def test_broken_binary_layers_end_a_child_at_most(store: AssetStore, tmp_path: Path) -> None:
    whole = usdc(usda(f'def Xform "Car"\n{{\n{mesh("Door")}\n}}\n' + material("Look", "")), tmp_path)
    dice, read = random.Random(1), 0
    with one_child():
        for k in range(MUTANTS):
            data = bytearray(whole)
            if k % 4 == 0:
                del data[dice.randrange(8, len(data)) :]
            for _ in range(dice.choice([1, 3, 30])):
                data[dice.randrange(8, len(data))] = dice.choice([0, 1, 127, 128, 255, dice.randrange(256)])
            try:
                store.add(bytes(data))
                read += 1
            except AssetError as error:
                assert "USD" in str(error)
    assert read < MUTANTS
    assert store.add(whole).kind == "scene"


def test_without_the_extra_the_refusal_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    monkeypatch.setattr(zips, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra) as caught:
        readers.read_usd_scene(memoryview(usda(mesh("Sign"))), AssetLimits())
    answer = refused("the USD file", caught.value)
    assert isinstance(answer, NotProvided) and "sunbox-server[usd]" in answer.detail
    assert ANSWERS[NotProvided].status == 501


@pytest.mark.usd
def test_prims_are_nested_no_deeper_than_the_library_s_stack(store: AssetStore) -> None:
    """20 000 of them overflow it."""
    from service.formats.read.usd.package import DEEPEST  # needs the library

    def nested(depth: int) -> bytes:
        return usda('def "a" {\n' * depth + mesh("m") + "\n}" * depth)

    for depth in (DEEPEST, 20_000):  # and one more, the mesh's
        with pytest.raises(AssetError, match=f"nested more than {DEEPEST} deep"):
            store.add(nested(depth), filename="a.usda")
    assert store.add(nested(DEEPEST - 2), filename="a.usda").triangles


@pytest.mark.usd
def test_braces_in_texts_paths_and_comments_are_none() -> None:
    from service.formats.read.usd import package  # needs the library

    quoted = [b'"{{"', b"'{{{'", b'"""{\n"{"""', b"'''{{'''", b"@{{@", b"@@@{@{{@@@", b'"\\"{{"']
    assert package._depth(b"#usda {\n" + b" ".join(quoted) + b" { { } } # {{{\n { }") == 2
