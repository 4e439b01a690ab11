"""The commands, a module each: `run(arguments) -> exit code`; the errors that end them early, and the configuration.

__main__       `python -m service.cli`
program        the command line: which commands there are, and the exit code
render         a picture of a document, into a file
renders        the renders of a server: submitted, listed, waited for, fetched, cancelled
sweep          a scene with other values, on a contact sheet
turntable      a turn of the camera, as an animation
compare        whether two scenes or pictures differ beyond noise
test           the scenes of a folder beside those of another
comparing      what these two compare, and what they say of it
api            requests to a server, or to one of its own for as long as a command needs it
serve          the editor and the API
bsdf           curves of a material's BSDF, into a table or a figure
bsdf_curves    the curves of each kind
bsdf_figure    the figures, drawn by matplotlib
import         a model as a document with files beside it
export         a scene as a file for another program
info           what a scene contains, and what would render it here
callback_secret  the secrets that sign callbacks
warm           kernels, compiled before a server needs them
mcp            tools for agents
check_data     whether the data folder is sound
bench          the benchmarks
health         the container's health check
assets         the assets of a scene, and their ids
documents      documents and settings, from files and from `--set`
files          files that are read, and written whole or not at all
models         models as the importers read them
neighbours     the files that a model on disk refers to
progress       how far a render is, on stderr
tracing        one render in this process
local          renders in a Python program's own process: `sunbox.render`
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from service.config import Config


class CommandError(Exception):
    """Ends a command with `exit_code` and these lines on stderr."""

    exit_code = 1

    def __init__(self, *lines: str) -> None:
        super().__init__("; ".join(lines))
        self.lines = lines


class Failed(CommandError):
    """The machine could not do it: no OpenGL, no memory, no space."""


class BadInput(CommandError):
    """The input was wrong: each line names the place and says what would be right."""

    exit_code = 2


def configuration(**given: Any) -> Config:
    """`given` (where not None) over the environment's SUNBOX_*. Raises BadInput naming each bad variable."""
    from service.config import ConfigError, load_config

    try:
        return load_config(**given)
    except ConfigError as error:
        raise BadInput(str(error)) from None
