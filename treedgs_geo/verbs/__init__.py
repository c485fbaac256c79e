"""One module per verb: its settings, its function, its :class:`~treedgs_geo.core.command.Command`.

Command modules import heavy libraries only inside their functions, so that ``--help`` is instant.
"""

from __future__ import annotations

import importlib
import importlib.util

from ..core.command import Command
from ..core.extras import LAB, lab

#: Verb -> module, in the order of the work. By name, so that a verb may live in a room above this one.
MODULES = {
    "plan-flight": "treedgs_geo.verbs.plan_flight",
    "photos-to-dbh": "treedgs_geo.verbs.photos_to_dbh",
    "pointcloud-to-dbh": "treedgs_geo.verbs.pointcloud_to_dbh",
    "campaign": "treedgs_geo.campaign.command",
    "geotag": "treedgs_geo.verbs.geotag",
    "reconstruct": "treedgs_geo.verbs.reconstruct",
    "terrain": "treedgs_geo.verbs.terrain",
    "fit-gaussians": "treedgs_geo.verbs.fit_gaussians",
    "sample-surface": "treedgs_geo.verbs.sample_surface",
    "segment-stems": "treedgs_geo.verbs.segment_stems",
    "measure-dbh": "treedgs_geo.verbs.measure_dbh",
    "review": "treedgs_geo.verbs.review",
    "match-plots": "treedgs_geo.verbs.match_plots",
    "evaluate": "treedgs_geo.verbs.evaluate",
    "tape-sample": "treedgs_geo.verbs.tape_sample",
    "tape-check": "treedgs_geo.verbs.tape_check",
    "trial": "treedgs_geo.verbs.trial",
    "stand-table": "treedgs_geo.verbs.stand_table",
    "compare": "treedgs_geo.verbs.compare",
    "benchmark": "treedgs_lab.verbs.benchmark",
    "simulate-plot": "treedgs_lab.verbs.simulate_plot",
    "doctor": "treedgs_geo.verbs.doctor",
}


def get_command(name: str) -> Command:
    """Import one verb's module and return its command.

    Raises:
        MissingComponentError: the verb is one of the lab's, which is not installed.
    """
    package, module = MODULES[name].split(".", 1)
    return (lab(module, name) if package == LAB else importlib.import_module(MODULES[name])).COMMAND


def all_commands() -> list[Command]:
    """Every verb that is installed, in order: those of the lab only where its package is."""
    return [get_command(name) for name, module in MODULES.items() if importlib.util.find_spec(module.split(".")[0])]
