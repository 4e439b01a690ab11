"""`sunbox bsdf`: tables and figures of the renderer's numbers; mistakes leave no file."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from gpu import Renderer
from service.cli.program import main
from service.views import BSDF_KINDS
from tests import baseline
from tests.marks import seldom
from tests.probing import materials

GREY = {"type": "diffuse", "albedo": 0.5}
METAL = {"type": "metal_rough", "base_color": [1, 0.78, 0.34], "metallic": 1, "roughness": 0.5}
GLASS = {"type": "principled", "base_color": "#ffffff", "roughness": 0, "transmission": 1, "ior": 1.5}
FROSTED = {**GLASS, "roughness": 0.3}


@pytest.fixture
def write(tmp_path: Path, gpu: Renderer) -> Any:
    def document(name: str, material: Any) -> str:
        path = tmp_path / f"{name}.json"
        path.write_text(json.dumps(material))
        return str(path)

    return document


def columns(path: Path) -> dict[str, np.ndarray]:
    head, *rows = csv.reader(io.StringIO(path.read_text()))
    return dict(zip(head, np.array(rows, float).T, strict=True))


def table(folder: Path, *arguments: str) -> dict[str, np.ndarray]:
    out = folder / "out.csv"
    assert main(["bsdf", *arguments, "-o", str(out)]) == 0
    return columns(out)


def direction(degrees: np.ndarray | float) -> np.ndarray:
    t = np.radians(degrees)
    return np.stack([np.sin(t), np.zeros_like(t), np.cos(t)], -1)


def test_polar_is_the_formula(write: Any, tmp_path: Path) -> None:
    found = table(tmp_path, write("gold", METAL), "--angle", "0", "--angle", "60.5")
    assert list(found) == ["theta_deg", *(f"f_{a}_{c}" for a in ("0", "60.5") for c in "rgb")]
    material = materials(base_color=METAL["base_color"], metallic=1, roughness=0.5)[0]
    expected = baseline.metal_rough(material, direction(-60.5), direction(found["theta_deg"]))
    np.testing.assert_allclose(np.stack([found[f"f_60.5_{c}"] for c in "rgb"], 1), expected, rtol=2e-3)
    assert found["theta_deg"][[0, -1]].tolist() == [-89.9, 89.9]


def test_polar_by_lobe(write: Any, tmp_path: Path) -> None:
    plastic = write("plastic", {**METAL, "metallic": 0, "base_color": "#ffffff"})
    found = table(tmp_path, plastic, "--lobes", "--angle", "30")
    assert list(found) == ["theta_deg", "f_30", "f_30_diffuse", "f_30_specular"]
    np.testing.assert_allclose(found["f_30_diffuse"] + found["f_30_specular"], found["f_30"], rtol=1e-5)
    assert list(table(tmp_path, plastic, "--angle", "30")) == ["theta_deg", "f_30"]
    both = table(tmp_path, plastic, "--lobes", "--with", write("gold", METAL))
    assert {"plastic:f_45_diffuse", "gold:f_45_specular_g"} <= both.keys()
    assert "gold:f_45_diffuse_g" not in both, "a metal has none"
    out = tmp_path / "lobes.svg"
    assert main(["bsdf", plastic, "--with", write("glass", FROSTED), "--lobes", "-o", str(out)]) == 0
    texts = [text.text for text in ElementTree.parse(out).iter("{http://www.w3.org/2000/svg}text")]
    assert any("glass" in (text or "") for text in texts), "text is text: it can be read, searched and styled"


def test_transmitted_light_is_below(write: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = table(tmp_path, write("frosted", FROSTED), "--angle", "30")
    below = np.abs(found["theta_deg"]) > 90
    # Refracted by Snell's law, and a little beyond it, as 1 / eta^2 is not divided by.
    peak = found["theta_deg"][below][found["f_30"][below].argmax()]
    assert peak == pytest.approx(180 - math.degrees(math.asin(0.5 / 1.5)), abs=3)
    assert not capsys.readouterr().err
    clear = table(tmp_path, write("glass", GLASS), "--angle", "30")
    assert not clear["f_30"].any()
    notes = capsys.readouterr().err
    assert "specular lobe at 30.0 degrees" in notes and "at 160.5 degrees" in notes


def test_terms(write: Any, tmp_path: Path) -> None:
    gold = write("gold", METAL)
    found = table(tmp_path, gold, "--kind", "distribution")
    c, alpha = np.cos(np.radians(found["theta_deg"])), 0.25
    np.testing.assert_allclose(found["D"], alpha**2 / (np.pi * (c**2 * (alpha**2 - 1) + 1) ** 2), rtol=1e-4)
    found = table(tmp_path, gold, "--kind", "fresnel")
    np.testing.assert_allclose(found["F_b"], 0.34 + 0.66 * (1 - c) ** 5, rtol=1e-4)
    found = table(tmp_path, gold, "--kind", "geometry", "--angle", "0", "--angle", "80")

    def smith(c: Any) -> Any:
        return 2 * c / (c + np.sqrt(alpha**2 + (1 - alpha**2) * c**2))

    assert list(found) == ["theta_deg", "G_0", "G_80"]
    np.testing.assert_allclose(found["G_80"], smith(c) * smith(math.cos(math.radians(80))), rtol=1e-4)


def test_albedo_beside_another_material(write: Any, tmp_path: Path) -> None:
    white = {**FROSTED, "transmission": 0, "metallic": 1}
    found = table(tmp_path, write("grey", GREY), "--kind", "albedo", "--with", write("metal", white))
    assert list(found) == ["theta_deg", "grey:albedo", "metal:albedo"]
    np.testing.assert_allclose(found["grey:albedo"], 0.5, atol=1e-6)
    np.testing.assert_allclose(found["metal:albedo"], 1, atol=0.01)
    assert found["theta_deg"][-1] == pytest.approx(89.9)


def test_slice(write: Any, tmp_path: Path) -> None:
    found = table(tmp_path, write("gold", {**METAL, "base_color": "#ffffff"}), "--kind", "slice")
    theta_h, column = found["theta_deg"], found["theta_d_50"]
    material = materials(base_color=1, metallic=1, roughness=0.5)[0]
    for h in (0, 20, 40):
        half, across = direction(float(h)), np.array([0, math.sin(math.radians(50)), 0])
        along = half * math.cos(math.radians(50))
        expected = baseline.metal_rough(material, along + across, (along - across)[None])[0, 0]
        assert column[theta_h == h] == pytest.approx(expected, rel=2e-3)
    assert found.keys() == {"theta_deg", *(f"theta_d_{d}" for d in range(90))}


@pytest.mark.parametrize("kind", seldom(BSDF_KINDS, BSDF_KINDS[1::2]))
def test_figures(write: Any, tmp_path: Path, kind: str) -> None:
    out = [tmp_path / name for name in ("a.svg", "b.svg", "c.png")]
    for path in out:
        arguments = [write("gold", METAL), "--with", write("frosted", FROSTED), "--kind", kind]
        assert main(["bsdf", *arguments, "-o", str(path)]) == 0
    assert out[0].read_bytes() == out[1].read_bytes() and b"</svg>" in out[0].read_bytes()
    with Image.open(out[2]) as image:
        pixels = np.asarray(image.convert("RGB"))
        assert image.format == "PNG" and min(image.size) > 500 and len(np.unique(pixels.reshape(-1, 3), axis=0)) > 20


def test_two_files_of_one_name(write: Any, tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    first, second = write("same", GREY), write("other/same", METAL)
    found = table(tmp_path, first, "--with", second)
    assert list(found) == ["theta_deg", f"{first}:f_45", *(f"{second}:f_45_{c}" for c in "rgb")]


@pytest.mark.parametrize(
    ("material", "arguments", "said"),
    [
        ({"type": "diffuse", "albedo": 2}, [], "/albedo"),
        ({"type": "difuse"}, [], "/type"),
        ({**METAL, "roughness": {"texture": "t"}}, [], "/roughness"),
        (GREY, ["--kind", "distribution"], "/type: 'diffuse'"),
        (GREY, ["--kind", "geometry"], "/type: 'diffuse'"),
        (GREY, ["--kind", "fresnel"], "/type: 'diffuse'"),
        (GLASS, ["--kind", "distribution"], "/roughness"),
        (GREY, ["--angle", "90"], "--angle '90'"),
        (GREY, ["--angle", "-1"], "--angle '-1'"),
        (GREY, ["--angle", "nan"], "--angle 'nan'"),
        (GREY, ["--angle", "steep"], "--angle 'steep'"),
        (GREY, ["--kind", "lobe"], "--kind"),
        (METAL, ["--kind", "albedo", "--lobes"], "--lobes"),
        (GREY, ["--with", "/nowhere.json"], "/nowhere.json"),
        (GREY, ["-o", "lobe.pdf"], ".csv, .svg, .png"),
    ],
)
def test_mistakes_leave_no_file(
    write: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str], material: Any, arguments: list[str], said: str
) -> None:
    given = [write("m", material), "-o", str(tmp_path / "out.csv"), *arguments]
    before = set(tmp_path.iterdir())
    try:
        code: Any = main(["bsdf", *given])
    except SystemExit as usage:
        code = usage.code
    assert code == 2 and said in capsys.readouterr().err
    assert set(tmp_path.iterdir()) == before


def test_figures_need_matplotlib(
    write: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("service.cli.bsdf.find_spec", lambda name: None)
    assert main(["bsdf", write("m", GREY), "-o", str(tmp_path / "m.svg")]) == 2
    assert "extra `plot`" in capsys.readouterr().err
    assert table(tmp_path, write("m", GREY))
