"""The exception tree. Each message is one sentence: file, what was found, what was expected, what to do."""

from __future__ import annotations

from typing import Any


class TreeDGSError(Exception):
    """A problem that the user can correct; its text is one sentence. ``exit_code`` is what the command line returns.

    Examples:
        >>> import treedgs_geo as tg
        >>> try:
        ...     tg.read_cloud(work / "missing.laz")
        ... except tg.TreeDGSError as problem:
        ...     print(type(problem).__name__, problem.exit_code)
        InputError 2
    """

    exit_code = 2


class InputError(TreeDGSError):
    """A file, folder or value that was given cannot be used."""


class CRSError(InputError):
    """A coordinate reference system is missing, geographic, in the wrong unit or contradictory."""


class GeotagError(InputError):
    """Camera positions are missing, belong to other photos or contradict them."""


class ReconstructionError(TreeDGSError):
    """Structure from motion failed or disagrees with what is known about the cameras."""


class OutputError(TreeDGSError):
    """A result cannot be written."""


class MemoryShortage(TreeDGSError):
    """The job needs more memory than this process may have."""

    exit_code = 4


class MissingComponentError(TreeDGSError):
    """A library or program that this step needs is not installed."""

    exit_code = 3


class Incomplete(TreeDGSError):
    """The result was written, but a part of what was asked for is missing. ``result``: what the verb returns."""

    exit_code = 5

    def __init__(self, sentence: str, result: dict[str, Any]) -> None:
        super().__init__(sentence)
        self.result = result


class TreeDGSWarning(UserWarning):
    """Something recoverable that may have cost accuracy or trees; where a reporter is given, that hears it instead.

    Examples:
        >>> import warnings
        >>> import treedgs_geo as tg
        >>> warnings.simplefilter("ignore", tg.TreeDGSWarning)
    """


class Cancelled(KeyboardInterrupt):
    """The user asked to stop. Not an ``Exception``: no stage may swallow it."""

    exit_code = 130
