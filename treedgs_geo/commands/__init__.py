"""One module per verb: its settings, its function, its :class:`~treedgs_geo.core.command.Command`.

Command modules import heavy libraries only inside their functions, so that ``--help`` is instant.
"""

from __future__ import annotations

import importlib

from ..core.command import Command

#: Verb -> module in this package, in the order of the work.
MODULES = {
    "photos-to-dbh": "photos_to_dbh",
    "pointcloud-to-dbh": "pointcloud_to_dbh",
    "campaign": "campaign",
    "geotag": "geotag",
    "reconstruct": "reconstruct",
    "terrain": "terrain",
    "fit-gaussians": "fit_gaussians",
    "sample-surface": "sample_surface",
    "segment-stems": "segment_stems",
    "measure-dbh": "measure_dbh",
    "match-plots": "match_plots",
    "evaluate": "evaluate",
    "stand-table": "stand_table",
    "benchmark": "benchmark",
    "simulate-plot": "simulate_plot",
    "doctor": "doctor",
}


def get_command(name: str) -> Command:
    """Import one verb's module and return its command."""
    return importlib.import_module(f".{MODULES[name]}", __package__).COMMAND


def all_commands() -> list[Command]:
    """Every verb, in order."""
    return [get_command(name) for name in MODULES]
