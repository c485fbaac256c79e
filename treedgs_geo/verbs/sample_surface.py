"""``sample-surface``: surface points with opacity reliability from a Gaussian field."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..core import workspace as names
from ..core.command import Command
from ..core.files import fingerprint
from ..core.progress import Reporter
from ..core.settings import param, to_json
from ..stems.splats.options import SampleOptions


@dataclass(frozen=True, kw_only=True)
class SampleSurfaceSettings(SampleOptions):
    """Parameters of ``sample-surface``."""

    workspace: Path = param(kind="folder", help="Workspace with sfm/ and field.ply; surface.laz is written there.")
    photos: Path | None = param(
        None, kind="folder", help="Folder of the reconstructed photos; without it the one in run.json."
    )


def sample_surface(settings: SampleSurfaceSettings, reporter: Reporter) -> dict[str, Any]:
    """Sample, score and write ``surface.laz``."""
    from ..pointcloud.files import write_cloud
    from ..run.geotag_stage import views_of
    from ..run.published_plot import check_torch, sample_gaussians
    from ..stems.splats.ply import read_field
    from .fit_gaussians import open_workspace, photo_folder

    check_torch()
    with open_workspace(settings.workspace) as space:
        frame, views = views_of(space, photo_folder(space, settings.photos), reporter)
        field_file, target = space.path(names.FIELD), space.path(names.SURFACE)
        field = read_field(field_file, frame)
        with space.running("sample-surface", fingerprint([field_file]), to_json(settings)) as result:
            cloud = sample_gaussians(field, frame, views, settings, reporter)
            write_cloud(target, cloud)
            result.update(surface=str(target), points=len(cloud), gaussians=len(field), views=len(views))
        reporter.info(f"{len(cloud)} surface points from {len(field)} Gaussians, {len(views)} photos")
        return dict(result)


COMMAND = Command(
    name="sample-surface",
    title="Sample surface points from Gaussians",
    group="5 Steps and research",
    summary="Points drawn inside the Gaussians, each with its opacity reliability over the photos.",
    help=(
        "Needs a workspace with field.ply (fit-gaussians), and the package torch. Draws up to M points inside each "
        "Gaussian, thinned by its opacity, and scores each by the opacity in front of it in every photo: the smallest "
        "over the photos that show Gaussians there is kept. Output: surface.laz in the project CRS with the extra "
        "dimensions opacity (0..1) and n_views (photos that show Gaussians there)."
    ),
    settings=SampleSurfaceSettings,
    run=sample_surface,
    main=("workspace", "photos"),
    example="treedgs sample-surface --workspace work",
    outputs={"surface": "surface points (LAZ with opacity, n_views)", "points": "number of points"},
)
