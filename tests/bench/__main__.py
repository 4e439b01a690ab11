"""`python -m tests.bench NAME`: a table; `-o` also writes the figures."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from service.cli import BadInput, Failed, configuration
from service.cli.bench import need_matplotlib, output_path, progress, refuse_quick_publishing, write_figures
from service.cli.documents import read_source, source_assets
from service.cli.program import exit_code
from service.document import presets
from tests.bench import gallery, soak, soak_restarts


def main(arguments: Sequence[str] | None = None) -> int:
    """The exit code. What went wrong is one line or a few on stderr, never a traceback."""
    parsed = parser().parse_args(arguments)
    return exit_code(lambda: parsed.run(parsed))


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser("python -m tests.bench", description="Benchmarks for the developers of Sunbox.")
    names = top.add_subparsers(required=True, metavar="NAME")

    def add(name: str, run: Any, text: str, figures: bool = True) -> Any:
        command = names.add_parser(name, help=text)
        command.set_defaults(run=run)
        if figures:
            command.add_argument("-o", "--output", metavar="FILE", help="also write the figures as JSON")
        return command

    command = add("compare", _compare, "this checkout beside an earlier revision")
    command.add_argument("--revision", default="HEAD", metavar="REV", help="that revision (default: HEAD)")
    command.add_argument("--runs", type=_count, default=5, metavar="N", help="pairs of processes (default: 5)")

    command = add("faults", _faults, "which faults of a list the tests find, put in one at a time, in an hour")
    text = "this fault, or those of this room, instead of all; may be given again"
    command.add_argument("--only", action="append", default=[], metavar="NAME", help=text)
    text = "also look with all tests of `make test` for what those near do not find: hours"
    command.add_argument("--whole", action="store_true", help=text)

    text = "what is to be learned of a GPU in ten minutes, part by part, into a folder"
    command = add("device", _device, text, False)
    command.add_argument("-o", "--output", metavar="FOLDER", required=True, help="for report.jsonl and its page")
    command.add_argument("--limit", type=_count, default=590, metavar="S", help="seconds in all (default: 590)")
    command.add_argument("--device", type=int, metavar="N", help="EGL's device N instead of the default")
    text = "this part instead of all; may be given again"
    command.add_argument("--part", action="append", default=[], metavar="NAME", help=text)
    text = "sizes and samples of this share, where a processor plays the device (default: 1)"
    command.add_argument("--scale", type=float, default=1.0, metavar="X", help=text)
    text = "render the pictures that others are compared with anew, by this device, and nothing else"
    command.add_argument("--reference", action="store_true", help=text)

    text = "the first frame after every slider's move and every change of scene, caches empty, in half an hour"
    command = add("frames", _frames, text)
    command.add_argument("--scenes", metavar="NAMES", help="only these built-in scenes, separated by commas")
    command.add_argument("--runs", type=_count, default=5, metavar="N", help="moves of a slider (default: 5)")

    add("drag", _drag, "how wrong the picture is in the first 200 ms after each step of a drag")

    add("hand", _hand, "from a slider to other pixels, in a browser")

    command = add("hemisphere", _hemisphere, "error of uniform directions beside Sunbox's, over samples and time")
    command.add_argument("--most", type=int, default=4096, metavar="N", help="samples 1, 4, 16 ... N (default: 4096)")
    command.add_argument("--figure", metavar="FILE", help="also draw the curves, as .png or .svg")

    command = add("peers", _peers, "error at equal time beside Mitsuba and Cycles")
    command.add_argument("--mitsuba", metavar="PYTHON", help="an interpreter that can import mitsuba")
    command.add_argument("--cycles", metavar="PYTHON", help="an interpreter that can import bpy")
    command.add_argument("--runs", type=_count, default=5, metavar="N", help="rounds a scene (default: 5)")

    command = add("profile", _profile, "where the time of a path goes on llvmpipe, scene by scene, in ten minutes")
    text = "this scene or model instead of the built-in ones; may be given again"
    command.add_argument("--file", action="append", default=[], metavar="FILE", help=text)
    text = "also compare the system's Mesa with the one unpacked in this folder (dpkg -x)"
    command.add_argument("--mesa", metavar="DIR", help=text)
    command.add_argument("--runs", type=_count, default=5, metavar="N", help="turns of the two drivers (default: 5)")
    command.add_argument("--publish", action="store_true", help="write tests/bench/profile/llvmpipe.*")
    command.add_argument("--quick", action="store_true", help="try it out on little; its figures mean nothing")

    command = add("registers", _registers, "registers and spills of kernels on an AMD GPU, without one, in minutes")
    text = "these scenes, or `ball of MATERIAL`, instead of all"
    command.add_argument("names", nargs="*", metavar="NAME", help=text)

    soak.add_options(add("soak", soak.run, "mixed clients for a long time while renderers are killed", False))
    soak_restarts.add_options(
        add("restarts", soak_restarts.run, "a thousand renders while the whole server is restarted", False)
    )
    gallery.add_options(add("gallery", gallery.run, "render the README's pictures again", False))
    command = add("standin", _standin, "how work is cut for a stand-in for a GPU, in simulated time", False)
    command.add_argument("--json", action="store_true", help="print JSON instead of a table")
    command = add("verdict", _verdict, "false alarms of a verdict over pairs that differ by noise alone")
    command.add_argument("--pairs", type=_count, default=1000, metavar="N", help="of each kind (default: 1000)")
    add("thumbnails", _thumbnails, "render the editor's pictures of the material presets again", False)
    return top


def _count(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r}: must be a whole number, at least 1")
    return int(text)


def _compare(arguments: argparse.Namespace) -> int:
    output = output_path(arguments.output)
    from tests.bench import compare

    try:
        document = compare.measure(compare.Options(arguments.revision, arguments.runs), progress)
    except compare.NoRevision as error:
        raise BadInput(f"--revision: {error}") from None
    print(compare.table(document))
    write_figures(output, document)
    return 0


def _faults(arguments: argparse.Namespace) -> int:
    output = output_path(arguments.output)
    from tests.bench import faults

    try:
        chosen = faults.named(arguments.only)
    except faults.UnknownFault as error:
        raise BadInput(f"--only {error}") from None
    rows = faults.measure(chosen, arguments.whole, progress)
    print(faults.table(rows))
    write_figures(output, rows)
    return 0 if faults.suffices(rows) else 1


def _frames(arguments: argparse.Namespace) -> int:
    known = [entry["name"] for entry in presets.names("scenes")]
    scenes = arguments.scenes.split(",") if arguments.scenes else known
    for name in scenes:
        if name not in known:
            raise BadInput(f"--scenes {name!r}: is not one of {', '.join(known)}")
    output = output_path(arguments.output)
    from tests.bench import first_frames

    document = first_frames.measure(scenes, progress, arguments.runs)
    print(first_frames.table(document))
    write_figures(output, document)
    return 0


def _device(arguments: argparse.Namespace) -> int:
    from tests.bench.device import pictures, report, run
    from tests.bench.device.part import Options

    for name in arguments.part:
        if name not in run.PARTS:
            raise BadInput(f"--part {name!r}: is not one of {', '.join(run.PARTS)}")
    if arguments.reference:
        pictures.write_reference(run.REFERENCE)
        return 0
    folder = Path(arguments.output)
    options = Options(arguments.device, 0.0, str(run.REFERENCE), str(folder), arguments.scale)
    try:
        run.measure(folder, arguments.limit, options, arguments.part, progress)
    except OSError as error:
        raise BadInput(f"--output {arguments.output!r}: {error.strerror or error}") from None
    page = report.page(folder / "report.jsonl")
    (folder / "report.md").write_text(page)
    print(page)
    return 0


def _drag(arguments: argparse.Namespace) -> int:
    output = output_path(arguments.output)
    from tests.bench import under_hand

    figures = under_hand.measure(progress)
    print(under_hand.table(figures))
    write_figures(output, figures)
    return 0


def _hand(arguments: argparse.Namespace) -> int:
    output = output_path(arguments.output)
    from tests.bench import hand

    try:
        figures = hand.measure()
    except ImportError:
        raise Failed("playwright is not installed: it comes with the extra `dev`") from None
    print(hand.table(figures))
    write_figures(output, figures)
    return 0


def _hemisphere(arguments: argparse.Namespace) -> int:
    if arguments.most < 4:
        raise BadInput(f"--most {arguments.most}: at least 4 samples make a curve")
    output, figure = output_path(arguments.output), output_path(arguments.figure)
    if figure and figure.suffix.lower() not in (".png", ".svg"):
        raise BadInput(f"--figure {arguments.figure!r}: must end in .png or .svg")
    if figure:
        need_matplotlib("--figure")
    from gpu import GpuError
    from tests.bench import hemisphere

    try:
        document = hemisphere.measure(arguments.most, progress)
    except GpuError as error:
        raise Failed(str(error)) from None
    print(hemisphere.table(document))
    write_figures(output, document)
    if figure:
        hemisphere.figure(document, figure)
    return 0


def _standin(arguments: argparse.Namespace) -> int:
    from tests.bench import standin

    document = standin.measure()
    print(json.dumps(document) if arguments.json else standin.table(document))
    return 0


def _verdict(arguments: argparse.Namespace) -> int:
    output = output_path(arguments.output)
    from gpu import GpuError
    from tests.bench import verdict

    try:
        rows = verdict.run(arguments.pairs, progress)
    except GpuError as error:
        raise Failed(str(error)) from None
    print(verdict.table(rows))
    write_figures(output, rows)
    return 0


def _peers(arguments: argparse.Namespace) -> int:
    mitsuba, cycles = (Path(name) if name else None for name in (arguments.mitsuba, arguments.cycles))
    if not mitsuba and not cycles:
        text = "name an interpreter that can import mitsuba, or one that can import bpy, or both"
        raise BadInput(f"--mitsuba PYTHON, --cycles PYTHON: {text}")
    output = output_path(arguments.output)
    from tests.bench import peers

    try:
        document = peers.measure(peers.Options(mitsuba, cycles, arguments.runs), progress)
    except (OSError, subprocess.CalledProcessError) as error:
        raise Failed(f"a renderer could not be run: {error}") from None
    print(peers.table(document["scenes"]))
    write_figures(output, document)
    return 0


def _profile(arguments: argparse.Namespace) -> int:
    refuse_quick_publishing(arguments)
    output = output_path(arguments.output)
    from gpu import GpuError
    from tests.bench.profile import drivers, page, run, scenes

    with ExitStack() as stack:
        subjects = scenes.built_in() if not arguments.file else []
        for name in arguments.file:
            source = read_source(Path(name), [], configuration())
            assets = stack.enter_context(source_assets(source, [], configuration()))
            subjects.append(scenes.of_file(source.path.name, source.document, assets))
        options = run.Options(Path(arguments.mesa) if arguments.mesa else None, arguments.runs, arguments.quick)
        try:
            document = run.measure(subjects, options, progress)
        except drivers.NoMesa as error:
            raise BadInput(f"--mesa {error}") from None
        except (GpuError, run.NotSoftware, EOFError) as error:
            raise Failed(str(error) or "one of the drivers could not render") from None
    print(page.section(document))
    write_figures(output, document)
    if arguments.publish:
        page.publish(document)
    return 0


def _registers(arguments: argparse.Namespace) -> int:
    output = output_path(arguments.output)
    from tests.bench import radv, registers

    known = [name for name, _ in registers.documents()]
    for name in arguments.names:
        if name not in known:
            raise BadInput(f"{name!r}: is not one of {', '.join(known)}")
    try:
        rows = registers.measure(progress, arguments.names)
    except (registers.NotCompiled, radv.NoRadv) as error:
        raise Failed(str(error)) from None
    print(registers.table(rows))
    write_figures(output, rows)
    return 0


def _thumbnails(arguments: argparse.Namespace) -> int:
    from tests.bench import thumbnails

    return thumbnails.run()


if __name__ == "__main__":
    sys.exit(main())
