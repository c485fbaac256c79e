"""Settings of ``simulate-plot`` in a line each: of the command line and job files, and in no dialog unless said."""

from __future__ import annotations

from typing import Any

from treedgs_geo.core.settings import param


def number(default: float | None, minimum: float, maximum: float, unit: str, help: str, **more: Any) -> Any:
    """A number with its limits and unit; ``None``: as the preset says."""
    limits = {"minimum": minimum, "maximum": maximum, "unit": unit}
    return param(default, help=help, **{"dialog": False, **limits, **more})


def count(default: int | None, minimum: int, maximum: int, help: str, **more: Any) -> Any:
    """A whole number with its limits; ``None``: as the preset says."""
    return param(default, help=help, **{"dialog": False, "minimum": minimum, "maximum": maximum, **more})


def flag(help: str, **more: Any) -> Any:
    """Something that is off unless asked for."""
    return param(False, help=help, **{"dialog": False, **more})
