"""`sunbox bench tradeoff | seeds | scale`: benchmarks that write pages of the source."""

from __future__ import annotations

import argparse

from gpu import GpuError
from service.cli import BadInput, Failed
from service.cli.bench import need_matplotlib, output_path, progress, refuse_quick_publishing, write_figures


def run(arguments: argparse.Namespace) -> int:
    """The exit code of `sunbox bench` with these arguments."""
    return {"tradeoff": _tradeoff, "seeds": _seeds, "scale": _scale}[arguments.what](arguments)


def _tradeoff(arguments: argparse.Namespace) -> int:
    refuse_quick_publishing(arguments)
    output = output_path(arguments.output)
    from tests.bench import tradeoff, tradeoff_report

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
    from tests.bench.seeds import page, report, run

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
    from tests.bench import scale, scale_report

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
