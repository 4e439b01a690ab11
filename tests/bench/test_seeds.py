"""The repeated experiments: what is compared shows one picture, and the page is whole."""

from __future__ import annotations

import json
import re
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import Renderer
from gpu.analysis.unbounded import UnboundedRenderer
from service.cli.program import main
from tests.bench.seeds import blur, bounces, reflection, report, run, samples, spheres
from tests.bench.seeds.stage import GAP, Stage, sheet, shown


@pytest.fixture
def stage(gpu: Renderer) -> Stage:
    return Stage(gpu, quick=True, told=lambda what: None)


@pytest.mark.bench
def test_every_tree_shows_the_same_spheres(gpu: Renderer) -> None:
    """With treelets, too: of 5 000 boxes not all fit into the top."""
    with UnboundedRenderer() as renderer:
        every_tree_shows_the_same_spheres(Stage(renderer, quick=True, told=lambda what: None))


def every_tree_shows_the_same_spheres(stage: Stage) -> None:
    packed = stage.packed(spheres.field(5000))
    ways = [spheres.without_tree(packed), packed]
    ways += [spheres.with_tree(packed, split)[0] for split in spheres.SPLITS.values()]
    assert len(ways[-1].nodes) > 8 * ways[-1].node_count
    ways.append(spheres.in_one_order(ways[-1]))
    first, *others = (stage.image(arrays, 48, 27, 2, max_bounces=2) for arrays in ways)
    assert first.std() > 0.05
    for other in others:
        # Two spheres that touch may change places by rounding, in a pixel or two.
        assert np.mean(np.abs(other - first).max(axis=2) > 1e-4) < 0.003


def test_the_vase_is_closed_but_for_nothing(stage: Stage) -> None:
    scene = bounces.vase()
    packed = stage.packed(scene)
    assert 6500 < len(packed.triangles) < 7500
    assert {shape["material"] for shape in scene["shapes"]} == set(scene["materials"])


@pytest.mark.bench
def test_the_cube_shows_the_sky_of_the_picture(stage: Stage) -> None:
    """As an image and as six faces it lights a ball alike."""
    material = samples.MATERIALS["diffuse"]
    environment = reflection.presets.get("environments", "clear-sky")
    of_image = stage.image(samples.sphere(material, environment={**environment, "rotation": 150}), 24, 24, 256)
    stage.assets = samples.CubeAssets()
    of_cube = stage.image(samples.sphere(material, **samples.CUBE), 24, 24, 256)
    assert of_cube.mean() == pytest.approx(of_image.mean(), rel=0.1)  # its texels are coarser than the sun is


def test_models_are_those_that_the_document_has() -> None:
    assert {"blinn_phong", "disney", "principled"} <= set(reflection.known())
    assert set(reflection.PLASTIC) == set(reflection.METAL) == set(reflection.GLOSS)
    for name in reflection.known():
        for document in (reflection.METAL[name], reflection.GLOSS[name]):
            assert reflection._parsed(document) is not None


def test_sheets_keep_their_pictures_apart() -> None:
    grey = shown(np.full((2, 3, 3), 0.5))
    page = sheet([[grey, grey], [grey]])
    assert page.shape == (4 + GAP, 6 + GAP, 3) and (page[:2, :3] == 188).all()
    assert (page[2 : 2 + GAP] == 255).all() and (page[2 + GAP :, 3:] == 255).all()


@pytest.mark.bench
def test_the_experiments_run_and_are_published(
    gpu: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = {}
    measure = run.measure
    monkeypatch.setattr(run, "measure", lambda *given: kept.setdefault("all", measure(*given)))
    assert main(["bench", "seeds", "--quick", "-o", str(tmp_path / "seeds.json")]) == 0
    document, pictures = kept["all"]
    assert json.loads((tmp_path / "seeds.json").read_text())["quick"] is True
    assert all(ms > 0 for row in document["spheres"] for ms in row["ms"].values())
    unblurred, blurred = document["blur"]
    assert unblurred["bias"] == 0 < blurred["bias"]
    assert blurred["noise"]["uniform"] < 0.5 * unblurred["noise"]["uniform"]
    metal = document["reflection"]["metal"]
    assert metal["principled"] == pytest.approx([1] * len(reflection.ANGLES), abs=0.1)
    assert "# Experiments" in capsys.readouterr().out
    if find_spec("matplotlib"):
        report.publish(document, pictures, tmp_path)
        page = (tmp_path / "experiments.md").read_text()
        linked = set(re.findall(r"\]\(experiments/([\w-]+\.webp)\)", page))
        assert linked == {path.name for path in (tmp_path / "experiments").glob("*.webp")}
        assert max(len(line) for line in page.splitlines() if line[:1] not in "|!") <= 120


def test_figures_that_mean_nothing_are_not_published() -> None:
    assert main(["bench", "seeds", "--quick", "--publish"]) == 2
    assert blur.DEGREES[0] == 0, "what the others are compared with"
