"""Names and places inside a campaign's folder."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from pathlib import Path

PLAN = "plan.jsonl"
CAMPAIGN = "campaign.json"
PLOTS = "plots"
RECORD = "plot.json"
LOG = "engine.log"
TREES = "trees.gpkg"
STATUS = "status.txt"
TABLE = "plots.csv"
REPORT = "campaign.html"
COSTS = "costs.json"
#: Names that Windows keeps for itself.
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.I)


def folder_name(plot_id: str) -> str:
    """A folder name for a plot id on every file system: the id itself where that is safe, else a readable part of it
    and a hash of the whole."""
    if re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_\-]{0,39}", plot_id) and not _DEVICES.fullmatch(plot_id):
        return plot_id
    plain = unicodedata.normalize("NFKD", plot_id).encode("ascii", "ignore").decode()
    plain = re.sub(r"[^A-Za-z0-9_]+", "_", plain).strip("_")[:30] or "plot"
    return f"{plain}-{hashlib.sha256(plot_id.encode()).hexdigest()[:8]}"


def plot_folder(workspace: Path, plot_id: str) -> Path:
    """The plot's own workspace."""
    return Path(workspace) / PLOTS / folder_name(plot_id)
