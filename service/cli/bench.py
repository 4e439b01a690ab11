"""`sunbox bench speed | gpu | tradeoff | seeds | scale`: a table; `-o` also writes the figures.

The benchmarks that developers alone need are not part of the product: `python -m tests.bench`.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from service.cli import BadInput, Failed, files


def run(arguments: argparse.Namespace) -> int:
    if arguments.runs < 1:
        raise BadInput(f"--runs {arguments.runs}: at least one is needed")
    measures = {
        "speed": _speed,
        "gpu": _gpu,
        "tradeoff": _tradeoff,
        "seeds": _seeds,
        "scale": _scale,
    }
    return measures[arguments.what](arguments)


def _speed(arguments: argparse.Namespace) -> int:
    given = [Path(name) if name else None for name in (arguments.mesh, arguments.environment)]
    for path in filter(None, given):
        files.read(path)
    output = output_path(arguments.output)
    from gpu import GpuError
    from service.bench import speed

    try:
        document = speed.measure(speed.Options(arguments.runs, *given), progress)
    except GpuError as error:
        raise Failed(str(error)) from None
    print(speed.table(document))
    write_figures(output, document)
    return 0


def _gpu(arguments: argparse.Namespace) -> int:
    if not 0 < arguments.seconds < math.inf:
        raise BadInput(f"--seconds {arguments.seconds:g}: must be above 0")
    output = output_path(arguments.output)
    from service.bench.device import run, stage, table

    options = stage.Options(arguments.seconds, arguments.device)
    document = run.measure(options, progress)
    print(table.table(document))
    write_figures(output, document)
    if document["device"] is None:
        raise Failed("the device could not be reached; the table says why")
    return 0


def _tradeoff(arguments: argparse.Namespace) -> int:
    refuse_quick_publishing(arguments)
    output = output_path(arguments.output)
    from gpu import GpuError
    from service.bench import tradeoff, tradeoff_report

    try:
        options = tradeoff.Options(quick=arguments.quick)
        document = tradeoff.measure(options, progress)
    except ImportError as error:
        raise Failed(f"the price list needs the extra `bench`: {error}") from None
    except GpuError as error:
        raise Failed(str(error)) from None
    print(tradeoff_report.markdown(document))
    write_figures(output, document)
    if arguments.publish:
        tradeoff_report.publish(document)
    return 0


def _seeds(arguments: argparse.Namespace) -> int:
    refuse_quick_publishing(arguments)
    if arguments.publish:
        need_matplotlib("--publish")
    output = output_path(arguments.output)
    from gpu import GpuError
    from service.bench.seeds import page, report, run

    try:
        document, pictures = run.measure(arguments.quick, progress)
    except GpuError as error:
        raise Failed(str(error)) from None
    print(page.markdown(document))
    write_figures(output, document)
    if arguments.publish:
        report.publish(document, pictures)
    return 0


def _scale(arguments: argparse.Namespace) -> int:
    most = arguments.simulate
    if most is not None and not 1 <= most <= 1024:
        raise BadInput(f"--simulate {most}: from 1 to 1024 renderers can be simulated")
    if arguments.publish and (most is None or arguments.quick):
        raise BadInput("--publish: needs --simulate N, and not --quick, whose figures mean nothing")
    if arguments.publish:
        need_matplotlib("--publish")
    output = output_path(arguments.output)
    from gpu import GpuError
    from service.bench import scale, scale_report

    try:
        document = {"measured": scale.measure(scale.Options(arguments.runs, arguments.quick), progress)}
        print(scale_report.measured_table(document["measured"]))
        if most is not None:
            document["simulated"] = scale.simulate(most, arguments.quick, progress)
            print(scale_report.speedup_table(document["simulated"]))
    except (GpuError, scale.NotMeasured) as error:
        raise Failed(str(error)) from None
    write_figures(output, document)
    if arguments.publish:
        scale_report.publish(**document)
    return 0


def refuse_quick_publishing(arguments: argparse.Namespace) -> None:
    if arguments.publish and arguments.quick:
        raise BadInput("--publish --quick: figures that mean nothing are not for publishing")


def need_matplotlib(option: str) -> None:
    """Raises BadInput where it is not installed."""
    if find_spec("matplotlib") is None:
        raise BadInput(f"{option}: needs matplotlib, which `pip install 'sunbox[bench]'` brings")


def progress(line: str) -> None:
    print(line, file=sys.stderr)


def write_figures(output: Path | None, document: Any) -> None:
    if output:
        files.write(output, (json.dumps(document, indent=1) + "\n").encode())


def output_path(name: str | None) -> Path | None:
    """The path of the JSON. Its folder is made: `make bench` names one that a fresh checkout lacks."""
    if name is None:
        return None
    Path(name).parent.mkdir(parents=True, exist_ok=True)
    return files.writable(Path(name))
