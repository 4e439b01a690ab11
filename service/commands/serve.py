"""`sunbox serve`: the editor and the API, until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse
import logging

from service.commands.configuration import configuration


def run(arguments: argparse.Namespace) -> int:
    config = configuration(host=arguments.host, port=arguments.port)
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    from service import app

    return app.run(config)
