"""``fit-gaussians``: the Gaussian field of the stem band."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core import workspace as names
from ..core.command import Command
from ..core.errors import InputError
from ..core.files import fingerprint
from ..core.progress import Reporter
from ..core.settings import param, to_json
from ..core.workspace import Workspace
from ..stems.splats.options import GaussianOptions


@dataclass(frozen=True, kw_only=True)
class FitGaussiansSettings(GaussianOptions):
    """Parameters of ``fit-gaussians``."""

    workspace: Path = param(kind="folder", help="Workspace with sfm/ and dtm.tif; field.ply is written there.")
    photos: Path | None = param(
        None, kind="folder", help="Folder of the reconstructed photos; without it the one in run.json."
    )
    seeds: Path | None = param(
        None,
        kind="file",
        suffixes=(".gpkg", ".csv", ".shp", ".geojson"),
        help="Stem positions, good to a few decimetres: a point layer, or a CSV with x, y in the project CRS; "
        "without it trees.gpkg of the workspace.",
    )


def fit_gaussians(settings: FitGaussiansSettings, reporter: Reporter) -> dict[str, Any]:
    """Fit and write ``field.ply``; the record goes to ``run.json``."""
    with open_workspace(settings.workspace) as space:
        return _fit(settings, space, reporter)


def _fit(settings: FitGaussiansSettings, space: Workspace, reporter: Reporter) -> dict[str, Any]:
    from ..run.photo_files import views_of
    from ..stems.splats.ply import frame_path, write_field
    from ..stems.splats.train import fit_with_report, read_seeds
    from ..terrain.dtm import read_dtm

    frame, views = views_of(space, photo_folder(space, settings.photos), reporter)
    dtm_file = space.path(names.DTM)
    if not dtm_file.exists():
        raise InputError(f"{dtm_file}: not found; run the terrain step first (treedgs terrain) or copy a DTM there.")
    ground = read_dtm(dtm_file, frame.crs).local(frame)
    seeds_file = settings.seeds or space.path(names.TREES)
    if settings.seeds is None and not seeds_file.exists():
        raise InputError(
            f"{seeds_file}: not found, so no stem position is known; give --seeds or run photos-to-dbh first."
        )
    seeds = read_seeds(seeds_file, frame)
    target = space.path(names.FIELD)
    with space.running("fit-gaussians", fingerprint([dtm_file, seeds_file]), to_json(settings)) as result:
        field, report = fit_with_report(views, frame, ground, seeds, settings, reporter)
        write_field(target, field, frame)
        result.update(
            field=str(target),
            frame=str(frame_path(target)),
            gaussians=len(field),
            stems=len(report.stems),
            photos=report.photos,
            megapixels=report.megapixels,
            per_stem=report.stems,
            stem_table=_write_stems(space, report, frame, settings.bh_m),
            warnings=report.warnings,
        )
    reporter.info(
        f"{len(field)} Gaussians for {len(report.stems)} of {len(seeds)} stems, {report.megapixels} megapixels in crops"
    )
    return dict(result)


def _write_stems(space, report, frame, bh_m: float) -> str | None:
    """``stem_primitives.csv``: one row per fitted primitive; its path, None where none was fitted."""
    from dataclasses import asdict

    import pandas as pd

    from ..core.files import atomic_path
    from ..core.tables import safe_frame
    from ..stems.splats.trees import trees_of_primitives

    trees = trees_of_primitives(report.primitives, frame, bh_m)
    if not trees:
        return None
    columns = (
        "tree_id",
        "x",
        "y",
        "z_ground",
        "dbh_cm",
        "dbh_se_cm",
        "dbh_lo_cm",
        "dbh_hi_cm",
        "bh_m",
        "lean_deg",
        "taper_cm_m",
        "n_views",
        "qc_flag",
        "qc_reason",
    )
    target = space.path("stem_primitives.csv")
    table = pd.DataFrame([asdict(tree) for tree in trees])[list(columns)].round({"x": 3, "y": 3, "z_ground": 3})
    with atomic_path(target) as temporary:
        safe_frame(table).to_csv(temporary, index=False)
    return str(target)


@contextmanager
def open_workspace(folder: Path) -> Iterator[Workspace]:
    """An existing workspace, for this process alone.

    Raises:
        InputError: the folder does not hold a reconstruction, or another run works there.
    """
    if not (folder / names.SFM).is_dir():
        raise InputError(
            f"{folder}: has no {names.SFM}/ folder, expected a workspace with a reconstruction; run reconstruct first."
        )
    with Workspace.held(folder) as space:
        yield space


def photo_folder(space, given: Path | None) -> Path:
    """The photos' folder: given, or as recorded in ``run.json``.

    Raises:
        InputError: neither is there.
    """
    if given is not None:
        if not given.is_dir():
            raise InputError(f"{given}: is not a folder; give the folder of the reconstructed photos with --photos.")
        return given
    candidates = [space.record.get("parameters") or {}]
    candidates += [stage.get("settings") or {} for stage in space.record["stages"].values()]
    for candidate in candidates:
        folder = candidate.get("photos") if isinstance(candidate, dict) else None
        if folder and isinstance(folder, str) and Path(folder).is_dir():
            return Path(folder)
    raise InputError(f"{space.folder}: run.json does not say where the photos are (or they moved); give --photos.")


COMMAND = Command(
    name="fit-gaussians",
    qgis_id="fitgaussians",
    title="Fit Gaussians to the stem band",
    group="5 Steps and research",
    summary="Stem primitives fitted to the photos, and 3D Gaussians on their bark, from the ground to a few metres.",
    help=(
        "Needs a workspace with a reconstruction (sfm/) and a terrain model (dtm.tif), and stem positions good to a "
        "few decimetres. For each stem a tapered, leaning primitive with a texture is fitted to crops of the photos, "
        "the ground behind being a texture of its own. Output: stem_primitives.csv with the diameters, and field.ply, "
        "flat Gaussians on the bark in the standard 3DGS format and local metres (its origin and CRS are in "
        "field.frame.json beside it)."
    ),
    settings=FitGaussiansSettings,
    run=fit_gaussians,
    main=("workspace", "photos", "seeds"),
    example="treedgs fit-gaussians --workspace work/plot1 --seeds stems.gpkg",
    outputs={
        "field": "Gaussian field (3DGS PLY, local metres)",
        "gaussians": "number of Gaussians",
        "stems": "stems fitted",
    },
)
