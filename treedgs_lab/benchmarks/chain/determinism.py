"""Same input, same seed, same trees? The whole chain twice on all cores and once on one, or with another code; and what
more cores save.

    python -m treedgs_lab.benchmarks.chain.determinism --photos PLOT --clouds PLOT
        --output docs/results/determinism.json
    python -m treedgs_lab.benchmarks.chain.determinism --against ../before
        --photos DEMO PLOT_E --clouds PLOT_A PLOT_E PLOT_H --output docs/results/determinism_move.json

A plot is a folder as ``simulate-plot`` writes it. Every run starts from nothing: own process, own workspace.
``--against CHECKOUT`` runs the same inputs with this code and with the code of another checkout (``git worktree add
../before COMMIT``) and compares the tree layers bit for bit: a change that only moves code changes none. Seconds of
both, one run after the other, say what a change saves. Seconds of each stage on one core and on all say how much of it
is shared among cores, and so what more cores would save (Amdahl's law; of an idle machine alone). The exit status is 1
where the goal is missed.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
from scipy.optimize import linear_sum_assignment

from treedgs_geo.core import workspace as names
from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.reconstruction.model import REPORT, load_views
from treedgs_lab.benchmarks.processes import Stopwatch, photo_inputs
from treedgs_lab.benchmarks.records import ROOT, write_record

assert sys.platform != "win32", "this benchmark needs Linux"

#: Goals: bitwise on one machine, this much across core counts.
ACROSS_CORES_MM = 0.1
#: Stems nearer than this are one, metres.
SAME_TREE_M = 0.5
#: Columns that hold when something was made, not what was measured.
MADE = ("run_id", "made", "created", "date")
#: Seconds of a run, beside its tree layer.
TOOK = "took.json"
#: The seed of both verbs when none is given.
SEED = 0


@dataclass(frozen=True)
class Case:
    """One input. preset: of ``photos-to-dbh``; a case without one is the plot's cloud."""

    plot: Path
    preset: str = ""

    @property
    def name(self) -> str:
        """Of the folder that its runs are kept in."""
        return f"{self.plot.name}-{self.preset or 'cloud'}"

    def words(self, work: Path) -> list[str]:
        """The command; everything it writes is in ``work``."""
        if self.preset:
            chosen = ["--preset", self.preset, "--workspace", work / "ws"]
            command = ["photos-to-dbh", *photo_inputs(self.plot), *chosen]
        else:
            command = ["pointcloud-to-dbh", "--input", *sorted((self.plot / "lidar").glob("*.la[sz]"))]
        command += ["--output", work / "trees.gpkg", "--log-format", "quiet"]
        # Not isolated: the process imports the checkout that its environment names.
        return [sys.executable, "-m", "treedgs_geo", *map(str, command)]


def environment(code: Path) -> dict[str, str]:
    """In which a process imports TreeDGS from ``code`` and nowhere else.

    Raises:
        SystemExit: it does not.
    """
    env = {**os.environ, "PYTHONPATH": str(code)}
    where = subprocess.run(
        [sys.executable, "-c", "import treedgs_geo; print(treedgs_geo.__file__)"],
        cwd=code,
        env=env,
        capture_output=True,
        text=True,
    ).stdout.strip()
    if not where or not Path(where).is_relative_to(code):
        raise SystemExit(f"{code}: holds no treedgs_geo that can be imported (found: {where or 'none'})")
    return env


def run(case: Case, work: Path, cores: set[int], code: Path = ROOT) -> Path:
    """One run on these cores with the TreeDGS of ``code``; its tree layer. What is there already is not run again."""
    output = work / "trees.gpkg"
    if not output.exists():
        work.mkdir(parents=True, exist_ok=True)
        watch = Stopwatch()
        subprocess.run(
            case.words(work),
            check=True,
            cwd=code,
            env=environment(code),
            stdout=subprocess.DEVNULL,
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )
        write_json(work / TOOK, watch.seconds())
    return output


def compare(one: Path, other: Path) -> dict:
    """Of two tree layers: whether every value is the same to the bit, and how far diameters and places are apart."""
    a, b = (gpd.read_file(path, layer="trees").drop(columns=list(MADE), errors="ignore") for path in (one, other))
    a, b = (layer.sort_values("tree_id").reset_index(drop=True) for layer in (a, b))
    same = list(a.columns) == list(b.columns) and a.drop(columns="geometry").equals(b.drop(columns="geometry"))
    found = {
        "trees": [len(a), len(b)],
        "same_to_the_bit": bool(same and (a.geometry.to_wkb() == b.geometry.to_wkb()).all()),
    }
    # Places, not numbers, say which is which: a stem more shifts the numbers.
    apart = np.array([b.geometry.distance(place) for place in a.geometry]).reshape(len(a), len(b))
    rows, columns = linear_sum_assignment(np.minimum(apart, SAME_TREE_M))
    near = apart[rows, columns] < SAME_TREE_M
    a, b = a.iloc[rows[near]].reset_index(drop=True), b.iloc[columns[near]].reset_index(drop=True)
    found |= {"paired": len(a), "flags_differ": int((a["qc_flag"] != b["qc_flag"]).sum())}
    for name, column in (("dbh", "dbh_cm"), ("error", "dbh_se_cm")):
        off = 10 * (pd.to_numeric(a[column]) - pd.to_numeric(b[column])).abs().dropna()
        found[f"{name}_compared"], found[f"{name}_within_half_mm"] = len(off), int((off <= 0.5).sum())
        found[f"most_{name}_mm"] = float(off.max()) if len(off) else None
    found["most_place_mm"] = float(1000 * apart[rows, columns][near].max()) if near.any() else 0.0
    return found


