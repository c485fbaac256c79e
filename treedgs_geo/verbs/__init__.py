"""One module per verb: its settings, its function, its :class:`~treedgs_geo.core.command.Command`.

Command modules import heavy libraries only inside their functions, so that ``--help`` is instant.
"""

from __future__ import annotations

import importlib
import importlib.util

from ..core.command import Command
from ..core.extras import LAB, lab

_NAMES = (
    "plan-flight", "photos-to-dbh", "pointcloud-to-dbh", "campaign", "geotag", "reconstruct", "terrain",
    "fit-gaussians", "sample-surface", "segment-stems", "measure-dbh", "review", "match-plots", "evaluate",
    "tape-sample", "tape-check", "trial", "stand-table", "compare", "benchmark", "simulate-plot", "doctor",
)  # fmt: skip
_ELSEWHERE = {
    "campaign": "treedgs_geo.campaign.command",
    "benchmark": f"{LAB}.verbs.benchmark",
    "simulate-plot": f"{LAB}.verbs.simulate_plot",
}
#: Verb -> module, in the order of the work. By name, so that a verb may live in a room above this one.
MODULES = {name: _ELSEWHERE.get(name, f"{__name__}.{name.replace('-', '_')}") for name in _NAMES}


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
