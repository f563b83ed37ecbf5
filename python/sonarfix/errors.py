"""Exceptions, with the text of the command ``sonarfix``."""

from __future__ import annotations

from typing import NamedTuple


class SonarfixError(Exception):
    """Any error of this package."""


class InputError(SonarfixError, ValueError):
    """An argument that is not accepted; nothing has changed."""


class Mistake(NamedTuple):
    """A mistake in a file."""

    file: str
    """The file."""
    line: int | None
    """The line, from 1; None if the file could not be read."""
    key: str
    """The full key, for example ``robot.sonar.cone``; empty if the text is not TOML."""
    message: str
    """What is wrong, and what to do."""


class FileError(SonarfixError, ValueError):
    """Mistakes in a file, one a line: ``paper.toml:45: robot.sonar.cone: must be …``."""

    def __init__(self, text: str, mistakes: list[tuple[str, int | None, str, str]] | None = None) -> None:
        super().__init__(text, mistakes)
        self.mistakes: list[Mistake] = [Mistake(*mistake) for mistake in mistakes or []]

    def __str__(self) -> str:
        return str(self.args[0])


class SimulationError(SonarfixError, RuntimeError):
    """A run that failed."""


class RecordingError(SonarfixError, ValueError):
    """A recording that cannot be used."""


class ConnectionFailed(SonarfixError, OSError):  # noqa: N818 (as ConnectionError of Python)
    """A robot that does not answer, or refuses a command."""
