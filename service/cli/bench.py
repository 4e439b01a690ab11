"""`sunbox bench speed | gpu | tradeoff | seeds | scale`: a table; `-o` also writes the figures.

The last three write pages of the source and need a checkout, as do those that developers alone need: `python -m
tests.bench`.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from service.cli import BadInput, Failed, files

ROOT = Path(__file__).parents[2]


def run(arguments: argparse.Namespace) -> int:
    if arguments.runs < 1:
        raise BadInput(f"--runs {arguments.runs}: at least one is needed")
    measures = {
        "speed": _speed,
        "gpu": _gpu,
    }
    return measures.get(arguments.what, _laboratory)(arguments)


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


def _laboratory(arguments: argparse.Namespace) -> int:
    """The maintainers' benchmarks, which write pages of the source, are not installed."""
    if not (ROOT / "tests" / "bench" / "laboratory.py").is_file():
        raise BadInput(f"bench {arguments.what}: needs a checkout of the source; `speed` and `gpu` do not")
    code: int = import_module("tests.bench.laboratory").run(arguments)
    return code


def refuse_quick_publishing(arguments: argparse.Namespace) -> None:
    if arguments.publish and arguments.quick:
        raise BadInput("--publish --quick: figures that mean nothing are not for publishing")


def need_matplotlib(option: str) -> None:
    """Raises BadInput where it is not installed."""
    if find_spec("matplotlib") is None:
        raise BadInput(
            f"{option}: needs matplotlib, which the extra `bench` brings: "
            "pip install '.[bench]' in a checkout of Sunbox"
        )


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
