"""One module per verb: its settings, its function, its :class:`~treedgs_geo.core.command.Command`.

Command modules import heavy libraries only inside their functions, so that ``--help`` is instant.
"""

from __future__ import annotations

import importlib

from ..core.command import Command

#: Verb -> module, in the order of the work. By name, so that a verb may live in a room above this one.
MODULES = {
    "plan-flight": "treedgs_geo.commands.plan_flight",
    "photos-to-dbh": "treedgs_geo.commands.photos_to_dbh",
    "pointcloud-to-dbh": "treedgs_geo.commands.pointcloud_to_dbh",
    "campaign": "treedgs_geo.campaign.command",
    "geotag": "treedgs_geo.commands.geotag",
    "reconstruct": "treedgs_geo.commands.reconstruct",
    "terrain": "treedgs_geo.commands.terrain",
    "fit-gaussians": "treedgs_geo.commands.fit_gaussians",
    "sample-surface": "treedgs_geo.commands.sample_surface",
    "segment-stems": "treedgs_geo.commands.segment_stems",
    "measure-dbh": "treedgs_geo.commands.measure_dbh",
    "review": "treedgs_geo.commands.review",
    "match-plots": "treedgs_geo.commands.match_plots",
    "evaluate": "treedgs_geo.commands.evaluate",
    "tape-sample": "treedgs_geo.commands.tape_sample",
    "tape-check": "treedgs_geo.commands.tape_check",
    "stand-table": "treedgs_geo.commands.stand_table",
    "compare": "treedgs_geo.commands.compare",
    "benchmark": "treedgs_geo.commands.benchmark",
    "simulate-plot": "treedgs_geo.commands.simulate_plot",
    "doctor": "treedgs_geo.commands.doctor",
}


def get_command(name: str) -> Command:
    """Import one verb's module and return its command."""
    return importlib.import_module(MODULES[name]).COMMAND


def all_commands() -> list[Command]:
    """Every verb, in order."""
    return [get_command(name) for name in MODULES]
