"""The command line, driven as from a shell; what needs no OpenGL runs without it."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gpu import settings as gpu_settings
from gpu.analysis.kernel_cost import KernelCost
from gpu.picture import passes
from service import views
from service.cli.program import main
from service.cli.progress import ProgressLine, describe
from service.config import load_config
from service.formats import images
from service.formats.images import read_metadata
from service.ipc.messages import Progress
from service.worker import progress as worker_progress

SCENE: dict[str, Any] = {
    "version": 1,
    "camera": {"position": [0, 0, 4], "target": [0, 0, 0]},
    "environment": {"type": "constant", "radiance": 1},
    "materials": {"a": {"type": "diffuse", "albedo": 0.5}},
    "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "material": "a"}],
}
SMALL = ["--set", "width=16", "--set", "height=12", "--spp", "4"]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(SCENE))
    return path


def refused(capsys: pytest.CaptureFixture[str], folder: Path, *arguments: str) -> str:
    """What the command line says when it refuses: exit code 2, a few plain lines, no file left."""
    before = set(folder.iterdir())
    try:
        code = main(["render", *arguments])
    except SystemExit as usage:
        code = usage.code if isinstance(usage.code, int) else 1
    said = capsys.readouterr()
    assert (code, said.out) == (2, "")
    assert "Traceback" not in said.err and 0 < len(said.err.splitlines()) <= 12
    assert set(folder.iterdir()) == before
    return said.err


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"materials": {"a": {"type": "diffuse", "albedo": 2}}}, "/materials/a/albedo"),
        ({"environment": {"type": "image", "asset": "missing.exr"}}, "/environment/asset"),
        ({"environment": {"type": "image", "asset": "../outside.exr"}}, "/environment/asset"),
    ],
)
def test_scene_mistake_names_its_pointer(
    change: dict[str, Any], pointer: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Which others there are, `tests/service/document/test_refusals.py` has; files are the command line's own."""
    source = tmp_path / "scene.json"
    source.write_text(json.dumps({**SCENE, **change}))
    assert f"error: {pointer}: " in refused(capsys, tmp_path, str(source), "-o", str(tmp_path / "out.npy"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--set", "width=0"], "/width"),
        (["--set", "height=10.5"], "/height"),
        (["--set", "samples=9"], "/samples"),
        (["--set", "target_noise=nan"], "/target_noise"),
        (["--set", "estimator=bdpt"], "/estimator"),
        (["--set", "denoise=1"], "/denoise"),
        (["--set", "width"], "key=value"),
        (["--spp", "-4"], "/max_samples"),
        (["--seed", "1.5"], "/seed"),
        (["--aov", "beauty"], "variance"),
        (["--aov", "all"], ".exr"),
        (["--tone-map", "filmic"], "pbr_neutral"),
        (["--exposure", "nan"], "-60 to 60"),
        (["--stats", "missing/stats.json"], "does not exist"),
        (["--asset-root", "missing"], "--asset-root"),
        (["--frames", "3"], "--frames"),
    ],
)
def test_argument_mistake_is_named(
    arguments: list[str], said: str, scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in refused(capsys, tmp_path, str(scene), "-o", str(tmp_path / "out.npy"), *arguments)


@pytest.mark.parametrize("data", [b"", b"{", b"[]", b"\xff\xfe\0", b'{"version": 1, "version": 1}', b"[" * 100_000])
def test_file_that_is_no_scene_is_refused(data: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / "scene.json"
    source.write_bytes(data)
    refused(capsys, tmp_path, str(source), "-o", str(tmp_path / "out.png"))


def test_input_and_output_are_checked(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "no such file" in refused(capsys, tmp_path, str(tmp_path / "none.json"), "-o", str(tmp_path / "a.png"))
    assert "directory" in refused(capsys, tmp_path, str(tmp_path), "-o", str(tmp_path / "a.png"))
    assert ".exr" in refused(capsys, tmp_path, str(scene), "-o", str(tmp_path / "a.tiff"))
    assert "does not exist" in refused(capsys, tmp_path, str(scene), "-o", str(tmp_path / "none" / "a.png"))


def test_mistakes_are_found_before_opengl_is_loaded(scene: Path, tmp_path: Path) -> None:
    program = (
        "import sys; from service.cli.program import main\n"
        f"code = main(['render', {str(scene)!r}, '-o', {str(tmp_path / 'a.png')!r}, '--set', 'width=0'])\n"
        "heavy = {'moderngl', 'numba', 'fastapi', 'trimesh', 'OpenImageIO', 'PIL'} & set(sys.modules)\n"
        "sys.exit(code if not heavy else str(heavy))"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert answer.returncode == 2, answer.stderr


def test_the_process_ends_with_its_command_s_code_after_all_that_was_registered(tmp_path: Path) -> None:
    program = (
        "import atexit, sys, threading, time\n"
        "from service.cli import program as cli\n"
        "def work():\n"
        "    time.sleep(0.2)\n"
        "    print('worked', end=' ')\n"
        "def command():\n"
        "    atexit.register(print, 'ended', end='')\n"
        "    threading.Thread(target=work).start()\n"
        "    return 3\n"
        "cli.main = command\n"
        "sys.exit(cli.program())"
    )
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert (answer.returncode, answer.stdout, answer.stderr) == (3, "worked ended", "")


@pytest.mark.parametrize(("aov", "channels"), [("color", 4), ("albedo", 3), ("normal", 3), ("depth", 1)])
def test_npy_holds_linear_floats(aov: str, channels: int, gpu: Any, scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.npy"
    assert main(["render", str(scene), "-o", str(out), "--aov", aov, *SMALL]) == 0
    pixels = np.load(out, allow_pickle=False)
    assert (pixels.shape, pixels.dtype) == ((12, 16, channels), np.float32)
    if aov == "albedo":
        assert pixels[6, 8] == pytest.approx([0.5] * 3)


@pytest.mark.parametrize(
    ("suffix", "magic"),
    [("png", b"\x89PNG"), ("exr", b"\x76\x2f\x31\x01"), ("hdr", b"#?RADIANCE"), ("PNG", b"\x89PNG")],
)
def test_format_follows_the_name(suffix: str, magic: bytes, gpu: Any, scene: Path, tmp_path: Path) -> None:
    out = tmp_path / f"out.{suffix}"
    assert main(["render", str(scene), "-o", str(out), "--exposure", "-1", "--tone-map", "agx", *SMALL]) == 0
    assert out.read_bytes().startswith(magic)


def test_all_aovs_become_layers(gpu: Any, scene: Path, tmp_path: Path) -> None:
    import OpenImageIO

    out = tmp_path / "out.exr"
    assert main(["render", str(scene), "-o", str(out), "--aov", "all", *SMALL]) == 0
    layers = {"albedo": "RGB", "normal": "XYZ", "depth": "Z", "variance": "RGB", "shape_id": "I", "material_id": "I"}
    layers["incidence"] = "I"
    names = {f"{layer}.{channel}" for layer, channels in layers.items() for channel in channels}
    assert set(OpenImageIO.ImageBuf(str(out)).spec().channelnames) == {*"RGBA", *names}


def test_same_seed_same_bytes(gpu: Any, scene: Path, tmp_path: Path) -> None:
    pictures = []
    for seed in ("7", "7", "8"):
        assert main(["render", str(scene), "-o", str(tmp_path / "out.npy"), "--seed", seed, *SMALL]) == 0
        pictures.append((tmp_path / "out.npy").read_bytes())
    assert pictures[0] == pictures[1] != pictures[2]


def test_stats_say_what_became_of_it(gpu: Any, scene: Path, tmp_path: Path) -> None:
    stats = tmp_path / "stats.json"
    assert main(["render", str(scene), "-o", str(tmp_path / "out.png"), "--stats", str(stats), *SMALL]) == 0
    told = json.loads(stats.read_text())
    assert (told["state"], told["samples"], told["warnings"]) == ("done", 4, [])
    assert told["noise"] > 0 and told["setup_s"] > 0 and told["elapsed_s"] > 0
    settings = told["settings"]
    assert (settings["width"], settings["max_samples"], settings["filter"]) == (16, 4, "blackman_harris")


@pytest.mark.parametrize("limit_s", [0.2, 0.5])
def test_time_limit_is_kept_and_ends_between_samples(
    gpu: Any, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit_s: float
) -> None:
    """On a machine where a sample of a pixel takes a microsecond, and nothing else takes time."""
    now_s, trace = 1000.0, passes.Passes._trace

    def traced(*arguments: Any, **named: Any) -> None:
        nonlocal now_s
        _, _, _, _, (width, height), _, samples, _ = arguments
        trace(*arguments, **named)
        now_s += width * height * samples * 1e-6

    clock = SimpleNamespace(monotonic=lambda: now_s, perf_counter=lambda: now_s)
    monkeypatch.setattr(passes.Passes, "_trace", traced)
    for module in (passes, worker_progress):
        monkeypatch.setattr(module, "time", clock)

    def rendered(name: str, limit: str, pixels: int = 64) -> tuple[dict[str, Any], bytes]:
        out, stats = tmp_path / f"{name}.npy", tmp_path / f"{name}.json"
        size = ["--set", f"width={pixels}", "--set", f"height={pixels}", "--set", limit]
        assert main(["render", str(scene), "-o", str(out), "--stats", str(stats), *size]) == 0
        return json.loads(stats.read_text()), out.read_bytes()

    told, picture = rendered("by-time", f"time_limit={limit_s}")
    assert told["reason"] == "time_limit" and told["settings"]["max_samples"] is None
    # A picture may end up to a sample before the limit; the contract allows a tenth of it and 0.1 s after it.
    assert 0.9 * limit_s <= told["elapsed_s"] <= 1.1 * limit_s + 0.1 and told["samples"] > 1
    assert rendered("by-samples", f"max_samples={told['samples']}")[1] == picture
    told, _ = rendered("first", "time_limit=0.001", 300)
    assert (told["reason"], told["samples"]) == ("time_limit", 1)
    assert any("first sample took" in warning for warning in told["warnings"]), told["warnings"]
    assert told["elapsed_s"] == pytest.approx(0.09, rel=0.2)


def test_target_noise_ends_a_render(gpu: Any, scene: Path, tmp_path: Path) -> None:
    stats = tmp_path / "stats.json"
    size = ["--set", "width=64", "--set", "height=64", "--set", "target_noise=0.01", "--set", "sampler=independent"]
    assert main(["render", str(scene), "-o", str(tmp_path / "out.png"), "--stats", str(stats), *size]) == 0
    assert 0 < json.loads(stats.read_text())["noise"] <= 0.01


def test_target_noise_ends_a_render_at_the_same_samples_however_fast_it_is(
    gpu: Any, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In turns of a slice and of many passes, and however rarely the noise is read in between."""
    found = []
    for turn_s, slice_s, pause in ((0.0, 1e-5, 0), (1.0, 0.1, 1000)):
        monkeypatch.setattr("service.worker.task_picture.SLICE_S", turn_s)
        monkeypatch.setattr("gpu.picture.tiles.SLICE_S", slice_s)
        monkeypatch.setattr("service.worker.progress.NOISE_PAUSE", pause)
        out, stats = tmp_path / f"{pause}.npy", tmp_path / f"{pause}.json"
        more = {"width": 64, "height": 64, "target_noise": 0.012, "sampler": "independent"}
        size = [part for name, value in more.items() for part in ("--set", f"{name}={value}")]
        assert main(["render", str(scene), "-o", str(out), "--stats", str(stats), *size]) == 0
        ended = json.loads(stats.read_text())
        found.append((np.load(out).tobytes(), ended["samples"], ended["noise"]))
    assert found[0] == found[1] and found[0][1] % 64 == 0


def test_interrupt_keeps_the_image_so_far(gpu: Any, scene: Path, tmp_path: Path) -> None:
    out, stats = tmp_path / "out.npy", tmp_path / "stats.json"
    command = [sys.executable, "-m", "service.cli", "render", str(scene), "-o", str(out), "--stats", str(stats)]
    ours, terminal = os.openpty()
    size = ["--set", "width=64", "--set", "height=48"]
    render = subprocess.Popen([*command, *size, "--set", "time_limit=60"], stderr=terminal)
    os.close(terminal)
    with open(ours, "rb", buffering=0) as seen:
        shown = seen.read(200)  # the first bar: there are samples
        render.send_signal(signal.SIGINT)
        assert render.wait(timeout=60) == 130
    assert b"samples" in shown and b"left" in shown
    assert np.load(out).shape == (48, 64, 4)
    assert json.loads(stats.read_text())["state"] == "cancelled"


def test_info_compiles_nothing_unless_told_to_measure(
    gpu: Any, scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: list[str] = []
    monkeypatch.setattr("gpu.kernels.cache.KernelCache.get", lambda self, entry, defines: compiled.append(entry))
    assert main(["info", str(scene)]) == 0
    said = capsys.readouterr().out
    assert "1 sphere" in said and " spheres" in said and "renderer" in said
    assert not compiled and "is saved" not in said
    assert main(["info", "--measure"]) == 2 and "--measure" in capsys.readouterr().err


def test_version_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--version"])
    assert end.value.code == 0 and capsys.readouterr().out == f"sunbox {version('sunbox')}\n"


def test_info_names_the_renderer_and_the_scene(
    gpu: Any, scene: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The kernel with everything takes a minute to compile: what is measured, `tests/gpu/test_flags.py` has."""
    cost = KernelCost(("spheres",), ("quads",), 100.0, 900.0, 1e-6, 2e-6)
    monkeypatch.setattr("service.worker.in_process.kernel_cost", lambda renderer, arrays: cost)
    assert main(["info", str(scene), "--measure"]) == 0
    said = capsys.readouterr()
    assert "1 sphere" in said.out and "is saved" in said.out and "compiling" in said.err
    assert main(["info"]) == 0
    rows = dict(line.split("  ", 1) for line in capsys.readouterr().out.splitlines())
    named = f"{gpu.info['vendor']}, {gpu.info['renderer']}"
    assert rows["renderer"].strip() == gpu.info["renderer"]
    assert named in [name.strip() for row, name in rows.items() if row.startswith("device ")]


def test_choices_are_those_of_the_renderer() -> None:
    assert (views.AOVS, views.CURVES) == (gpu_settings.AOVS, gpu_settings.TONE_MAPS)
    assert tuple(images.LAYERS) == views.AOVS and views.DEFAULT_TONE_MAP in views.TONE_MAPS


def test_configuration_mistake_is_named(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SUNBOX_MAX_PIXELS", "many")
    assert "SUNBOX_MAX_PIXELS" in refused(capsys, tmp_path, str(scene), "-o", str(tmp_path / "out.npy"))
    monkeypatch.delenv("SUNBOX_MAX_PIXELS")
    monkeypatch.setenv("SUNBOX_MAX_BODY", "5 parsecs")
    assert "SUNBOX_MAX_BODY: '5 parsecs' is no size" in refused(
        capsys, tmp_path, str(scene), "-o", str(tmp_path / "out.npy")
    )
    monkeypatch.delenv("SUNBOX_MAX_BODY")
    monkeypatch.setenv("SUNBOX_MAX_PIXELS", "100")
    assert "/width" in refused(capsys, tmp_path, str(scene), "-o", str(tmp_path / "out.npy"))


@pytest.mark.parametrize(
    ("written", "size"), [("512 MiB", 2**29), ("1.5GB", 1_500_000_000), ("2 tib", 2**41), ("1048576", 2**20)]
)
def test_sizes_may_have_units(written: str, size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SUNBOX_DATA_QUOTA", written)
    assert load_config().data_quota == size


def test_picture_says_what_it_was_made_from(gpu: Any, scene: Path, tmp_path: Path) -> None:
    for name in ("out.png", "out.exr"):
        assert main(["render", str(scene), "-o", str(tmp_path / name), "--seed", "3", *SMALL]) == 0
        told = read_metadata((tmp_path / name).read_bytes())
        assert told is not None and (told["samples"], told["settings"]["seed"]) == (4, 3)


def test_failure_leaves_the_old_picture(
    gpu: Any, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    out = tmp_path / "out.npy"
    out.write_bytes(b"old")
    monkeypatch.setattr("os.replace", full)
    assert main(["render", str(scene), "-o", str(out), *SMALL]) == 1
    assert "no space left" in capsys.readouterr().err
    assert out.read_bytes() == b"old" and {path.name for path in tmp_path.iterdir()} == {"out.npy", "scene.json"}


def test_missing_opengl_is_exit_1(scene: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "service.cli", "render", str(scene), "-o", str(tmp_path / "out.png")]
    environment = {**os.environ, "SUNBOX_DEVICE": "99"}
    answer = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert answer.returncode == 1 and answer.stderr.startswith("error: ") and "Traceback" not in answer.stderr
    assert not (tmp_path / "out.png").exists()


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_redrawn_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch) -> None:
    progress = Progress(samples=64, noise=0.0123, elapsed_s=60, eta_s=60)
    assert describe(progress) == "64 samples, noise 1.23 %, 1:00, 1:00 left"
    monkeypatch.setenv("COLUMNS", "100")
    terminal = Terminal()
    line = ProgressLine(terminal)
    line.show(progress)
    line.close()
    assert terminal.getvalue() == f"\r[{'#' * 12}{'.' * 12}] 64 samples, noise 1.23 %, 1:00, 1:00 left\n"
    log = io.StringIO()
    assert not ProgressLine(log).due()
    ProgressLine(log).show(progress)
    assert log.getvalue() == describe(progress) + "\n"
