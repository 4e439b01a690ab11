"""First frames are measured at a real server, for every slider that moves a number."""

from __future__ import annotations

from typing import Any

import pytest

from service.document import merge_patch, parse_scene, presets
from tests.bench import first_frames
from tests.bench.__main__ import main
from tests.bench.sliders import Slider, sliders


@pytest.mark.parametrize("name", [entry["name"] for entry in presets.names("scenes")])
def test_every_slider_changes_its_number_and_gives_it_back(name: str) -> None:
    document = presets.get("scenes", name)
    found = sliders(document)
    assert {"camera/vfov", "camera/aperture_radius"} <= {slider.name for slider in found}
    for slider in found:
        low, high = (merge_patch(document, slider.patch(document, share)) for share in (0.0, 1.0))
        assert parse_scene(low) != parse_scene(high), slider.name
        assert merge_patch(high, slider.restore(document)) == document, slider.name


def test_sliders_are_of_the_first_material_of_each_kind() -> None:
    names = {slider.name for slider in sliders(presets.get("scenes", "cornell-spheres"))}
    assert {"materials/White porcelain/roughness", "materials/Lamp/emission", "materials/White walls/albedo"} <= names
    assert not any(name.startswith(("materials/Red", "materials/Steel")) for name in names)
    assert "lights/1/intensity" in {slider.name for slider in sliders(presets.get("scenes", "point-lights"))}


@pytest.mark.bench
def test_first_frames_are_measured_at_a_real_server(gpu: Any, filled: None, monkeypatch: pytest.MonkeyPatch) -> None:
    found = [
        Slider(("camera", "vfov"), 20, 60, "number"),
        Slider(("materials", "White walls", "albedo"), 0, 1, "color"),
    ]
    monkeypatch.setattr(first_frames, "sliders", lambda document: found)
    monkeypatch.setattr(first_frames, "QUIET_S", 2.0)
    monkeypatch.setattr(first_frames.presets, "names", lambda kind: [{"name": "matte-clay"}])
    document = first_frames.measure(["cornell-empty"], lambda line: None, moves=2)
    row = document["scenes"][0]
    assert row["sliders"].keys() == {"camera/vfov", "materials/White walls/albedo"}
    assert all(len(times) == 2 and min(times) > 0 for times in row["sliders"].values())
    assert row["start_ms"] > row["change_again_ms"] > 0 and row["change_ms"] > 0 and row["change_foreseen_ms"] > 0
    assert [each["name"] for each in document["thumbnails"]] == ["matte-clay"]
    assert all(document["thumbnails"][0][f"{which}_ms"] > 0 for which in ("first", "again", "left_alone"))
    assert len(first_frames.table(document).splitlines()) == 7


def test_first_frames_refuse_a_scene_that_is_not_built_in(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["frames", "--scenes", "cornell-empty,nowhere"]) == 2
    assert "nowhere" in capsys.readouterr().err
