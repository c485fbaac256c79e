"""``photos-to-dbh``: the whole chain, from drone photos to tree points."""

from __future__ import annotations

from typing import Any

from ..core.calibration import CALIBRATION, NETWORK, TAPE
from ..core.command import Command
from ..core.progress import Reporter
from ..run.settings import PhotosToDbhSettings


def photos_to_dbh(settings: PhotosToDbhSettings, reporter: Reporter) -> dict[str, Any]:
    """Run the chain, only check its inputs, or measure at given places of a finished run."""
    from ..run.given import measure_given
    from ..run.photos import check_photos, run_chain

    chosen = check_photos if settings.dry_run else run_chain if settings.at is None else measure_given
    return chosen(settings, reporter)


COMMAND = Command(
    name="photos-to-dbh",
    title="Measure DBH from drone photos",
    group="2 Measure",
    summary="Drone photos (and PPK geotags) in, tree points with DBH, error and reasons out.",
    help=(
        "Inputs: overlapping drone photos taken above the canopy, most of them oblique (30 to 50 degrees from "
        "straight down), at about 2 cm a pixel or finer; PPK or RTK geotags. Output: one point per stem found, with "
        "DBH (cm), its standard error and 90 % interval (cm), and a reason wherever no DBH could be measured. Stems "
        "under 7.5 cm and stems that fewer than three photos see at breast height are refused. A second run in the "
        f"same workspace resumes. {CALIBRATION} {NETWORK} {TAPE}"
    ),
    settings=PhotosToDbhSettings,
    run=photos_to_dbh,
    main=("photos", "geotags", "plots", "crs", "dtm", "dry_run", "workspace", "output"),
    example=(
        "treedgs photos-to-dbh --photos flight/images --geotags flight --crs EPSG:6344 --plots flight/plots.csv "
        "--workspace work --output trees.gpkg"
    ),
    outputs={
        "output": "tree layer (file)",
        "report": "HTML report (file)",
        "workspace": "folder of the results",
        "run": "run.json: parameters, versions, seconds, peak memory (file)",
        "n_trees": "stems found",
        "n_measured": "stems with a DBH",
        "n_rejected": "stems without one, each with a reason",
        "mean_dbh_cm": "mean DBH of the measured stems, cm",
        "n_photos": "photos that can be used (dry run)",
        "fix_pct": "photos with a fixed position, % (dry run)",
        "overlap_pct": "ground that neighbouring photos share, % (dry run)",
        "n_tiles": "tiles that are searched for stems (dry run)",
        "predicted_s": "estimated time, s (dry run)",
        "needed_memory_gb": "estimated memory, GB (dry run)",
        "needed_disk_gb": "estimated disk, GB (dry run)",
        "status": "what came out, in one sentence",
    },
)
