"""Fill the table of result files in ``benchmarks/README.md``: what writes each, and with which version and when it was.

    python -m benchmarks.index

Files say it themselves (``made_by``); ``published.json`` says it for charts and tables. What version 0.1.0 wrote says
nothing: of those, version and date are kept in :data:`BEFORE_RECORDS` until they are written again.
"""

from __future__ import annotations

import re
from fnmatch import fnmatch
from pathlib import Path

from benchmarks.records import RESULTS, ROOT
from treedgs_geo.core.files import read_json

README = ROOT / "benchmarks" / "README.md"
#: Results -> the module that writes them.
WRITERS = {
    "altered_photos*.json": "benchmarks.photos.altered_photos",
    "benchmark*.*": "benchmarks.evidence",
    "bowed_stems.json": "benchmarks.clouds.bowed_stems",
    "campaign_costs.json": "benchmarks.campaign.costs",
    "campaign_*.json": "benchmarks.campaign.campaigns",
    "carried_down*.json": "benchmarks.photos.carried_down",
    "cancel_time.json": "benchmarks.chain.cancel_time",
    "circle_stage.json": "benchmarks.clouds.circle_stage",
    "cold_start.json": "benchmarks.chain.cold_start",
    "cost.*": "benchmarks.evidence",
    "demo-*": "benchmarks.evidence",
    "dense_clouds.json": "benchmarks.clouds.dense_clouds",
    "determinism*.json": "benchmarks.chain.determinism",
    "flights*.json": "benchmarks.reconstruction.flights",
    "gaussian_absolute.json": "benchmarks.gaussians.absolute",
    "gaussian_arms*.json": "benchmarks.gaussians.arms",
    "gaussian_band*.json": "benchmarks.gaussians.band",
    "gaussian_chain.json": "benchmarks.photos.photos_to_dbh",
    "gaussian_choices.json": "benchmarks.gaussians.choices",
    "gaussian_exponent.json": "benchmarks.gaussians.exponent",
    "gaussian_free_*.json": "benchmarks.gaussians.route",
    "gaussian_growth.json": "benchmarks.gaussians.growth",
    "gaussian_route_*.json": "benchmarks.gaussians.route",
    "gaussian_throughput.json": "benchmarks.gaussians.throughput",
    "gaussian_torch.json": "benchmarks.gaussians.torch_overhead",
    "given_stems.json": "benchmarks.chain.given_stems",
    "geotags.json": "benchmarks.reconstruction.geotags",
    "ground_filters.json": "benchmarks.terrain.filters",
    "ground_cut.json": "benchmarks.terrain.ground_cut",
    "height_and_photos.*": "benchmarks.photos.height_and_photos",
    "heights*.json": "benchmarks.photos.heights",
    "interval_coverage.json": "benchmarks.clouds.interval_coverage",
    "ivied_stems.json": "benchmarks.clouds.ivied_stems",
    "large_cloud.json": "benchmarks.clouds.large_cloud",
    "large_grid.json": "benchmarks.photos.large_photos",
    "leaning_stems.json": "benchmarks.photos.leaning_stems",
    "lidar_exponent.json": "benchmarks.gaussians.exponent",
    "matching.json": "benchmarks.reconstruction.matching",
    "micro-*": "benchmarks.evidence",
    "install_matrix.json": "benchmarks.chain.install_matrix",
    "qgis_versions.json": "benchmarks.chain.qgis_versions",
    "wheels.json": "benchmarks.chain.wheels",
    "pairing.json": "benchmarks.inventory.pairing",
    "photo_choice*.json": "benchmarks.photos.choice",
    "photos_side_by_side.json": "benchmarks.photos.side_by_side",
    "photos_to_dbh*.json": "benchmarks.photos.photos_to_dbh",
    "photos_*.json": "benchmarks.photos.stems_from_photos",
    "planning_chain.json": "benchmarks.planning.chain",
    "planning_curves.json": "benchmarks.planning.curves",
    "planning_seconds.json": "benchmarks.planning.seconds",
    "planning_views.json": "benchmarks.planning.views",
    "plot_a-*": "benchmarks.evidence",
    "pointcloud_accuracy.json": "benchmarks.clouds.accuracy",
    "published.json": "benchmarks.evidence",
    "matcher_chain.json": "benchmarks.reconstruction.matcher_chain",
    "moved_sun.json": "benchmarks.reconstruction.moved_sun",
    "reconstruction.json": "benchmarks.reconstruction.accuracy",
    "reconstruction_today.json": "benchmarks.reconstruction.accuracy",
    "reconstruction_levels.json": "benchmarks.reconstruction.levels",
    "recall.json": "benchmarks.photos.recall",
    "rolling_shutter.json": "benchmarks.reconstruction.rolling_shutter",
    "second_measurement.json": "benchmarks.photos.second_measurement",
    "segmentation.json": "benchmarks.clouds.segmentation",
    "sheets_cost.json": "benchmarks.chain.sheets_cost",
    "side_by_side.json": "benchmarks.clouds.side_by_side",
    "speed-accuracy.*": "benchmarks.evidence",
    "stability*": "benchmarks.evidence",
    "hard_stands*.json": "benchmarks.photos.hard_stands",
    "stem_network*.json": "benchmarks.photos.stem_network",
    "taping.json": "benchmarks.inventory.taping",
    "two_dates.json": "benchmarks.inventory.two_dates",
    "stand_table.json": "benchmarks.inventory.stand_table",
    "terrain.json": "benchmarks.terrain.accuracy",
}
#: Of these, none is kept so far: no page quotes them.
NOT_KEPT = {
    "ground_filters.json",
    "matching.json",
    "pointcloud_accuracy.json",
    "published.json",
    "second_measurement.json",
}
#: Results that carry no record -> version and date of their writing, from the history of this repository.
BEFORE_RECORDS = {
    "benchmark.*": ("0.1.0", "2026-11-22"),
    "cost.*": ("0.1.0", "2026-11-22"),
    "demo-*": ("0.1.0", "2026-11-22"),
    "dense_clouds.json": ("0.1.0", "2026-11-22"),
    "determinism.json": ("0.1.0", "2026-11-21"),
    "determinism_*.json": ("0.1.0", "2026-11-22"),
    "gaussian_band*.json": ("0.1.0", "2026-11-22"),
    "gaussian_chain.json": ("0.1.0", "2026-11-22"),
    "gaussian_choices.json": ("0.1.0", "2026-11-22"),
    "gaussian_free_seed_91.json": ("0.1.0", "2026-11-22"),
    "ground_cut.json": ("0.1.0", "2026-11-22"),
    "height_and_photos.svg": ("0.2.0", "2026-11-22"),
    "photos_to_dbh.json": ("0.2.0", "2026-11-23"),
    "side_by_side.json": ("0.1.0", "2026-11-22"),
    "speed-accuracy.*": ("0.1.0", "2026-11-22"),
    "stability-blocks.csv": ("0.2.0", "2026-11-23"),
    "stability*": ("0.1.0", "2026-11-22"),
    "*": ("0.1.0", "2026-11-21"),
}


