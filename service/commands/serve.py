"""`sunbox serve`: the editor and the API, until SIGINT or SIGTERM."""

from __future__ import annotations

import argparse

from service.commands.configuration import configuration


def run(arguments: argparse.Namespace) -> int:
    config = configuration(host=arguments.host, port=arguments.port)
    from service import app, logs

    logs.configure(config.log_format, config.log_level, queued=True, secrets=config.api_key)

    return app.run(config)
