"""Campaigns, really run: the same trees as one by one, killed workers, speed-up, memory, two hosts.

    python -m treedgs_lab.benchmarks.campaign.plots --output build/campaign_plots
    python -m treedgs_lab.benchmarks.campaign.campaigns same    --plots build/campaign_plots --scratch build/campaign
    python -m treedgs_lab.benchmarks.campaign.campaigns killed  --plots build/campaign_plots --scratch build/campaign
    python -m treedgs_lab.benchmarks.campaign.campaigns speedup --plots build/campaign_plots
        --scratch build/campaign --first 12
    python -m treedgs_lab.benchmarks.campaign.campaigns memory  --scratch build/campaign
    python -m treedgs_lab.benchmarks.campaign.campaigns hosts --plots build/campaign_plots --scratch build/campaign
        --first 6

``same``: the campaign's layer against every plot run by its own verb. ``killed``: the same campaign with a worker,
or supervisor killed (SIGKILL) at random moments, against the layers of ``same``. ``speedup``: one worker against
two in one run, plots single-threaded, start of the workers and of Python included. ``memory``: the coordinating process
with 10 and 1,000 rows of a job that does nothing. ``hosts``: two workers in two network namespaces (needs root).
Each writes ``docs/results/campaign_NAME.json`` unless --no-record.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil

from treedgs_geo.campaign.engine_process import THREADS
from treedgs_geo.campaign.run import run_campaign
from treedgs_geo.campaign.settings import CampaignSettings
from treedgs_geo.core.progress import Reporter
from treedgs_lab.benchmarks.campaign.support import differences, idle_manifest, idle_plot, two_hosts
from treedgs_lab.benchmarks.records import RESULTS, ROOT, write_record
from treedgs_lab.benchmarks.verbs import run_verb, words

assert sys.platform != "win32", "this benchmark needs Linux"


def campaign(manifest: Path, workspace: Path, *more: str, **run) -> subprocess.Popen:
    """``treedgs campaign`` running."""
    command = words("campaign", "--manifest", manifest, "--workspace", workspace, "--log-format", "json", *more)
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT, **run)


def finish(process: subprocess.Popen) -> dict:
    """Its result."""
    out, _ = process.communicate()
    messages = [json.loads(line) for line in out.splitlines() if line.startswith("{")]
    errors = [m["message"] for m in messages if m["t"] == "error"]
    if process.returncode:
        raise SystemExit(f"the campaign failed ({process.returncode}): {errors}")
    return next(m["result"] for m in messages if m["t"] == "result")


def timed(manifest: Path, workspace: Path, *more: str) -> tuple[dict, float]:
    """A fresh campaign and its wall-clock seconds, from the start of Python to the report."""
    shutil.rmtree(workspace, ignore_errors=True)
    began = time.monotonic()
    result = finish(campaign(manifest, workspace, *more))
    return result, time.monotonic() - began


def first_rows(manifest: Path, count: int, target: Path) -> Path:
    """A manifest of the first rows, paths absolute."""
    with open(manifest, newline="", encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))[: count or None]
    for row in rows:
        for name in ("photos", "cloud", "geotags", "field", "plots"):
            if row[name]:
                row[name] = str((manifest.parent / row[name]).resolve())
    target.parent.mkdir(parents=True, exist_ok=True)
    with open(target, "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return target


def alone(manifest: Path, folder: Path) -> dict[str, Path]:
    """Every plot by its own verb, one after the other, single-threaded: plot id -> layer."""
    environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
    layers = {}
    with open(manifest, newline="", encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            layers[row["plot_id"]] = layer = folder / f"{row['plot_id']}.gpkg"
            if layer.exists():
                continue
            if row["cloud"]:
                verb = ["pointcloud-to-dbh", "--input", row["cloud"]]
            else:
                places = [f"--{name}={row[name]}" for name in ("photos", "geotags", "plots")]
                verb = ["photos-to-dbh", *places, "--workspace", folder / row["plot_id"]]
            how: dict = {"env": environment, "cwd": ROOT, "stdout": subprocess.DEVNULL}
            run_verb(*verb, "--crs", row["crs"], "--output", layer, "--log-format", "quiet", **how)
    return layers


def same(given: argparse.Namespace) -> dict:
    """Campaign against one by one."""
    manifest = first_rows(given.plots / "plots.csv", given.first, given.scratch / "plots.csv")
    if given.keep:
        result, seconds = finish(campaign(manifest, given.scratch / "same", "--workers", str(given.workers))), None
    else:
        result, seconds = timed(manifest, given.scratch / "same", "--workers", str(given.workers))
    began = time.monotonic()
    layers = alone(manifest, given.scratch / "alone")
    return {
        "campaign": result,
        "seconds": seconds and round(seconds, 1),
        "one_by_one_s": round(time.monotonic() - began, 1),
        "plots": len(layers),
        "differences": differences(Path(result["output"]), layers),
    }


def killed(given: argparse.Namespace) -> dict:
    """Random kills against the undisturbed layer of ``same``."""
    manifest = first_rows(given.plots / "plots.csv", given.first, given.scratch / "plots.csv")
    calm = given.scratch / "same" / "trees.gpkg"
    workspace = given.scratch / "killed"
    shutil.rmtree(workspace, ignore_errors=True)
    draw = random.Random(given.seed)
    process = campaign(manifest, workspace, "--workers", str(given.workers), start_new_session=True)
    victims: dict[str, int] = {}
    following = time.monotonic() + 6
    out = []
    reader = threading.Thread(target=lambda: out.append(process.communicate()[0]), daemon=True)
    reader.start()
    while reader.is_alive():
        reader.join(0.5)
        if time.monotonic() < following or sum(victims.values()) >= given.kills:
            continue
        following = time.monotonic() + draw.uniform(2, given.every)
        kind, victim = pick(process.pid, draw)
        if victim is not None:
            victim.kill()
            victims[kind] = victims.get(kind, 0) + 1
    messages = [json.loads(line) for line in out[0].splitlines() if line.startswith("{")]
    errors = [m["message"] for m in messages if m["t"] == "error"]
    if process.returncode:
        raise SystemExit(f"the campaign failed ({process.returncode}) after {victims}: {errors}")
    result = next(m["result"] for m in messages if m["t"] == "result")
    single = {layer.stem: layer for layer in (given.scratch / "alone").glob("*.gpkg")}
    if len(single) != result["n_plots"] and not calm.exists():
        timed(manifest, given.scratch / "same", "--workers", str(given.workers))
    by_one = len(single) == result["n_plots"]
    return {
        "campaign": result,
        "killed": victims,
        "left_over": leftovers(workspace),
        "compared_with": "one by one" if by_one else "the undisturbed campaign",
        "differences": differences(workspace / "trees.gpkg", single if by_one else calm),
    }


def pick(coordinator: int, draw: random.Random) -> tuple[str, psutil.Process | None]:
    """A worker (half of the time), a plot's supervisor, or its engine."""
    kinds: dict[str, list[psutil.Process]] = {"worker": [], "supervisor": [], "engine": []}
    for child in psutil.Process(coordinator).children(recursive=True):
        try:
            words = " ".join(child.cmdline())
        except psutil.Error:
            continue
        if "campaign.supervise" in words:
            kinds["supervisor"].append(child)
        elif "campaign.plot" in words:
            kinds["engine"].append(child)
        elif "spawn_main" in words:
            kinds["worker"].append(child)
    # Engines are left out: one that is killed from outside counts as a failure of its plot, not of its worker.
    kind = draw.choice(["worker", "worker", "supervisor"])
    return kind, draw.choice(kinds[kind]) if kinds[kind] else None