def cameras_apart(photos: Path, one: Path, other: Path) -> dict:
    """Of two workspaces: how far the same photos' projection centres and axes are apart."""
    (_, first), (_, second) = (load_views(work / names.SFM, photos) for work in (one, other))
    there = {view.name: view for view in second}
    pairs = [(view, there[view.name]) for view in first if view.name in there]
    apart = [np.linalg.norm(a.centre - b.centre) for a, b in pairs]
    turned = [np.linalg.norm(a.rotation - b.rotation) / np.sqrt(2) for a, b in pairs]
    return {
        "photos": [len(first), len(second), len(pairs)],
        "most_apart_mm": float(1000 * max(apart)),
        "most_turned_deg": float(np.degrees(max(turned))),
    }


def judge(case: Case, work: Path, against: Path | None) -> dict:
    """This code's run beside others: twice on all cores and once on one; or once each by this code and another."""
    every = os.sched_getaffinity(0)
    first = run(case, work / "first", every)
    if against is None:
        others = {"again": run(case, work / "second", every), "one_core": run(case, work / "single", {min(every)})}
    else:
        others = {"against": run(case, work / "against", every, against)}
    record: dict = {"plot": case.plot.name, "preset": case.preset or "cloud", "cores": len(every)}
    for name, other in others.items():
        record[name] = compare(first, other)
        if case.preset:
            record[name]["cameras"] = cameras_apart(case.plot / "images", first.parent / "ws", other.parent / "ws")
    if against is not None:
        now, before = (read_json(work / which / TOOK) for which in ("first", "against"))
        record["seconds"] = {"now": now, "before": before, "ratio": round(now["wall_s"] / before["wall_s"], 2)}
    if case.preset and against is None:
        alone, shared = (stage_seconds(output.parent / "ws") for output in (others["one_core"], first))
        record["stages"] = on_more_cores(alone, shared, len(every))
    print(json.dumps(record, indent=2), flush=True)
    return record


def stage_seconds(workspace: Path) -> dict[str, float]:
    """Seconds of each stage of a run with photos, the reconstruction by its parts."""
    stages = {name: stage["seconds"] for name, stage in read_json(workspace / "run.json")["stages"].items()}
    parts = read_json(workspace / names.SFM / REPORT)["stage_seconds"]
    rest = stages.pop("reconstruct") - sum(parts.values())
    return {**stages, **parts, "rest of reconstruct": rest}


def on_more_cores(one: dict[str, float], every: dict[str, float], cores: int) -> dict[str, dict[str, float]]:
    """By stage: seconds on one core, on ``cores`` and, by Amdahl's law, on 4 and 8, and the share that cores share."""
    found = {}
    for stage, alone in one.items():
        shared = min(max((alone - every[stage]) / (1 - 1 / cores), 0.0), alone) if cores > 1 else 0.0
        modelled = {f"modelled_{n}_s": alone - shared * (1 - 1 / n) for n in (4, 8)}
        found[stage] = {"one_core_s": alone, "all_cores_s": every[stage], **modelled, "shared_s": shared}
    found["all"] = {key: sum(row[key] for row in found.values()) for key in next(iter(found.values()))}
    return {
        stage: {
            **{key: round(value, 1) for key, value in row.items() if key != "shared_s"},
            "shared": round(row["shared_s"] / max(row["one_core_s"], 1e-9), 2),
        }
        for stage, row in found.items()
    }


def good(record: dict) -> bool:
    """Whether one case meets the goals."""
    if "against" in record:
        return record["against"]["same_to_the_bit"]
    alone = record["one_core"]
    near = (alone["most_dbh_mm"] or 0) <= ACROSS_CORES_MM and not alone["flags_differ"]
    return record["again"]["same_to_the_bit"] and near


def commit(code: Path) -> str:
    """What a checkout holds, in git's words; ``unknown`` outside git."""
    done = subprocess.run(["git", "describe", "--always", "--dirty"], cwd=code, capture_output=True, text=True)
    return done.stdout.strip() or "unknown"


def cases(photos: list[Path], clouds: list[Path], presets: list[str]) -> list[Case]:
    """The inputs that the options name."""
    by_photos = [Case(plot.resolve(), preset) for plot in photos for preset in presets]
    return by_photos + [Case(plot.resolve()) for plot in clouds]


def main() -> int:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photos", nargs="*", type=Path, default=[], metavar="PLOT", help="run photos-to-dbh")
    parser.add_argument("--clouds", nargs="*", type=Path, default=[], metavar="PLOT", help="run pointcloud-to-dbh")
    parser.add_argument("--presets", nargs="+", default=["balanced"], help="of photos-to-dbh")
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="compare with the code of this checkout")
    parser.add_argument("--output", type=Path)
    parser.add_argument("--keep", type=Path, help="work here and leave it; what is there already is not run again")
    options = parser.parse_args()
    against = options.against and options.against.resolve()
    with tempfile.TemporaryDirectory() as scratch:
        place = (options.keep or Path(scratch)).resolve()
        inputs = cases(options.photos, options.clouds, options.presets)
        runs = [judge(case, place / case.name, against) for case in inputs]
    met = bool(runs) and all(good(record) for record in runs)
    compared: dict = {"across_cores_mm": ACROSS_CORES_MM}
    if against:
        compared = {"this": commit(ROOT), "against": commit(against)}
    write_record(options.output, {**compared, "goal_met": met, "runs": runs}, seeds=[SEED])
    print("Goal met." if met else "Goal missed.")
    return 0 if met else 1


if __name__ == "__main__":
    raise SystemExit(main())
