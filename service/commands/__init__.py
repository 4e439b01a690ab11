"""The commands, a module each: `run(arguments) -> exit code`. The errors that end them early are here."""

from __future__ import annotations


class CommandError(Exception):
    """Ends a command with `exit_code` and these lines on stderr."""

    exit_code = 1

    def __init__(self, *lines: str) -> None:
        super().__init__("; ".join(lines))
        self.lines = lines


class Failed(CommandError):
    """The machine could not do it: no OpenGL, no memory, no space."""


class BadInput(CommandError):
    """What was asked for was wrong: each line names the place and says what would be right."""

    exit_code = 2
