"""`sunbox turntable`: the camera goes round the scene; an animation of that."""

from __future__ import annotations

import argparse
from pathlib import Path

from service.cli import files
from service.cli.sweep import batch_file, ending

FORMATS = {".webp": "webp", ".png": "apng", ".apng": "apng", ".gif": "gif", ".avif": "avif", ".mp4": "mp4"}


def run(arguments: argparse.Namespace) -> int:
    path = Path(arguments.output)
    format = ending(path, FORMATS | {".zip": "zip"})
    output = files.writable(path)
    over = [{"turntable": arguments.frames, "degrees": arguments.degrees}]
    if format == "zip":
        batch_file(arguments, over, output, lambda batch: batch.zip(exposure=arguments.exposure))
    else:
        fps, width, exposure = arguments.fps, arguments.width, arguments.exposure
        batch_file(arguments, over, output, lambda batch: batch.animation(format, fps, width, exposure=exposure))
    return 0
