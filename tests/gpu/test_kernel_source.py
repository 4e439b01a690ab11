"""Shader text: includes once, flags checked, the driver's errors with file and line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gpu import CompileError, Renderer, layout
from gpu.kernels import features, models_glsl, source
from gpu.kernels.cache import KernelCache
from gpu.kernels.flag_table import FLAGS
from gpu.kernels.source import SHADERS, KernelSource
from gpu.layout.models import FLAGGED, MODELS, WALKING, Model
from gpu.picture import resolve
from gpu.picture.look import Look


def _folder(tmp_path: Path, **files: str) -> tuple[Path, ...]:
    for name, text in files.items():
        (tmp_path / name.replace("_glsl", ".glsl").replace("_comp", ".comp")).write_text(text)
    return (tmp_path, SHADERS)


def test_includes_happen_once(tmp_path: Path) -> None:
    folders = _folder(
        tmp_path, a_comp='#include "b.glsl"\n#include "c.glsl"\n', b_glsl='#include "c.glsl"\nB\n', c_glsl="C\n"
    )
    lines = KernelSource("a.comp", {}, folders).text.splitlines()
    assert [line for line in lines if not line.startswith("#")] == ["C", "B"]


def test_files_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A kernel's key is its text: a scene's first frame would wait 6 ms for each that is looked up."""
    defines = features.defines(features.everything())
    first = KernelSource("pathtrace.comp", defines)
    monkeypatch.setattr(source, "_read", None)
    again = KernelSource("pathtrace.comp", defines | {"HAS_BVH": 0})
    assert again.text == first.text.replace("#define HAS_BVH 1\n", "#define HAS_BVH 0\n")
    assert again.files == first.files


def test_an_unknown_flag_is_refused(tmp_path: Path) -> None:
    folders = _folder(tmp_path, a_comp="#if HAS_NOTHING\n#endif\n")
    with pytest.raises(CompileError, match=r"a\.comp:1: #if asks for HAS_NOTHING"):
        KernelSource("a.comp", {"HAS_THING": 1}, folders)


def test_an_include_inside_a_condition_is_refused(tmp_path: Path) -> None:
    folders = _folder(tmp_path, a_comp='#if HAS_A\n#include "c.glsl"\n#endif\n', c_glsl="C\n")
    with pytest.raises(CompileError, match=r"a\.comp:2"):
        KernelSource("a.comp", {"HAS_A": 0}, folders)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(CompileError, match=r"gone\.glsl"):
        KernelSource("a.comp", {}, _folder(tmp_path, a_comp='#include "gone.glsl"\n'))


def test_the_drivers_errors_name_file_and_line(gpu: Renderer, tmp_path: Path) -> None:
    folders = _folder(
        tmp_path,
        a_comp='layout(local_size_x = 8) in;\n#include "b.glsl"\nvoid main() {}\n',
        b_glsl="float f() {\n    return undefined_name;\n}\n",
    )
    with pytest.raises(CompileError, match=r"b\.glsl:2"):
        KernelCache(gpu.context, folders).get("a.comp", {})


def test_every_flag_of_the_table_is_used_and_every_used_one_defined() -> None:
    text = "\n".join(p.read_text() for p in SHADERS.rglob("*") if p.suffix in (".glsl", ".comp"))
    text += models_glsl.text()
    assert [name for name, flag in FLAGS.items() if not flag.of_settings and name not in text] == []
    everything = features.defines(features.everything())
    for entry in ("pathtrace.comp", "lighttrace.comp", "guides.comp"):
        KernelSource(entry, everything)  # raises where a name in #if is not defined
    KernelSource("resolve.comp", {**everything, **resolve.defines(Look(), "u1")})


@pytest.mark.parametrize("model", FLAGGED, ids=lambda model: model.name)
def test_only_a_models_own_files_ask_for_its_flag(model: Model) -> None:
    """All others ask what a kernel's models can do, so that a model more is a row and its own files."""
    own = {SHADERS / f"bsdf/models/{name}.glsl" for name in (model.name, f"{model.name}_members")}
    own |= set((SHADERS / f"bsdf/lobes/{model.name}").glob("*.glsl"))
    asks = re.compile(rf"\b({model.flag}|{model.lobes_flag})\b")
    assert [path for path in SHADERS.rglob("*.*") if path not in own and asks.search(path.read_text())] == []


