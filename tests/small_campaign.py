"""Small clouds with upright stems, cheap to measure, and ``treedgs campaign`` on them: seconds, not minutes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyproj

ROOT = Path(__file__).resolve().parents[1]


def make_cloud(path: Path, seed: int, x0: float = 500_000.0, stems: int = 3, epsg: int | None = 6344) -> Path:
    """A 9 x 9 m cloud: rough ground and upright stems of 15 to 40 cm, 4 m high."""
    from treedgs_geo.pointcloud.cloud import PointCloud
    from treedgs_geo.pointcloud.files import write_cloud

    draw = np.random.default_rng(seed)
    ground = draw.uniform(0, 9, (4000, 2))
    points = [np.column_stack([ground, 0.02 * draw.standard_normal(4000)])]
    for number in range(stems):
        centre = np.array([1.8 + 2.6 * (number % 3), 2.0 + 2.6 * (number // 3)]) + draw.uniform(-0.4, 0.4, 2)
        radius = draw.uniform(0.075, 0.2)
        angle, height = draw.uniform(0, 2 * np.pi, 2500), draw.uniform(0, 4.5, 2500)
        edge = radius * (1 - 0.004 * height) + 0.004 * draw.standard_normal(2500)
        round_ = edge[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        points.append(np.column_stack([centre + round_, height]))
    xyz = np.vstack(points) + [x0, 3_700_000.0, 50.0]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_cloud(path, PointCloud(xyz, pyproj.CRS.from_epsg(epsg) if epsg else None, {}))
    return path


def write_manifest(path: Path, rows: list[dict[str, object]]) -> Path:
    """A manifest with the columns that the rows have."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    lines = [",".join(columns)] + [",".join(f'"{row.get(name, "")}"' for name in columns) for row in rows]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def start(manifest: Path, workspace: Path, *more: str, **run) -> subprocess.Popen:
    """``treedgs campaign`` as users start it."""
    return subprocess.Popen(
        [
            sys.executable,
            "-m",
            "treedgs_geo",
            "campaign",
            "--manifest",
            str(manifest),
            "--workspace",
            str(workspace),
            "--json",
            *more,
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        **run,
    )


class Ended:
    """How it ended: exit code, result, messages by kind."""

    def __init__(self, process: subprocess.Popen) -> None:
        try:
            out, self.log = process.communicate(timeout=300)
        except subprocess.TimeoutExpired:
            process.kill()
            raise
        self.code = process.returncode
        self.messages = [json.loads(line) for line in out.splitlines() if line.startswith("{")]
        self.result = next((m["result"] for m in self.messages if m["t"] == "result"), {})

    def said(self, kind: str) -> list[str]:
        return [m["message"] for m in self.messages if m["t"] == kind]
