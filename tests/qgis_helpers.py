"""What several tests of the plugin share: clouds to run on, refusals, waiting."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path

from qgis_driver import PATIENCE_S

#: A text that is markup, breaks lines and ends quotes.
HOSTILE = "<b>x</b>\n\"'&amp; ; same tree as 9"


def refused(done: subprocess.CompletedProcess, *words: str) -> None:
    assert done.returncode == 1, done.stdout
    assert "Traceback" not in done.stdout, done.stdout
    for word in words:
        assert word in done.stdout, done.stdout


def wait_for(path: Path) -> str:
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        if path.exists() and path.read_text():
            return path.read_text()
        time.sleep(0.05)
    raise AssertionError(f"{path} did not appear")


def stems_cloud(path: Path, radii_m: tuple[float, ...] = (0.12, 0.17, 0.22)) -> list[tuple[float, float, float]]:
    """Write a terrestrial-looking cloud: flat ground and a row of upright stems; returns (x, y, dbh_cm)."""
    import laspy
    import numpy as np
    import pyproj

    rng = np.random.default_rng(3)
    ground = np.column_stack([rng.uniform(0, 12, 30000), rng.uniform(0, 8, 30000), rng.normal(0, 0.01, 30000)])
    parts, truth = [ground], []
    for index, radius in enumerate(radii_m):
        x, y = 2.5 + 3.5 * index, 4.0 + 0.3 * index
        angle, height = rng.uniform(0, 2 * np.pi, 9000), rng.uniform(0, 9, 9000)
        r = radius - 0.004 * (height - 1.37) + rng.normal(0, 0.004, 9000)
        parts.append(np.column_stack([x + r * np.cos(angle), y + r * np.sin(angle), height]))
        truth.append((500000 + x, 3450000 + y, 200 * radius))
    points = np.vstack(parts) + [500000, 3450000, 100]
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [0.001] * 3, [500000, 3450000, 100]
    header.add_crs(pyproj.CRS("EPSG:32617"))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = points.T
    cloud.write(path)
    return truth


def review_trees_layer(path: Path) -> Path:
    """Six trees in a row, two of each flag, with hostile plot ids."""
    from treedgs_geo.inventory.tree_layer import write_trees
    from treedgs_geo.stems.quality.tree import Tree

    flags = ["ok", "check", "reject", "check", "ok", "reject"]
    made = []
    for number in range(1, 7):
        flag = flags[number - 1]
        dbh = {} if flag == "reject" else {"dbh_cm": 20.0 + number, "dbh_se_cm": 0.5}
        reason = {"ok": "", "check": "few_views", "reject": "occluded"}[flag]
        about = {"plot_id": HOSTILE, "method": "photos", "run_id": "0123456789abcdef", "note": "old"}
        made.append(
            Tree(number, 5e5 + 4 * number, 3.45e6, 10.0, qc_flag=flag, qc_reason=reason, **dbh, **about).finish()
        )
    return write_trees(path, made, "EPSG:32617")