def test_no_shader_but_a_models_own_names_a_model() -> None:
    """Numbers of models stand in their folder, and in what `gpu.kernels.models_glsl` writes."""
    own, names = SHADERS / "bsdf/models", re.compile(r"\bMODEL_(" + "|".join(m.name.upper() for m in MODELS) + r")\b")
    shaders = [path for path in SHADERS.rglob("*.*") if own not in path.parents]
    assert len(shaders) > 100 and names.search(models_glsl.text())
    assert [path for path in shaders if names.search(path.read_text())] == []


def test_the_colour_under_a_surface_is_a_member_of_each_model_that_walks() -> None:
    assert len(WALKING) >= 2 and all(model.walk_color in layout.Material.members for model in WALKING)
    text = models_glsl.predicates().splitlines()[-1]
    assert text.startswith("vec3 model_walk_color(Material m)")
    assert all(f"m.{model.walk_color}" in text for model in WALKING)


def test_the_estimator_reads_as_a_page() -> None:
    """Each file that it includes guards its own body, and has functions that do nothing where its flag is off."""
    lines = (SHADERS / "path/path.glsl").read_text().splitlines()
    assert [line for line in lines if line.lstrip().startswith("#") and not line.startswith("#include ")] == []
    assert len(lines) <= 120


def test_what_a_path_has_met_is_decided_at_one_place() -> None:
    """The order of the questions matters. All other code asks for the event that came out."""
    names = re.compile(r"\bEVENT_(ESCAPE|PARTICLE|PASSAGE|EXIT)\b")
    found = {path.relative_to(SHADERS).as_posix(): names.findall(path.read_text()) for path in SHADERS.rglob("*.*")}
    deciding = {"path/event.glsl", "path/path_trace.glsl"}
    assert {path for path, events in found.items() if set(events) - {"ESCAPE"}} == deciding
    assert {path for path, events in found.items() if events} == {*deciding, "path/path_extend.glsl"}


def taken(source: KernelSource) -> str:
    """The text that is left when the driver has evaluated every #if; names that nothing defines are 0 there."""
    defines, lines = dict[str, str](), list[str]()
    branches = list[tuple[bool, bool]]()  # of each #if that is open: is this branch taken, was one before
    for line in source.text.splitlines():
        directive, _, rest = line.strip().partition(" ")
        if directive == "#endif":
            branches.pop()
        elif directive in ("#else", "#elif"):
            _, before = branches.pop()
            branches.append((not before and (directive == "#else" or _holds(rest, defines)), before))
            branches[-1] = branches[-1][0], before or branches[-1][0]
        elif directive in ("#if", "#ifdef"):
            holds = rest in defines if directive == "#ifdef" else _holds(rest, defines)
            branches.append((holds, holds))
        elif all(holds for holds, _ in branches):
            if directive == "#define":
                name, _, value = rest.partition(" ")
                defines[name] = value
            elif not line.startswith("#"):
                lines.append(line)
    return "\n".join(lines)


def _holds(condition: str, defines: dict[str, str]) -> bool:
    valued = re.sub(r"[A-Za-z_]\w*", lambda name: defines.get(name.group(), "0"), condition)
    return bool(eval(valued.replace("&&", " and ").replace("||", " or ").replace("!=", "<>").replace("!", " not ")
                     .replace("<>", "!=")))  # fmt: skip


def test_a_scene_is_spared_the_code_of_others() -> None:
    """The driver parses every function, called or not: those of lights, shapes and lobes that a scene lacks took a
    tenth of the time in which its front end reads the kernel."""
    raised = frozenset({"HAS_QUADS", "HAS_LIGHTS", "HAS_EMISSION", "HAS_QUAD_LIGHTS"})
    text = taken(KernelSource("pathtrace.comp", features.defines(raised, shapes={"QUAD_COUNT": 6, "QUAD_LOOP": 6})))
    beginnings = list(re.finditer(r"^\w+ (\w+)\([^;{]*\) \{", text, re.MULTILINE))
    ends = [after.start() for after in beginnings[1:]] + [len(text)]
    sizes = {found[1]: end - found.start() for found, end in zip(beginnings, ends, strict=True)}
    uncalled = {name: size for name, size in sizes.items() if len(re.findall(rf"\b{name}\(", text)) == 1}
    uncalled.pop("main")
    assert sum(uncalled.values()) < 0.18 * len(text), sorted(uncalled.items(), key=lambda item: -item[1])[:10]
