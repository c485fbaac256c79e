"""Make the simulated plots of the campaign benchmarks, and their manifest.

    python -m treedgs_lab.benchmarks.campaign.plots --output build/campaign_plots --clouds 39 --photos 1

Each plot is ``simulate-plot`` with its own seed: cloud plots with few, tiny photos (they are not used) and a LiDAR
cloud, photo plots of the preset ``test``. Plots that are there already are kept. ``plots.csv`` is the manifest.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

from treedgs_geo.core.progress import make_reporter
from treedgs_lab.benchmarks.verbs import CRS
from treedgs_lab.simulate.settings import SimulateSettings
from treedgs_lab.simulate.simulate import simulate_plot

#: Of a plot whose cloud is used: as few and small as the simulator allows.
FEW_PHOTOS: dict = {"photos": 10, "image_width": 320, "image_height": 240, "gsd_cm": 2.5, "samples": 1}
#: Pulses per square metre, one after the other: plots of different sizes.
DENSITIES = (400.0, 700.0, 1000.0, 1400.0)


def cloud_plot(folder: Path, seed: int) -> SimulateSettings:
    """A plot whose cloud is used."""
    return SimulateSettings(
        output=folder, preset="test", seed=seed, lidar_density_m2=DENSITIES[seed % len(DENSITIES)], **FEW_PHOTOS
    )


def photo_plot(folder: Path, seed: int) -> SimulateSettings:
    """A plot whose photos are used."""
    return SimulateSettings(output=folder, preset="test", seed=seed, lidar_density_m2=0.0)


def main() -> int:
    """Make what is missing; write the manifest."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--clouds", type=int, default=39)
    parser.add_argument("--photos", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=1000)
    given = parser.parse_args()
    rows = []
    for number in range(given.clouds + given.photos):
        is_cloud = number < given.clouds
        seed = given.first_seed + number if is_cloud else 1 + number - given.clouds
        name = f"{'cloud' if is_cloud else 'photo'}_{seed}"
        folder = given.output / name
        if not (folder / "truth" / "config.json").exists():
            settings = (cloud_plot if is_cloud else photo_plot)(folder, seed)
            simulate_plot(settings, make_reporter("quiet"))
            print(name, flush=True)
        rows.append(
            {
                "plot_id": name,
                "cloud": f"{name}/lidar/{name}_uls.laz" if is_cloud else "",
                "photos": "" if is_cloud else f"{name}/images",
                "geotags": "" if is_cloud else name,
                "crs": CRS,
                "field": f"{name}/field_trees.csv",
                "plots": f"{name}/plots.csv",
            }
        )
    with open(given.output / "plots.csv", "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
