"""`sunbox export SCENE.json -o OUT.glb`: a scene as a file for another program. What is lost is told on stderr."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from service.cli import BadInput, configuration, files
from service.cli.documents import read_source, refusals, source_assets


def run(arguments: argparse.Namespace) -> int:
    from service.exports import FORMATS, format_of_ending

    name = format_of_ending(arguments.output)
    if name is None:
        endings = ", ".join(f".{each.ending}" for each in FORMATS.values() if each.has_scenes)
        raise BadInput(f"-o {arguments.output!r}: must end in {endings}")
    target = files.writable(Path(arguments.output))
    config = configuration()
    source = read_source(Path(arguments.input), arguments.asset_root, config, arguments.entry)
    with source_assets(source, arguments.asset_root, config) as assets, refusals(source.pointer):
        exported = FORMATS[name].scene_writer(source.scene, assets, config)
    for path, data in exported.beside.items():
        files.make_folder((target.parent / path).parent)
        files.write(target.parent / path, data)
    files.write(target, exported.data)
    for loss in exported.losses.document(source.pointer):
        print(f"lost: {loss['pointer']}: {loss['detail']}", file=sys.stderr)
    return 0