def leftovers(workspace: Path) -> int:
    """Processes that still work for a campaign that has ended."""
    time.sleep(2)
    return sum(str(workspace) in " ".join(p.info["cmdline"] or []) for p in psutil.process_iter(["cmdline"]))


def speedup(given: argparse.Namespace) -> dict:
    """One worker against two, alternating."""
    manifest = first_rows(given.plots / "plots.csv", given.first, given.scratch / "speed.csv")
    seconds: dict[int, list[float]] = {1: [], 2: []}
    stages: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(given.repeats):
        for workers in (1, 2):
            workspace = given.scratch / f"speed{workers}"
            _, spent = timed(manifest, workspace, "--workers", str(workers), "--dashboard", "off")
            seconds[workers].append(round(spent, 2))
            stages[workers].append(plots_stage(workspace))
    return {
        "plots": sum(1 for _ in open(manifest, encoding="utf-8")) - 1,
        "seconds": seconds,
        "plots_stage_s": stages,
        "speedup_whole_command": round(min(seconds[1]) / min(seconds[2]), 2),
        "speedup_plots": round(min(stages[1]) / min(stages[2]), 2),
        "load_before": psutil.getloadavg()[0],
    }


def plots_stage(workspace: Path) -> float:
    """From the first plot's start to the last plot's end, from their records."""
    begun, ended = [], []
    for record in workspace.glob("plots/*/plot.json"):
        for attempt in json.loads(record.read_text())["attempts"]:
            begun.append(attempt["began"])
            ended.append(attempt["began"] + attempt["seconds"])
    return round(max(ended) - min(begun), 2)


