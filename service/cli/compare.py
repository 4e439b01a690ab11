"""`sunbox compare`: whether two scenes or pictures differ beyond noise; the exit code says so."""

from __future__ import annotations

import argparse
from pathlib import Path

from service.cli import BadInput, Failed, comparing, files
from service.cli.api import server_or_local


def run(arguments: argparse.Namespace) -> int:
    from service.cli import configuration

    comparing.check_confidence(arguments)
    output = None if arguments.output is None else files.writable(Path(arguments.output))
    if output is not None and output.suffix.lower() != ".png":
        raise BadInput(f"-o {arguments.output!r}: must end in .png")
    config = configuration()
    a, b = (comparing.read_input(name, arguments, config) for name in (arguments.a, arguments.b))
    settings = comparing.chosen(a, b, arguments, config)
    try:
        with server_or_local(arguments.server) as client:
            found = comparing.verdict(client, a, b, settings, arguments)
        if output is not None and found.map is not None:
            files.write(output, found.map)
    except Failed as error:
        raise comparing.could_not(error) from None
    print(comparing.said(found))
    return comparing.DIFFERENT if found.different else comparing.SAME
