"""``fit-gaussians``: the Gaussians of a plot, as published."""

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
from ..run.settings import plots_option
from ..stems.splats.options import dense_option, device_option, time_limit_option


@dataclass(frozen=True, kw_only=True)
class FitGaussiansSettings:
    """Parameters of ``fit-gaussians``."""

    workspace: Path = param(kind="folder", help="Workspace with sfm/ and dtm.tif; field.ply is written there.")
    photos: Path | None = param(
        None, kind="folder", help="Folder of the reconstructed photos; without it the one in run.json."
    )
    plots: Path | None = plots_option()
    dense: Path | None = dense_option()
    time_limit: float = time_limit_option()
    device: str = device_option()
    #: Of every random choice; of the library only.
    seed: int = 0


def fit_gaussians(settings: FitGaussiansSettings, reporter: Reporter) -> dict[str, Any]:
    """Fit and write ``field.ply``; the record goes to ``run.json``."""
    from ..core.plots import read_plots
    from ..reconstruction.model import load_points
    from ..run.context import Site, area_of
    from ..run.geotag_stage import views_of
    from ..run.published_plot import check_torch
    from ..run.published_plot import fit_gaussians as fit
    from ..stems.splats.options import SceneOptions
    from ..stems.splats.ply import frame_path, write_field
    from ..terrain.dtm import read_dtm

    check_torch(settings.device)
    with open_workspace(settings.workspace) as space:
        frame, views = views_of(space, photo_folder(space, settings.photos), reporter)
        dtm_file = space.path(names.DTM)
        if not dtm_file.exists():
            raise InputError(f"{dtm_file}: not found; run photos-to-dbh in this workspace first, or copy a DTM there.")
        sparse = load_points(space.path(names.SFM))
        area = area_of(frame, views, sparse, read_plots(settings.plots, frame.crs) if settings.plots else [])
        if not len(area.radii_m):
            raise InputError(
                f"{space.folder}: no place is seen by six or more oblique photos, expected a plot that is; give "
                "--plots."
            )
        site = Site(frame, views, read_dtm(dtm_file, frame.crs), area)
        scene = SceneOptions(time_limit_min=settings.time_limit, device=settings.device, seed=settings.seed)
        target, used = space.path(names.FIELD), [path for path in (dtm_file, settings.dense, settings.plots) if path]
        with space.running("fit-gaussians", fingerprint(used), to_json(settings)) as result:
            field, facts = fit(site, sparse, scene, settings.dense, reporter)
            write_field(target, field, frame)
            result.update(field=str(target), frame=str(frame_path(target)), gaussians=len(field), **facts)
        return dict(result)


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
    title="Fit Gaussians to a plot",
    group="5 Steps and research",
    summary="3D Gaussians over the whole plot, fitted to all photos as published.",
    help=(
        "The first step of the published method, which photos-to-dbh --preset paper runs as a whole; sample-surface, "
        "segment-stems and measure-dbh are the others. Needs a workspace with a reconstruction (sfm/) and a terrain "
        "model (dtm.tif), and the package torch. Output: field.ply, Gaussians in the standard 3DGS format and local "
        "metres (its origin and CRS are in field.frame.json beside it). A short --time-limit means fewer steps and "
        "smaller photos; run.json says how far the fit came."
    ),
    settings=FitGaussiansSettings,
    run=fit_gaussians,
    main=("workspace", "photos", "plots", "time_limit"),
    example="treedgs fit-gaussians --workspace work --plots flight/plots.csv",
    outputs={"field": "Gaussian field (3DGS PLY, local metres)", "gaussians": "number of Gaussians"},
)