def memory(given: argparse.Namespace) -> dict:
    """Peak of the coordinating process with few and many rows; each in a fresh process."""
    found = {}
    for rows in (10, 1000):
        done = subprocess.run(
            [sys.executable, "-m", __spec__.name, "coordinator", "--rows", str(rows), "--scratch", str(given.scratch)],
            stdout=subprocess.PIPE,
            text=True,
            check=True,
            cwd=ROOT,
        )
        found[str(rows)] = json.loads(done.stdout.strip().splitlines()[-1])
    few, many = found["10"]["peak_mb"], found["1000"]["peak_mb"]
    return {"rows": found, "growth_mb": round(many - few, 1), "growth_kb_a_row": round(1000 * (many - few) / 990, 2)}


def coordinator(given: argparse.Namespace) -> dict:
    """One campaign of a job that does nothing but leave an (almost) empty layer, in this process."""
    folder = given.scratch / f"idle{given.rows}"
    shutil.rmtree(folder, ignore_errors=True)
    manifest = idle_manifest(folder / "in", given.rows)
    began = time.monotonic()
    result = run_campaign(
        CampaignSettings(manifest=manifest, workspace=folder / "work", workers=2, dashboard="auto"),
        Reporter(),
        function=idle_plot,
    )
    return {
        "plots": result["n_done"],
        "trees": result["n_trees"],
        "seconds": round(time.monotonic() - began, 1),
        "peak_mb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, 1),
    }


def hosts(given: argparse.Namespace) -> dict:
    """Two simulated hosts, one shared folder."""
    manifest = first_rows(given.plots / "plots.csv", given.first, given.scratch / "hosts.csv")
    result, _ = timed(manifest, given.scratch / "onehost", "--workers", "2")
    workspace = given.scratch / "hosts"
    shutil.rmtree(workspace, ignore_errors=True)
    with two_hosts(given.scratch / "hostlogs") as address:
        there = finish(campaign(manifest, workspace, "--scheduler", address, "--dashboard", "off"))
    used: dict[str, int] = {}
    with open(workspace / "plots.csv", newline="", encoding="utf-8-sig") as stream:
        for row in csv.DictReader(stream):
            used[row["host"]] = used.get(row["host"], 0) + 1
    return {
        "campaign": there,
        "plots_by_host": used,
        "differences": differences(workspace / "trees.gpkg", Path(result["output"])),
    }


def main() -> int:
    """Run one of them, print and record it."""
    jobs = {job.__name__: job for job in (same, killed, speedup, memory, hosts, coordinator)}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("job", choices=list(jobs))
    parser.add_argument("--plots", type=Path, default=ROOT / "build" / "campaign_plots")
    parser.add_argument("--scratch", type=Path, default=ROOT / "build" / "campaign")
    parser.add_argument("--first", type=int, default=0, help="only the first plots of the manifest")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kills", type=int, default=12)
    parser.add_argument("--every", type=float, default=25.0, help="most seconds between two kills")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--rows", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="same: go on with the campaign that is there")
    parser.add_argument("--no-record", action="store_true")
    given = parser.parse_args()
    given.scratch = given.scratch.resolve()
    given.scratch.mkdir(parents=True, exist_ok=True)
    found = jobs[given.job](given)
    if given.job == "coordinator":
        print(json.dumps(found))
        return 0
    found = portable(found, given.scratch)
    print(json.dumps(found, indent=1))
    if not given.no_record:
        write_record(RESULTS / f"campaign_{given.job}.json", found, seeds=[given.seed] if given.job == "killed" else [])
    return 1 if found.get("differences") else 0


def portable(value, scratch: Path):
    """Without this machine's paths."""
    return json.loads(json.dumps(value).replace(f"{scratch}/", ""))


if __name__ == "__main__":
    sys.exit(main())
