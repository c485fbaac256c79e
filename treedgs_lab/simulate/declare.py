"""Settings of ``simulate-plot`` in a line each."""

from __future__ import annotations

from typing import Any

from treedgs_geo.core.settings import param


def number(default: float | None, minimum: float, maximum: float, unit: str, help: str, dialog: bool = True) -> Any:
    """A number with its limits and unit; ``None``: as the preset says."""
    return param(default, help=help, minimum=minimum, maximum=maximum, unit=unit, dialog=dialog)


def count(default: int | None, minimum: int, maximum: int, help: str, unit: str = "", dialog: bool = True) -> Any:
    """A whole number with its limits; ``None``: as the preset says."""
    return param(default, help=help, minimum=minimum, maximum=maximum, unit=unit, dialog=dialog)


def flag(help: str) -> Any:
    """Something that is off unless asked for."""
    return param(False, help=help)
