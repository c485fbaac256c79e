"""Put the outputs of ``treedgs benchmark`` and ``treedgs evaluate`` into the docs: one command each, nothing by hand.

    treedgs benchmark --quick --output OUT            (on an idle machine: the seconds count)
    treedgs benchmark --stability --output OUT
    treedgs benchmark --cost --output OUT
    treedgs evaluate --trees ... --truth ... --lidar ... --splats ... --workspace-in ... --output EVALUATION
    python -m benchmarks.evidence --from OUT [--evaluation EVALUATION ...]

Copies charts, CSV and JSON into ``docs/results/``, notes date, version and machine of each in ``published.json`` (so
run it where OUT was made, with the same version), and fills the parts of the pages between ``<!-- name -->`` and
``<!-- /name -->``. What is not in OUT stays as it is, and so does what other evaluations said.
"""

from __future__ import annotations

import argparse
import datetime
import json
import re
import shutil
from pathlib import Path

import pandas as pd

from benchmarks.records import RESULTS, ROOT, made_by
from treedgs_geo.core.files import read_json, write_json

DOCS = ROOT / "docs"
#: What is known of the files that carry no record themselves (CSV, SVG, HTML, TeX), by name.
PUBLISHED = RESULTS / "published.json"
#: Marker -> (page, file of OUT that fills it).
PARTS = {
    "chart-table": ("evidence/speed-accuracy.md", "speed-accuracy.md"),
    "cost-table": ("evidence/speed-accuracy.md", "cost.md"),
    "stability-table": ("evidence/stability.md", "stability.md"),
}
#: Copied as they are. HTML pages and PNG stay in OUT: they are large, and the SVG says the same.
COPIED = (
    "speed-accuracy.svg",
    "speed-accuracy.html",
    "benchmark.csv",
    "benchmark.json",
    "stability.csv",
    "stability-trees.csv",
    "stability-blocks.csv",
    "stability-factors.csv",
    "stability-photos.svg",
    "stability-reconstruction.svg",
    "stability-lidar.svg",
    "stability-curves.svg",
    "cost.json",
    "cost.svg",
)
METHODS = (
    "densities.svg",
    "trend.svg",
    "visibility.svg",
    "power.svg",
    "methods.csv",
    "methods.tex",
    "ablation.csv",
    "segmentation.csv",
    "oracle.csv",
    "method_trees.csv",
    "visibility.csv",
)


def fill(page: Path, marker: str, text: str) -> None:
    """Replace what stands between the markers."""
    old = page.read_text(encoding="utf-8")
    pattern = rf"(<!-- {marker} -->\n).*?(<!-- /{marker} -->)"
    new, count = re.subn(pattern, lambda m: f"{m.group(1)}\n{text.strip()}\n\n{m.group(2)}", old, flags=re.S)
    if count != 1:
        raise SystemExit(f"{page}: has no part <!-- {marker} -->")
    page.write_text(new, encoding="utf-8")


def publish(source: Path, name: str) -> None:
    """Copy one output to ``docs/results/NAME`` and note in ``published.json`` where it is from."""
    shutil.copy(source, RESULTS / name)
    known = read_json(PUBLISHED) if PUBLISHED.exists() else {}
    written = datetime.date.fromtimestamp(source.stat().st_mtime).isoformat()
    known[name] = made_by([0]) | {"output": f"{source.parent.name}/{source.name}", "date": written}
    write_json(PUBLISHED, dict(sorted(known.items())))
    print(f"docs/results/{name}")


def publish_part(source: Path, part: str) -> None:
    """Some seeds or methods of the stability suite: ``stability_PART-*.csv`` and the page's part of that name; or some
    plots of the chart: ``benchmark_PART.csv``."""
    if (source / "benchmark.csv").exists():
        publish(source / "benchmark.csv", f"benchmark_{part}.csv")
        return
    for name in ("levels", "factors", "trees"):
        file = "stability.csv" if name == "levels" else f"stability-{name}.csv"
        publish(source / file, f"stability_{part}-{name}.csv")
    fill(DOCS / "evidence" / "stability.md", f"stability-{part}", (source / "stability.md").read_text(encoding="utf-8"))


