"""A large LAZ through the verbs that take one: peak memory and time against the number of points.

    python -m treedgs_lab.benchmarks.clouds.large_cloud --cloud ../shared/data/plot_a/lidar/plot_a_uls.laz
        --millions 50 \
        --scratch DIR --output docs/results/large_cloud.json

The file is made by laying copies of a real-sized plot side by side, every second one mirrored so that the ground goes
on without a step. ``segment-stems`` is given the terrain that ``terrain`` wrote; ``reading`` is the file read by laspy
and nothing else. Each runs in a process of its own; its peak memory is the kernel's (``ru_maxrss``) and its time is the
CPU's (user and system), which other work on the machine disturbs less than the clock. What the output file already has
is kept, so that sizes and verbs can be run one by one.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from pathlib import Path

import laspy
import numpy as np

from treedgs_geo.core.files import read_json
from treedgs_lab.benchmarks.records import write_record

assert sys.platform != "win32", "this benchmark needs Linux"


def lay_out(source: Path, target: Path, points: float) -> dict:
    """Write ``points`` or a little more by tiling ``source``; returns what was made."""
    plot = laspy.read(source)
    count = max(int(np.ceil(points / len(plot))), 1)
    across = int(np.ceil(np.sqrt(count)))
    low, high = plot.header.mins[:2], plot.header.maxs[:2]
    side = np.ceil(high - low)
    header = laspy.LasHeader(version=str(plot.header.version), point_format=plot.header.point_format.id)
    header.scales, header.offsets = plot.header.scales, plot.header.offsets
    header.add_crs(plot.header.parse_crs(), keep_compatibility=False)
    with laspy.open(target, "w", header=header) as writer:
        for number in range(count):
            place = np.array([number % across, number // across])
            xy = np.column_stack([plot.x, plot.y]) - low
            xy = np.where(place % 2 == 1, side - xy, xy) + place * side + low
            out = laspy.ScaleAwarePointRecord.zeros(len(plot), header=header)
            for name in plot.points.array.dtype.names:
                out.array[name] = plot.points.array[name]
            out.x, out.y = xy[:, 0], xy[:, 1]
            writer.write_points(out)
    return {
        "points": count * len(plot),
        "copies": count,
        "extent_m": (across * side).tolist(),
        "file_mb": round(target.stat().st_size / 1e6),
    }


#: Every coordinate of a file, in pieces.
READING = """
import sys, laspy
with laspy.open(sys.argv[1]) as reader:
    for points in reader.chunk_iterator(2_000_000):
        points.x, points.y, points.z
"""
#: Verb -> its arguments; {0}: the scratch folder.
VERBS = {
    "reading": ["-c", READING, "{0}/cloud.laz"],
    "terrain": ["-m", "treedgs_geo", "terrain", "--input", "{0}/cloud.laz", "--output", "{0}/dtm.tif"],
    "segment-stems": ["-m", "treedgs_geo", "segment-stems", "--input", "{0}/cloud.laz", "--dtm", "{0}/dtm.tif"]
    + ["--output", "{0}/stems.laz"],
    "pointcloud-to-dbh": ["-m", "treedgs_geo", "pointcloud-to-dbh", "--input", "{0}/cloud.laz"]
    + ["--output", "{0}/trees.gpkg", "--sheets", "none"],
}


def measure(arguments: list[str]) -> dict:
    """Run Python in its own process: CPU and wall seconds, peak memory, its result."""
    began = time.monotonic()
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(writing, 1)
        os.close(reading)
        os.execv(sys.executable, [sys.executable, *arguments])
    os.close(writing)
    with os.fdopen(reading) as stream:
        text = stream.read()
    _, status, usage = os.wait4(child, 0)
    if status:
        raise SystemExit(f"{arguments} failed ({status}): {text[-500:]}")
    return {
        "cpu_s": round(usage.ru_utime + usage.ru_stime, 1),
        "wall_s": round(time.monotonic() - began, 1),
        "peak_mb": round(usage.ru_maxrss / 1024),
        "said": [line for line in text.splitlines() if line and not line.startswith("output")][-12:],
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cloud", type=Path, required=True)
    parser.add_argument("--millions", type=float, nargs="+", default=[50])
    parser.add_argument("--scratch", type=Path, required=True)
    parser.add_argument("--output", type=Path, required=True, help="JSON; sizes that it already holds are kept")
    parser.add_argument("--verbs", nargs="+", choices=VERBS, default=list(VERBS))
    known = parser.parse_args()
    known.scratch.mkdir(parents=True, exist_ok=True)
    report = read_json(known.output) if known.output.exists() else {"sizes": {}}
    for millions in known.millions:
        row = report["sizes"].setdefault(f"{millions:g}M", {})
        row |= lay_out(known.cloud, known.scratch / "cloud.laz", millions * 1e6)
        for verb in known.verbs:
            found = measure([word.format(known.scratch) if word != READING else word for word in VERBS[verb]])
            row[verb.replace("-", "_")] = {**found, "cpu_s_per_million": round(found["cpu_s"] / row["points"] * 1e6, 2)}
        report |= {"cloud": known.cloud.name, "laspy": laspy.__version__}
        report.pop("made_by", None)
        write_record(known.output, report)
        print(json.dumps(row, indent=1), flush=True)


if __name__ == "__main__":
    main()
