"""The chart of the docs, from ``docs/results``: open and dense plots apart, and where the published method stands.

    python -m treedgs_lab.benchmarks.chart

``published.json`` keeps of the picture what it keeps of ``benchmark.csv``.
"""

from __future__ import annotations

import pandas as pd

from treedgs_geo.core.files import read_json, write_json
from treedgs_geo.report.charts import chart_svg
from treedgs_lab.benchmarks.figures import PUBLISHED, content
from treedgs_lab.benchmarks.records import RESULTS
from treedgs_lab.benchmarks.speed.pictures import draw_panel, finish, new_panels

#: What came to be no comparison: rows of older runs that are not shown.
LEFT = ("splat-primitive", "edges-only", "lidar-circle", "lidar-intensity")


def published_method() -> list[dict]:
    """Its publication's own point (other plots, a GPU), and our truncated re-implementation on ``plot_a``."""
    paper = next(
        row for row in content("plot_a-methods.csv") if (row["source"], row["fit"]) == ("splats", "weighted circle")
    )
    ours = content("gaussian_arms_plot_a.json")["arms"]["paper"]
    minutes = content("cost.json")["paper_case"]["minutes"]
    rows = [
        ("publication, its own plots", 60 * minutes, paper["paper_rmse_cm"], None, 189),
        (
            f"re-implemented, {ours['published_fit']['steps']:,} of 30,000 steps",
            ours["cpu_s"],
            ours["rmse_cm"],
            ours["success_rate"],
            ours["n_reference"],
        ),
    ]
    return [
        {
            "title": title,
            "group": "published method",
            "seconds": seconds,
            "seconds_lo": seconds,
            "seconds_hi": seconds,
            "rmse_cm": rmse,
            "rmse_lo": rmse,
            "rmse_hi": rmse,
            "success": success,
            "stems": stems,
            "front": False,
        }
        for title, seconds, rmse, success, stems in rows
    ]


def main() -> None:
    """Draw and write it."""
    figure, panels = new_panels(13, 6, ncols=2)
    for axes, name, title, more in (
        (panels[0], "benchmark.csv", "open plots, plot_a and plot_e; 1 core", published_method()),
        (panels[1], "benchmark_dense.csv", "dense plot, plot_h; 1 core", []),
    ):
        rows = [row for row in content(name) if row["key"] not in LEFT]
        table = pd.DataFrame(rows + more)
        table["front"] = table["front"].astype(str) == "True"
        draw_panel(axes, table, title)
    finish(figure, panels[0])
    (RESULTS / "speed-accuracy.svg").write_bytes(chart_svg(figure))
    known = read_json(PUBLISHED)
    known["speed-accuracy.svg"] = {**known["benchmark.csv"], "command": "python -m treedgs_lab.benchmarks.chart"}
    write_json(PUBLISHED, dict(sorted(known.items())))


if __name__ == "__main__":
    main()
