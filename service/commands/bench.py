"""`sunbox bench speed | gpu | frames | compare | peers | hemisphere | hand | tradeoff | seeds | scale | profile`:
a table; `-o` keeps the figures."""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path

from service.commands import BadInput, Failed, files


def run(arguments: argparse.Namespace) -> int:
    if arguments.runs < 1:
        raise BadInput(f"--runs {arguments.runs}: at least one is needed")
    measures = {
        "speed": _speed,
        "gpu": _gpu,
        "frames": _frames,
        "compare": _compare,
        "peers": _peers,
        "hemisphere": _hemisphere,
        "hand": _hand,
        "tradeoff": _tradeoff,
        "seeds": _seeds,
        "scale": _scale,
        "profile": _profile,
    }
    return measures[arguments.what](arguments)


def _hemisphere(arguments: argparse.Namespace) -> int:
    if arguments.most < 4:
        raise BadInput(f"--most {arguments.most}: at least 4 samples make a curve")
    output, figure = _output(arguments.output), _output(arguments.figure)
    if figure and figure.suffix.lower() not in (".png", ".svg"):
        raise BadInput(f"--figure {arguments.figure!r}: must end in .png or .svg")
    if figure and find_spec("matplotlib") is None:
        raise BadInput("--figure: needs matplotlib, which `pip install 'sunbox[bench]'` brings")
    from gpu import GpuError
    from service.bench import hemisphere

    try:
        document = hemisphere.measure(arguments.most, lambda what: print(what, file=sys.stderr))
    except GpuError as error:
        raise Failed(str(error)) from None
    print(hemisphere.table(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    if figure:
        hemisphere.figure(document, figure)
    return 0


def _hand(arguments: argparse.Namespace) -> int:
    output = _output(arguments.output)
    from service.bench import hand

    try:
        figures = hand.measure()
    except ImportError:
        raise Failed("playwright is not installed: it comes with the extra `dev`") from None
    print(hand.table(figures))
    if output:
        files.write(output, (json.dumps(figures, indent=1) + "\n").encode())
    return 0


def _speed(arguments: argparse.Namespace) -> int:
    given = [Path(name) if name else None for name in (arguments.mesh, arguments.environment)]
    for path in filter(None, given):
        files.read(path)
    output = _output(arguments.output)
    from gpu import GpuError
    from service.bench import speed

    try:
        document = speed.measure(speed.Options(arguments.runs, *given), lambda what: print(what, file=sys.stderr))
    except GpuError as error:
        raise Failed(str(error)) from None
    print(speed.table(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    return 0


def _gpu(arguments: argparse.Namespace) -> int:
    if not 0 < arguments.seconds < math.inf:
        raise BadInput(f"--seconds {arguments.seconds:g}: must be above 0")
    output = _output(arguments.output)
    from service.bench.device import run, stage, table

    options = stage.Options(arguments.seconds, arguments.device)
    document = run.measure(options, lambda what: print(what, file=sys.stderr))
    print(table.table(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    if document["device"] is None:
        raise Failed("the device could not be reached; the table says why")
    return 0


def _frames(arguments: argparse.Namespace) -> int:
    from service import presets

    known = [entry["name"] for entry in presets.names("scenes")]
    scenes = arguments.scenes.split(",") if arguments.scenes else known
    for name in scenes:
        if name not in known:
            raise BadInput(f"--scenes {name!r}: is not one of {', '.join(known)}")
    output = _output(arguments.output)
    from service.bench import first_frames

    document = first_frames.measure(scenes, lambda what: print(what, file=sys.stderr), arguments.runs)
    print(first_frames.table(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    return 0


def _compare(arguments: argparse.Namespace) -> int:
    output = _output(arguments.output)
    from service.bench import compare

    try:
        options = compare.Options(arguments.revision, arguments.runs)
        document = compare.measure(options, lambda what: print(what, file=sys.stderr))
    except compare.NoRevision as error:
        raise BadInput(f"--revision: {error}") from None
    print(compare.table(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    return 0


def _peers(arguments: argparse.Namespace) -> int:
    mitsuba, cycles = (Path(name) if name else None for name in (arguments.mitsuba, arguments.cycles))
    if not mitsuba and not cycles:
        text = "name an interpreter that can import mitsuba, or one that can import bpy, or both"
        raise BadInput(f"--mitsuba PYTHON, --cycles PYTHON: {text}")
    output = _output(arguments.output)
    from service.bench import peers

    try:
        options = peers.Options(mitsuba, cycles, arguments.runs)
        document = peers.measure(options, lambda what: print(what, file=sys.stderr))
    except (OSError, subprocess.CalledProcessError) as error:
        raise Failed(f"a renderer could not be run: {error}") from None
    print(peers.table(document["scenes"]))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    return 0


def _tradeoff(arguments: argparse.Namespace) -> int:
    if arguments.publish and arguments.quick:
        raise BadInput("--publish --quick: figures that mean nothing are not for publishing")
    output = _output(arguments.output)
    from gpu import GpuError
    from service.bench import tradeoff, tradeoff_report

    try:
        options = tradeoff.Options(quick=arguments.quick)
        document = tradeoff.measure(options, lambda what: print(what, file=sys.stderr))
    except ImportError as error:
        raise Failed(f"the price list needs the extra `bench`: {error}") from None
    except GpuError as error:
        raise Failed(str(error)) from None
    print(tradeoff_report.markdown(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    if arguments.publish:
        tradeoff_report.publish(document)
    return 0


def _seeds(arguments: argparse.Namespace) -> int:
    if arguments.publish and arguments.quick:
        raise BadInput("--publish --quick: figures that mean nothing are not for publishing")
    if arguments.publish and find_spec("matplotlib") is None:
        raise BadInput("--publish: needs matplotlib, which `pip install 'sunbox[bench]'` brings")
    output = _output(arguments.output)
    from gpu import GpuError
    from service.bench.seeds import page, report, run

    try:
        document, pictures = run.measure(arguments.quick, lambda what: print(what, file=sys.stderr))
    except GpuError as error:
        raise Failed(str(error)) from None
    print(page.markdown(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    if arguments.publish:
        report.publish(document, pictures)
    return 0


def _scale(arguments: argparse.Namespace) -> int:
    most = arguments.simulate
    if most is not None and not 1 <= most <= 1024:
        raise BadInput(f"--simulate {most}: from 1 to 1024 renderers can be simulated")
    if arguments.publish and (most is None or arguments.quick):
        raise BadInput("--publish: needs --simulate N, and not --quick, whose figures mean nothing")
    if arguments.publish and find_spec("matplotlib") is None:
        raise BadInput("--publish: needs matplotlib, which `pip install 'sunbox[bench]'` brings")
    output = _output(arguments.output)
    from gpu import GpuError
    from service.bench import scale, scale_report

    def told(what: str) -> None:
        print(what, file=sys.stderr)

    try:
        document = {"measured": scale.measure(scale.Options(arguments.runs, arguments.quick), told)}
        print(scale_report.measured_table(document["measured"]))
        if most is not None:
            document["simulated"] = scale.simulate(most, arguments.quick, told)
            print(scale_report.speedup_table(document["simulated"]))
    except (GpuError, scale.NotMeasured) as error:
        raise Failed(str(error)) from None
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    if arguments.publish:
        scale_report.publish(**document)
    return 0


def _profile(arguments: argparse.Namespace) -> int:
    if arguments.publish and arguments.quick:
        raise BadInput("--publish --quick: figures that mean nothing are not for publishing")
    output = _output(arguments.output)
    from gpu import GpuError
    from service.bench.profile import drivers, page, run, scenes
    from service.commands.configuration import configuration
    from service.commands.documents import read_source, source_assets

    with ExitStack() as stack:
        subjects = scenes.built_in() if not arguments.file else []
        for name in arguments.file:
            source = read_source(Path(name), [], configuration())
            assets = stack.enter_context(source_assets(source, [], configuration()))
            subjects.append(scenes.of_file(source.path.name, source.document, assets))
        options = run.Options(Path(arguments.mesa) if arguments.mesa else None, arguments.runs, arguments.quick)
        try:
            document = run.measure(subjects, options, lambda what: print(what, file=sys.stderr))
        except drivers.NoMesa as error:
            raise BadInput(f"--mesa {error}") from None
        except (GpuError, run.NotSoftware, EOFError) as error:
            raise Failed(str(error) or "one of the drivers could not render") from None
    print(page.section(document))
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())
    if arguments.publish:
        page.publish(document)
    return 0


def _output(name: str | None) -> Path | None:
    """Where the JSON goes. Its folder is made: `make bench` names one that a fresh checkout lacks."""
    if name is None:
        return None
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    return files.writable(Path(name))
