"""Verdicts from Python, and the commands that give them."""

from __future__ import annotations

import asyncio
import copy
import json
import re
from io import BytesIO
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from PIL import Image

import sunbox
from service.cli.program import main
from tests.serving import SCENE, Server

SETTINGS = {"width": 32, "height": 24, "max_samples": 32}
SIZE = ["--set", "width=32", "--set", "height=24", "--spp", "32"]


def paler(value: float = 0.9) -> Any:
    scene = copy.deepcopy(SCENE)
    scene["materials"]["ball"]["base_color"] = value
    return scene


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A reference and what is tested: `same` and `other`; `new` and `old` are in one of them only."""
    here = {"reference/same": SCENE, "reference/glass/other": SCENE, "reference/old": SCENE}
    there = {"tested/same": SCENE, "tested/glass/other": paler(), "tested/new": SCENE}
    for name, scene in {**here, **there}.items():
        path = tmp_path / f"{name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(scene))
    return tmp_path


@pytest.fixture
def exr(server: Server, tmp_path: Path) -> Path:
    with sunbox.Client(server.url) as client:
        path = tmp_path / "reference.exr"
        path.write_bytes(client.render(SCENE, **SETTINGS).exr())
    return path


def test_a_verdict(server: Server, folder: Path) -> None:
    with sunbox.Client(server.url) as client:
        same = client.compare(SCENE, folder / "tested" / "same.json", **SETTINGS)
        assert (same.different, same.p_value, same.psnr, same.regions, same.map) == (False, 1.0, None, [], None)
        other = client.compare({"scene": SCENE, "settings": SETTINGS}, paler(), 0.99, map="heat", **SETTINGS)
        assert other.different and other.p_value < 0.01 and other.samples["a"] == other.samples["b"] <= 32
        region = other.regions[0]
        assert region.x + region.width <= 32 and region.y + region.height <= 24 and region.p_value < 0.01
        assert Image.open(BytesIO(other.map or b"")).size == (32, 24)


def test_a_verdict_awaited(server: Server) -> None:
    async def found() -> sunbox.Verdict:
        async with sunbox.AsyncClient(server.url) as client:
            return await client.compare(SCENE, paler(), **SETTINGS)

    assert asyncio.run(found()).different


def test_the_example_of_the_readme(server: Server, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_URL", server.url)
    monkeypatch.chdir(tmp_path)
    text = (Path(__file__).parents[2] / "client" / "README.md").read_text()
    code = re.findall(r"^## Do they look the same.*?^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(code[0], "README", "exec"), names)
    assert names["verdict"].different and Image.open("where.png").size == (64, 64)


def test_pictures_on_both_sides(server: Server, exr: Path) -> None:
    with sunbox.Client(server.url) as client:
        job = client.submit(SCENE, **SETTINGS)
        picture = job.result()
        assert picture.id == job.id
        for other in (job, job.id, picture, client.upload(exr)):
            assert client.compare(exr, other).p_value == 1.0
        job.delete()
        with pytest.raises(sunbox.NotFound) as gone:
            client.compare(exr, "0" * 32)
        assert gone.value.pointer == "/b"
        with pytest.raises(sunbox.Refused, match="same size"):
            client.compare(exr, SCENE, width=16)


def test_compare_says_so_by_its_exit_code(
    server: Server, folder: Path, exr: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    same, other = str(folder / "tested/same.json"), str(folder / "tested/glass/other.json")
    out, at = folder / "map.png", ["--server", server.url]
    assert main(["compare", same, same, *SIZE, *at]) == 0
    assert capsys.readouterr().out.startswith("the same within noise: p = 1, ")
    assert main(["compare", same, other, *SIZE, *at, "-o", str(out), "--map", "difference"]) == 1
    assert Image.open(out).size == (32, 24)
    assert capsys.readouterr().out.startswith("different: p = ")
    # The settings of a picture are those of a scene that has none of its own.
    assert main(["compare", str(exr), same, *at]) == 0
    assert capsys.readouterr().out.startswith("the same within noise: p = 1, 32 samples")
    assert main(["compare", other, str(exr), *at]) == 1


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["missing.json"], "missing.json"),
        (["--confidence", "1"], "--confidence"),
        (["-o", "map.jpg"], ".png"),
        (["--set", "width=0"], "/width"),
        (["0" * 32], "0" * 32),
    ],
)
def test_compare_refuses(folder: Path, arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Before a server is started."""
    same = str(folder / "tested/same.json")
    sides = [same] if not arguments[0].startswith("-") else [same, same]
    assert main(["compare", *sides, *arguments]) == 2
    assert told in capsys.readouterr().err


def test_no_verdict_is_no_difference(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Where no server answers."""
    same = str(folder / "tested/same.json")
    assert main(["compare", same, same, "--server", "http://127.0.0.1:9"]) == 3
    assert "No answer" in capsys.readouterr().err


def test_a_folder_beside_another(server: Server, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet, report = folder / "sheet.png", folder / "report.xml"
    against = ["--against", str(folder / "reference"), "--server", server.url, *SIZE]
    code = main(["test", str(folder / "tested"), *against, "-o", str(sheet), "--junit", str(report)])
    said = capsys.readouterr().out.splitlines()
    assert code == 1 and said[-1] == "4 compared, 3 failed"
    assert [line.partition(":")[0] for line in said[:-1]] == ["glass/other", "new", "old", "same"]
    assert said[1].endswith("tested only") and said[2].endswith("reference only")
    size = Image.open(sheet).size
    assert size[0] > 3 * 32 and 24 < size[1] < 2 * 24 + 40  # one row
    suite = ElementTree.parse(report).getroot()[0]
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("4", "3", "0")
    assert [case.get("name") for case in suite if case.find("failure") is not None] == ["glass/other", "new", "old"]
    assert "pixels at" in str(suite[0][0].text)


def test_a_folder_of_pictures_is_a_reference(
    server: Server, folder: Path, exr: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    reference, tested = folder / "pictures", folder / "one"
    for each in (reference, tested):
        each.mkdir()
    exr.rename(reference / "same.exr")
    (tested / "same.json").write_text(json.dumps(SCENE))
    ask = ["test", str(tested), "--against", str(reference), "--server", server.url, "-o", str(folder / "sheet.png")]
    assert main(ask) == 0
    assert not (folder / "sheet.png").exists()
    (tested / "same.json").write_text(json.dumps(paler()))
    assert main(ask) == 1
    assert (folder / "sheet.png").exists()
    (tested / "same.json").write_text("{}")
    capsys.readouterr()
    assert main(ask) == 2
    assert "same.json" in capsys.readouterr().err
    assert main(["test", str(tested), "--against", str(folder / "nowhere")]) == 2


def test_a_comparison_without_a_server(folder: Path) -> None:
    """One is started for as long as it takes."""
    same, other = folder / "tested/same.json", folder / "tested/glass/other.json"
    assert main(["compare", str(same), str(other), *SIZE]) == 1
