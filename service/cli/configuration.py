"""The configuration, whose mistakes are errors in the command's input."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from service.cli import BadInput

if TYPE_CHECKING:
    from service.config import Config


def configuration(**given: Any) -> Config:
    """`given` (where not None) over the environment's SUNBOX_*. Raises BadInput naming each bad variable."""
    from service.config import ConfigError, load_config

    try:
        return load_config(**given)
    except ConfigError as error:
        raise BadInput(str(error)) from None
