"""Hooks of the profile fit the shaders, counts agree with what is known, loops are those of the code."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gpu import Renderer, RenderSettings
from tests.bench.__main__ import main
from tests.bench.profile import drivers, hooks, knockouts, machine_code, page, run, scenes
from tests.bench.profile.counts import Counter, Counts
from tests.bench.profile.instrumented import Edit, InstrumentedRenderer, LineGone
from tests.bench.profile.load_costs import ACTIVE, KINDS, NOTHING, load_costs
from tests.bench.profile.loops import instructions, loops
from tests.marks import seldom

SMALL = RenderSettings(16, 16, 3, filter="box", seed=1)


@pytest.fixture(scope="module")
def counter(gpu: Renderer) -> Iterator[Counter]:
    with Counter() as made:
        yield made


@pytest.fixture(scope="module")
def subjects() -> dict[str, scenes.Subject]:
    return {subject.name.split()[0]: subject for subject in scenes.built_in()}


def _count(counter: Counter, subject: scenes.Subject, settings: RenderSettings = SMALL) -> Counts:
    return counter.count(subject.packed(subject.document), settings, 2)


@pytest.mark.bench
@pytest.mark.parametrize("name", seldom(["rough", "mesh", "glass", "textured"], ["mesh", "glass"]))
def test_counts_agree_with_what_is_known(counter: Counter, subjects: dict[str, scenes.Subject], name: str) -> None:
    found = _count(counter, subjects[name])
    everything = found.a_path["any"]
    assert found.a_path["camera"]["ray"] == 1 == found.used["camera"]["ray"]
    assert everything["ray"] == pytest.approx(sum(found.a_path[kind]["ray"] for kind in hooks.RAYS))
    assert all(0 < share <= 1 for table in found.used.values() for share in table.values())
    assert ("box" in everything) == (name in ("mesh", "textured"))
    assert ("mirror" in everything) == (name == "glass")
    # A path goes on from each surface at most once, and lights are sampled at surfaces that are no mirrors.
    assert found.a_path["extension"]["ray"] <= everything["bounce"] + everything.get("mirror", 0)
    assert found.a_path["shadow"]["ray"] <= everything["light"] <= 4 * everything["bounce"]


@pytest.mark.bench
def test_lanes_of_one_path_in_eight(counter: Counter, subjects: dict[str, scenes.Subject]) -> None:
    """Where one column of each vector's eight pixels sees a floor, one lane of the vector is in use."""
    subject = subjects["rough"]
    document = {
        **subject.document,
        "camera": {"position": [0, 0, 4], "target": [0, 0, 0], "vfov": 53.13010235415598},  # a pixel is 0.25 wide
        "materials": {"subject": {"type": "diffuse", "albedo": 0.5}},
        "shapes": [
            {"type": "quad", "origin": [x, -2, 0], "u": [0.25, 0, 0], "v": [0, 4, 0], "material": "subject"}
            for x in (-2, 0)
        ],
    }
    found = counter.count(subject.packed(document), RenderSettings(16, 16, 1, filter="box", seed=1), 2)
    assert found.a_path["any"]["bounce"] == pytest.approx(1 / 8)
    assert found.used["any"]["bounce"] == pytest.approx(1 / 8)


@pytest.mark.bench
def test_without_bounces_there_are_camera_rays_alone(counter: Counter, subjects: dict[str, scenes.Subject]) -> None:
    found = _count(counter, subjects["mesh"], RenderSettings(16, 16, 0, filter="box"))
    assert found.a_path["any"]["ray"] == 1
    assert found.a_path["shadow"] == found.a_path["extension"] == {}


@pytest.mark.bench
def test_counting_does_not_change_the_picture(gpu: Renderer, subjects: dict[str, scenes.Subject]) -> None:
    arrays = subjects["mesh"].packed(subjects["mesh"].document)
    pictures = []
    with InstrumentedRenderer(hooks.HOOKS, hooks.FUNCTIONS, hooks.COUNTERS) as counting:
        for renderer in (gpu, counting):
            picture = renderer.picture(renderer.load(arrays), SMALL)
            picture.trace(60.0, 2)
            pictures.append(picture.read())
            picture.release()
    assert np.array_equal(*pictures)


def test_a_hook_without_its_line_is_an_error(gpu: Renderer) -> None:
    for line, many in (("no such line", "0"), ("}", r"[1-9]\d+")):
        with pytest.raises(LineGone, match=f"shapes/traverse.glsl: {many} lines contain"):
            InstrumentedRenderer([Edit("shapes/traverse.glsl", line, "profile();")], "", 1)


@pytest.mark.bench
def test_loads_are_timed_by_kind_and_lanes(gpu: Renderer) -> None:
    found = load_costs(runs=3, groups=8)
    assert set(found) == {*KINDS, NOTHING}
    assert all(len(row) == len(ACTIVE) and min(row) > 0 for row in found.values())
    # Eight chains of dependent loads take longer than none.
    assert found["storage buffer, uvec4"][0] > found[NOTHING][0]


@pytest.mark.slow
def test_variants_leave_out_one_thing_each(subjects: dict[str, scenes.Subject]) -> None:
    names = {name: [v.name for v in knockouts.variants(subject, 16)] for name, subject in subjects.items()}
    assert {"no textures", "no normal maps", "no transmission", "opaque"} <= set(names["textured"])
    assert "no transmission" in names["glass"] and "no textures" not in names["glass"]
    for subject in subjects.values():
        for variant in knockouts.variants(subject, 16):
            subject.packed(variant.document)  # is valid


