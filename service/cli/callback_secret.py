"""`sunbox callback-secret`: the secrets that sign callbacks, for those who receive them."""

from __future__ import annotations

import argparse

from service.cli import CommandError, configuration
from service.problems import Unavailable
from service.server.callbacks.signing import secrets_of


def run(arguments: argparse.Namespace) -> int:
    """The one of the data folder is made where there is none."""
    try:
        print("\n".join(secrets_of(configuration())))
    except Unavailable as error:
        raise CommandError(error.detail) from None
    return 0
