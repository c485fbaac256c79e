"""Write what the QGIS plugin knows of the engine: ``treedgs_qgis/parameters.json`` and ``requirements.txt``.

Run with the engine's Python by ``make parameters`` after a verb's settings or a pinned range changed; a test compares.
"""

from __future__ import annotations

import importlib
import json
import re
import sys

from written import ROOT, write_or_check

PARAMETERS = ROOT / "treedgs_qgis" / "parameters.json"
REQUIREMENTS = ROOT / "treedgs_qgis" / "requirements.txt"


def parameters_text() -> str:
    """The JSON text: protocol, commands as ``treedgs describe`` gives them, the modules each one needs, and the words
    and limits of a person's decisions."""
    from treedgs_geo.core.command import describe
    from treedgs_geo.core.plausible import GAP, LARGE_CM
    from treedgs_geo.core.progress import PROTOCOL
    from treedgs_geo.core.wrong_units import NEAR, ONE_CM
    from treedgs_geo.inventory import reviewed
    from treedgs_geo.inventory.review.apply import BESIDE_M, FAR_M
    from treedgs_geo.stems.quality.reasons import REASONS
    from treedgs_geo.verbs import MODULES, get_command
    from treedgs_geo.verbs.doctor import NEEDS

    commands = []
    for name, module in MODULES.items():
        if importlib.util.find_spec(module) is None:
            print(f"warning: {name} has no module yet, left out", file=sys.stderr)
            continue
        commands.append({**describe(get_command(name)), "needs": list(NEEDS[name])})
    review = {
        "decisions": reviewed.DECISIONS,
        "reasons": REASONS,
        "least_taped_cm": reviewed.MIN_TAPED_CM,
        "most_taped_cm": reviewed.MAX_TAPED_CM,
        "single_cm": ONE_CM,
        "near": NEAR,
        "large_cm": LARGE_CM,
        "gap": GAP,
        "beside_m": BESIDE_M,
        "far_m": FAR_M,
    }
    every = {"protocol": PROTOCOL, "commands": commands, "review": review}
    return json.dumps(every, indent=1, ensure_ascii=False, default=str) + "\n"


def requirements_text() -> str:
    """The pinned ranges of ``pyproject.toml``, one a line: what measuring needs, then each extra that QGIS can set up,
    then torch."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    lists = dict(re.findall(r"^(\w+) = \[(.*?)\]\s*$", text, re.S | re.M))
    lines = ["# Written from pyproject.toml by make parameters."]
    for name in ("dependencies", "simulate", "reports", "gpu", "torch"):
        lines += [f"# [{name}]"] * (name != "dependencies") + re.findall(r'"([^"]+)"', lists[name])
    return "\n".join(lines) + "\n"


def main() -> int:
    """Write both files, or with ``--check`` only say whether they are up to date."""
    return write_or_check(((PARAMETERS, parameters_text()), (REQUIREMENTS, requirements_text())))


if __name__ == "__main__":
    sys.exit(main())