CODE = """
00007f0000000000 <.data>:
    7f0000000000:\tc5 fc 28 07          \tvmovaps (%rdi),%ymm0
    7f0000000004:\tc5 fc 29 44 24 20    \tvmovaps %ymm0,0x20(%rsp)
    7f000000000a:\tc5 fc 58 c1          \tvaddps %ymm1,%ymm0,%ymm0
    7f000000000e:\tff c8                \tdec    %eax
    7f0000000010:\t75 f8                \tjne    0x7f000000000a
    7f0000000012:\tff c9                \tdec    %ecx
    7f0000000014:\t75 ee                \tjne    0x7f0000000004
    7f0000000016:\tff ca                \tdec    %edx
    7f0000000018:\t75 e6                \tjne    0x7f0000000000
    7f000000001a:\tc3                   \tret
"""


def test_loops_of_code() -> None:
    code = instructions(CODE)
    assert len(code) == 10 and code[1] == (0x7F0000000004, "vmovaps %ymm0,0x20(%rsp)")
    start = 0x7F0000000000
    outer, inner = loops(code, {start: 0, start + 0x4: 25, start + 0xA: 60, start + 0xE: 10, start + 0x1A: 5})
    # The outermost loop has no sample of its own: none of it is left, not even an empty row.
    assert (outer.depth, outer.share, outer.instructions, outer.wide, outer.stack) == (0, 0.25, 3, 1, 1)
    assert (inner.depth, inner.share, inner.instructions, inner.wide, inner.stack) == (1, 0.7, 3, 1, 0)


def test_without_perf_the_page_says_so(monkeypatch: pytest.MonkeyPatch, subjects: dict[str, scenes.Subject]) -> None:
    arrays = subjects["rough"].packed(subjects["rough"].document)  # by a parser, which is found by PATH
    monkeypatch.setenv("PATH", "")
    with pytest.raises(machine_code.NotSampled, match="perf is not installed"):
        machine_code.measure(arrays, SMALL)


def test_a_folder_without_a_mesa_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], gpu: Renderer
) -> None:
    with pytest.raises(drivers.NoMesa):
        drivers.variables(tmp_path, tmp_path)
    assert main(["profile", "--quick", "--mesa", str(tmp_path)]) == 2
    assert "libEGL_mesa.so.0" in capsys.readouterr().err
    assert main(["profile", "--quick", "--publish"]) == 2


@pytest.mark.bench
def test_the_command_measures_a_file_and_publishes_it(
    gpu: Renderer,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    subjects: dict[str, scenes.Subject],
) -> None:
    monkeypatch.setattr(machine_code, "TOOLS", ("no-such-tool",))
    scene = tmp_path / "ball.json"
    scene.write_text(json.dumps(subjects["glass"].document))
    output = tmp_path / "profile.json"
    assert main(["profile", "--quick", "--file", str(scene), "-o", str(output)]) == 0
    assert "no-such-tool is not installed" in capsys.readouterr().out
    document = json.loads(output.read_text())
    parts = document["scenes"]["ball.json"]["parts"]
    assert [part["name"] for part in parts][:2] == [knockouts.WHOLE, "0 bounces"]
    assert all(part["path_ns"] > 0 and part["counts"]["a_path"]["camera"]["ray"] == 1 for part in parts)


def _published(docs: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((docs / "llvmpipe.json").read_text())
    return found


def test_publishing_keeps_what_was_not_measured_again(tmp_path: Path) -> None:
    counts = {"a_path": {kind: {} for kind in hooks.KINDS}, "used": {kind: {} for kind in hooks.KINDS}}
    counts["a_path"]["any"] = {"ray": 2.0}
    counts["used"]["any"] = {"ray": 0.5}
    scene = {
        "commit": "0123456789abcdef",
        "parts": [{"name": knockouts.WHOLE, "path_ns": 100.0, "counts": counts}],
        "loops": [{"first": 0, "depth": 1, "share": 0.5, "instructions": 9, "wide": 3, "gathers": 0, "stack": 1}],
    }
    about = {"processor": "a", "cores": 2, "renderer": "b"}
    rows = [{"name": "ball", "max_bounces": 8, "path_ns": 100.0, "other_path_ns": 150.0, "ratio": 1.5}]
    loads = {"uniform block": [4.0, 3.0, 2.0, 1.25]}
    other = {"commit": None, "renderer": "c", "loads": loads, "rows": rows}
    (tmp_path / "llvmpipe.md").write_text("# Profile\n\nBefore.\n")
    page.publish({"machine": about, "size": 64, "load": 0.5, "scenes": {"one": scene}, "drivers": other}, tmp_path)
    page.publish({"machine": about, "size": 64, "load": 0.5, "scenes": {"two": scene}}, tmp_path)
    text = (tmp_path / "llvmpipe.md").read_text()
    assert text.startswith("# Profile\n\nBefore.\n") and text.count(page.BEGIN) == 1
    assert "| uniform block | 4.0 | 3.0 | 2.0 | 1.2 |" in text
    assert "### one" in text and "### two" in text and "| ball | 8 | 100 | 150 | 1.50 |" in text
    assert "| as it is | 100 | 1.00 | 2.00 | 50 |" in text and "| · 1 | 50.0% | 9 | 3 | 0 | 1 |" in text
    assert set(_published(tmp_path)["scenes"]) == {"one", "two"}


def test_only_llvmpipe_can_be_profiled(gpu: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run.machine, "describe", lambda info: {"renderer": "a GPU", "commit": None})
    with pytest.raises(run.NotSoftware, match="a GPU"):
        run.measure([], run.Options(), lambda what: None)
