"""``photos-to-dbh`` as a process of its own on a simulated plot, with nothing true."""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd

from treedgs_geo.core import workspace as names
from treedgs_geo.core.children import python_command
from treedgs_geo.core.errors import TreeDGSError
from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.reconstruction.model import REPORT
from treedgs_geo.stems.quality.tree import TREE_FIELDS, Tree

from .blocks import camera_errors, on_true_ground, scale_error
from .plot import TruePlot

#: What the crew brings of ground control, in the plot's folder.
CONTROL = "gcp_list.txt"


class ChainCrash(RuntimeError):
    """``photos-to-dbh`` crashed, or lacked memory or a library: no refusal, and nothing that may count as one."""


@dataclass(frozen=True)
class ChainResult:
    """refused: why the chain refused, empty where it ended. trees: placed where they are in truth
    (:func:`.blocks.on_true_ground`). block: :func:`block_figures`, empty where nothing was reconstructed."""

    refused: str = ""
    trees: list[Tree] = field(default_factory=list)
    block: dict[str, Any] = field(default_factory=dict)


def chain_inputs(folder: Path, crs: str) -> list[Any]:
    """``--photos`` … of a plot's folder, all that may be known of it: never ``truth/`` nor ``dtm.tif``."""
    inputs = ["--photos", folder / "images", "--crs", crs, "--plots", folder / "plots.csv"]
    if any(folder.glob("*.MRK")) or any(folder.glob("*.pos")):
        inputs += ["--geotags", folder]
    if (folder / CONTROL).exists():
        inputs += ["--gcp", folder / CONTROL]
    return inputs


def run_photo_chain(folder: Path, crs: str, workspace: Path) -> str:
    """Run ``photos-to-dbh`` on a plot's folder; layer and ``sfm/`` lie in ``workspace`` then.

    Returns:
        why it refused, in its own words; empty where it ended.

    Raises:
        ChainCrash: it ended in any other way.
    """
    outputs = ["--workspace", workspace, "--output", workspace / names.TREES, "--log-format", "plain"]
    child = subprocess.run(
        python_command("treedgs_geo", "photos-to-dbh", *chain_inputs(folder, crs), *outputs),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )
    if not child.returncode:
        return ""
    last = (child.stderr.strip() or child.stdout.strip()).splitlines()[-1:] or ["no message"]
    if child.returncode != TreeDGSError.exit_code:
        raise ChainCrash(f"{folder}: photos-to-dbh ended with exit code {child.returncode}: {last[0][:300]}")
    return last[0][:300]


def through_chain(plot: TruePlot) -> ChainResult:
    """Trees and block of a plot through the whole chain.

    Raises:
        ChainCrash: as :func:`run_photo_chain`.
    """
    with tempfile.TemporaryDirectory(prefix="treedgs-chain-") as scratch:
        workspace = Path(scratch) / "ws"
        refused = run_photo_chain(plot.folder, plot.frame.crs.to_string(), workspace)
        if refused:
            return ChainResult(refused)
        sfm = workspace / names.SFM
        # Photos that cannot show stems are not reconstructed: an empty layer, no block.
        if not (sfm / REPORT).exists():
            return ChainResult()
        return ChainResult("", _as_trees(placed_trees(plot, workspace)), block_figures(plot, sfm))


def placed_trees(plot: TruePlot, workspace: Path) -> gpd.GeoDataFrame:
    """The workspace's tree layer, ``x`` and ``y`` where the trees are in truth (:func:`.blocks.on_true_ground`): a
    block that lies metres off has measured the same trees."""
    table = read_trees(workspace / names.TREES)
    if len(table):
        up = table["z_ground"].fillna(plot.frame.origin[2]).to_numpy(float)
        places = np.column_stack([table[["x", "y"]].to_numpy(float), up])
        table[["x", "y"]] = on_true_ground(plot, workspace / names.SFM, places)[:, :2]
    return table


def _as_trees(table: gpd.GeoDataFrame) -> list[Tree]:
    return [
        Tree(**{name: row[name] for name in TREE_FIELDS if name in row and not pd.isna(row[name])})
        for row in table.drop(columns="geometry").to_dict("records")
    ]


def block_figures(plot: TruePlot, sfm: Path) -> dict[str, Any]:
    """What a block states of itself, and how true it is: ``photos, registered, scale_sd`` (stated), ``warnings``,
    ``scale_error`` (share) and :func:`.blocks.camera_errors`."""
    report = read_json(sfm / REPORT)
    stated = {name: report[name] for name in ("photos", "registered", "scale_sd", "warnings")}
    return {**stated, "scale_error": scale_error(plot, sfm), **camera_errors(plot, sfm)}
