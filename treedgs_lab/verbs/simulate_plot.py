"""``simulate-plot``: a synthetic plot with photos, PPK files, LiDAR, field table and truth."""

from __future__ import annotations

from typing import Any

from treedgs_geo.core.command import Command
from treedgs_geo.core.progress import Reporter

from ..simulate.settings import SimulateOptions


def run(settings: SimulateOptions, reporter: Reporter) -> dict[str, Any]:
    """Render the plot; see :func:`treedgs_lab.simulate.simulate.simulate_plot`."""
    from ..simulate.simulate import simulate_plot

    return simulate_plot(settings.whole(), reporter)


COMMAND = Command(
    name="simulate-plot",
    title="Simulate a plot",
    group="5 Steps and research",
    summary="Make a synthetic forest plot: drone photos, PPK files, LiDAR, field table and truth.",
    help=(
        "Grows a pine stand on rough ground and photographs it by ray casting in two oblique flights, with occluding "
        "crowns, shrubs and cast shadows, lens distortion and sensor noise. Writes images/ (EXIF, GPS, DJI XMP), the "
        "MRK and .pos files, dtm.tif, plots.csv, field_trees.csv, lidar/ and truth/ (for scoring only). Coordinates "
        "are EPSG:6344, heights ellipsoidal metres, DBH centimetres. Use it to try the chain, to test, or to see what "
        "a flight plan would measure. Real photos are harder than the defaults: wind, rolling shutter, motion blur, a "
        "real lens and sensor, grid flights over several plots and odd stands are options of treedgs simulate-plot, "
        "which its own help lists."
    ),
    settings=SimulateOptions,
    run=run,
    main=("output", "preset", "radius_m", "stems_per_ha", "dbh_mean_cm", "photos", "gsd_cm"),
    example="treedgs simulate-plot --output flight --preset demo",
    outputs={
        "output": "the plot's folder",
        "name": "plot name used in the files",
        "n_photos": "photos rendered",
        "n_stems": "stems inside the plot",
        "n_lidar_points": "points of the LiDAR cloud",
        "median_unoccluded_views": "photos that see a stem's breast height free (median over the stems)",
        "seconds": "seconds it took",
    },
)
