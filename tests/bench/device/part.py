"""`python -m tests.bench.device.part NAME FOLDER OPTIONS`: one part, whose rows go to FOLDER/report.jsonl."""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

Row = dict[str, Any]


@dataclass(frozen=True)
class Options:
    """What all parts are told. `device` is a number of EGL's, None its default; `seconds` is the part's share of the
    time; `reference` is the file with llvmpipe's pictures."""

    device: int | None
    seconds: float
    reference: str
    folder: str  # of the report
    scale: float = 1.0  # of sizes and samples: below 1 where a processor plays the device


def tell(folder: Path, part: str, row: Row) -> None:
    """Append a row; one write, so that parts of one process after another never mix lines."""
    line = json.dumps({"part": part, **row}, allow_nan=True) + "\n"
    handle = os.open(folder / "report.jsonl", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        os.write(handle, line.encode())
        os.fsync(handle)
    finally:
        os.close(handle)


def main(name: str, folder: Path, options: Options) -> None:
    rows: Iterator[Row] = importlib.import_module(f"tests.bench.device.{name}").rows(options)
    began = time.perf_counter()
    for row in rows:
        tell(folder, name, {**row, "at_s": round(time.perf_counter() - began, 3)})


def command(name: str, folder: Path, options: Options) -> list[str]:
    """The command that runs a part."""
    text = json.dumps(asdict(options))
    return [sys.executable, "-m", "tests.bench.device.part", name, str(folder), text]


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), Options(**json.loads(sys.argv[3])))
