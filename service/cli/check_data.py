"""`sunbox check-data [FOLDER]`: whether the data folder is sound. Exit code 1 where something was lost or damaged."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from service.cli import BadInput, configuration
from service.server.renders.store.check import check_renders
from service.server.storage.data_check import check


def run(arguments: argparse.Namespace) -> int:
    folder = Path(arguments.folder) if arguments.folder else configuration().data_dir
    try:
        report = check(folder)
        renders = check_renders(folder, report)
    except OSError as error:
        raise BadInput(f"{folder}: {error.strerror or error}") from None
    print(f"{folder}: {report.documents} documents, {report.assets} assets, {renders} renders")
    if report.server is not None:
        print(f"in use by a server: {report.server}")
    for note in report.notes:
        print(f"note: {note}")
    for fault in report.faults:
        print(f"fault: {fault}", file=sys.stderr)
    print(f"{len(report.faults)} faults" if report.faults else "sound")
    return 1 if report.faults else 0