def writer(name: str) -> str | None:
    """The module that writes a result; None where nothing does."""
    return next((module for pattern, module in WRITERS.items() if fnmatch(name, pattern)), None)


def origin(path: Path) -> tuple[str, str]:
    """Version and date of a result's writing."""
    content = read_json(path) if path.suffix == ".json" else {}
    made = content.get("made_by") if isinstance(content, dict) else None
    published = RESULTS / "published.json"
    if made is None and published.exists():
        made = read_json(published).get(path.name)
    if made is not None:
        return made["version"], made["date"]
    return next(known for pattern, known in BEFORE_RECORDS.items() if fnmatch(path.name, pattern))


def table() -> str:
    """The table, one row for files that one module wrote with one version on one day."""
    groups: dict[tuple, list[str]] = {}
    for path in sorted(RESULTS.iterdir()):
        groups.setdefault((writer(path.name) or "?", *origin(path)), []).append(f"`{path.name}`")
    rows = [
        f"| `{module}` | {version} | {date} | {', '.join(files)} |"
        for (module, version, date), files in sorted(groups.items())
    ]
    return "\n".join(["| written by | version | date | files of `docs/results/` |", "|---|---|---|---|", *rows])


def filled(text: str) -> str:
    """The page with the table in its place."""
    return re.sub(r"(<!-- results -->\n).*?(<!-- /results -->)", rf"\1\n{table()}\n\n\2", text, flags=re.S)


def main() -> None:
    """Write the page."""
    README.write_text(filled(README.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