def others(page: Path, names: list[str]) -> list[str]:
    """The parts of the methods table about other plots than ``names``: they stay."""
    found = re.search(r"<!-- methods-table -->\n(.*?)<!-- /methods-table -->", page.read_text(encoding="utf-8"), re.S)
    parts = re.split(r"(?m)^(?=\*\*\S+\.\*\* )", found.group(1)) if found else []
    return [part.strip() for part in parts if part.strip() and not any(part.startswith(f"**{n}.**") for n in names)]


def methods_text(folder: Path) -> str:
    """The six methods, ours beside the paper's, and what else an evaluation says."""
    rows = pd.read_csv(folder / "methods.csv")
    rows = rows[rows["plot"] == "All"]
    metrics = json.loads((folder / "metrics.json").read_text())
    split = metrics["methods"]["split"]
    powers = ", ".join(f"{source} {p:g}" for source, p in metrics["methods"]["powers"].items())
    lines = [
        f"{len(split['held_out'])} stems held out (seed {split['seed']}): p = {powers}; {split['test']} stems tested.",
        "",
        "| source | fit | measured | RMSE cm | MAE cm | ME cm | RMSE on common stems (n) | "
        "*paper, other plots: RMSE* | *ME* |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for (source, fit), part in rows.groupby(["source", "fit"], sort=False):
        own, common = (part[part["subset"] == name].iloc[0] for name in ("own", "common"))
        lines.append(
            f"| {source} | {fit} | {own['n']:.0f} of {own['of']:.0f} | {_cm(own['rmse_cm'])} | "
            f"{_cm(own['mae_cm'])} | {_cm(own['me_cm'])} | {_cm(common['rmse_cm'])} ({common['n']:.0f}) | "
            f"*{_cm(own['paper_rmse_cm'])}* | *{_cm(own['paper_me_cm'])}* |"
        )
    lines += [
        "",
        f"The tree layer that was evaluated: RMSE {metrics['rmse_cm']:.2f} cm, "
        f"{metrics['n']} of {metrics['n_reference']} stems.",
    ]
    several = len({row["plot"] for row in metrics.get("segmentation", []) + metrics.get("runtime", [])}) > 1
    for row in metrics.get("segmentation", []):
        place = f" of {row['plot']}" if several else ""
        lines.append(
            f"Segmentation of the {row['source']} points{place}: precision {row['precision']}, recall {row['recall']}, "
            f"F1 {row['f1']}, IoU {row['iou']}."
        )
    for row in metrics.get("oracle", []):
        lines.append(
            f"{row['source']}, {row['fit']}, {row['labels']} labels: RMSE {_cm(row['rmse_cm'])} cm on "
            f"{row['common']} stems."
        )
    for seen in metrics.get("visibility", {}).get("against_truth", []):
        place = f" of {seen['plot']}" if several else ""
        related = "" if seen["stem_count_r"] is None else f", r = {seen['stem_count_r']} over stems"
        lines.append(
            f"Free views found from the photos{place} against the simulator: precision {seen['precision']}, recall "
            f"{seen['recall']} over {seen['views']} views{related}."
        )
    return "\n".join(
        line if line.startswith("|") or not line else line + ("" if line.endswith("|") else "  ") for line in lines
    )


def _cm(value: float | None) -> str:
    return "–" if value is None or pd.isna(value) else f"{value:.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--from", dest="source", type=Path, action="append", default=[], help="outputs of benchmark")
    parser.add_argument(
        "--part", help="--from has a part of the suite or of the chart: kept beside the whole by this name"
    )
    parser.add_argument("--evaluation", type=Path, action="append", default=[], help="outputs of evaluate, by plot")
    options = parser.parse_args()
    RESULTS.mkdir(exist_ok=True)
    for source in options.source:
        if options.part:
            publish_part(source, options.part)
            continue
        for name in COPIED:
            if (source / name).exists():
                publish(source / name, name)
        for marker, (title, name) in PARTS.items():
            if (source / name).exists():
                fill(DOCS / title, marker, (source / name).read_text(encoding="utf-8"))
                print(f"docs/{title}: {marker}")
    texts = []
    for folder in options.evaluation:
        for name in METHODS:
            if (folder / name).exists():
                publish(folder / name, f"{folder.name}-{name}")
        texts.append(f"**{folder.name}.** {methods_text(folder)}")
    if texts:
        page = DOCS / "evidence" / "published-methods.md"
        fill(page, "methods-table", "\n\n".join(others(page, [folder.name for folder in options.evaluation]) + texts))


if __name__ == "__main__":
    main()
