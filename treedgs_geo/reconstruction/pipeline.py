"""Photos with stations -> one georeferenced block."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

from ..core.errors import ReconstructionError
from ..core.progress import Reporter
from ..geotags.control import ControlPoints
from ..geotags.photos import read_photo
from ..geotags.stations import Stations
from .calibration import calibration_record
from .matching_strategy import Work, climb, levels_of
from .model import save_model
from .options import ReconstructOptions
from .prior_knowledge import survey_of


def reconstruct_photos(
    stations: Stations,
    options: ReconstructOptions,
    sfm_folder: Path,
    reporter: Reporter | None = None,
    control: ControlPoints | None = None,
    calibration_file: Path | None = None,
) -> dict[str, Any]:
    """Structure from motion in the project CRS; writes ``sfm_folder`` and returns its report.

    stations: from :func:`~treedgs_geo.geotags.reading.read_stations`. sfm_folder: replaced as a whole on success;
    features and matches are kept in ``cache/`` beside it while the work goes on, so that a stopped run resumes.
    control: ground control and check points. calibration_file: ``camera.json`` of an earlier reconstruction with this
    camera.

    Raises:
        ReconstructionError: too few photos register, or the result contradicts geotags, calibration or flying height.
    """
    reporter = reporter or Reporter()
    began = time.monotonic()
    if len(stations) < 3:
        raise ReconstructionError(
            f"{len(stations)} usable photos: structure from motion needs at least 3, a plot 30 or more; add photos."
        )
    sfm_folder = Path(sfm_folder)
    work = Work(stations, options, survey_of(stations, control, calibration_file), sfm_folder)
    levels = levels_of(options.neighbours, work.survey.can_guide)
    level, joined, report, climbed = climb(work, levels, reporter)
    report |= {"seconds": round(time.monotonic() - began, 1), "level": level.name, "climbed_because": climbed}
    survey = work.survey
    record = calibration_record(read_photo(stations.paths[0]).model, joined.block.sensor, report["lens_sd"])
    save_model(sfm_folder, joined.block, stations.names, stations.paths, stations.flight, survey.frame, report, record)
    shutil.rmtree(work.cache, ignore_errors=True)
    if not any(work.cache_root.iterdir()):
        work.cache_root.rmdir()
    return report
