"""What the point-cloud verbs share: the cloud, its CRS and the ground under it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.errors import InputError
from ..core.machine import require_memory
from ..core.progress import Reporter
from ..core.scale import check_place
from .settings import CloudSettings

if TYPE_CHECKING:
    import numpy as np

    from ..pointcloud.cloud import PointCloud
    from ..terrain.cloud_ground import CloudGround

#: Memory of a point while a cloud is read: coordinates twice, a few attributes.
_POINT_BYTES = 60


def load_cloud(
    settings: CloudSettings, reporter: Reporter, attributes: tuple[str, ...] | None = None, find_stems: bool = True
) -> PointCloud:
    """Read the cloud, refuse what cannot be a stand in metres, and say what it is.

    find_stems: stems are to be found in it, not only measured.

    Raises:
        InputError, CRSError: see :func:`treedgs_geo.pointcloud.files.read_cloud`,
            :func:`treedgs_geo.pointcloud.sanity.examine` and :func:`treedgs_geo.core.scale.check_place`.
    """
    if attributes is not None:
        attributes = (*attributes, "classification", "withheld")
    with reporter.stage("read cloud", 0.0, 0.15):
        cloud = read_checked(settings.input, settings.crs, reporter, attributes, find_stems, settings.dtm is not None)
    where = cloud.horizontal_crs.name if cloud.horizontal_crs is not None else "local metres, no CRS"
    span = cloud.xyz.max(axis=0) - cloud.xyz.min(axis=0)
    reporter.info(f"{len(cloud):,} points, {span[0]:.0f} x {span[1]:.0f} m, {where}.")
    return cloud


def read_checked(
    path: Path,
    crs: str | None,
    reporter: Reporter,
    attributes: tuple[str, ...] | None = None,
    find_stems: bool = True,
    own_ground: bool = False,
) -> PointCloud:
    """The cloud without its far strays; what is odd about it is said.

    Raises:
        InputError, CRSError: as :func:`load_cloud`.
    """
    from ..pointcloud.files import describe_cloud, read_cloud

    about = describe_cloud(path)
    require_memory(
        _POINT_BYTES * about.n_points,
        f"{path}: reading {about.n_points:,} points at once",
        "cut the cloud to the plots, thin it, or use a machine with more memory",
    )
    cloud = read_cloud(path, crs=crs, attributes=attributes)
    return checked(cloud, path, reporter, find_stems, about.scale, own_ground)


def checked(
    cloud: PointCloud,
    path: Path,
    reporter: Reporter,
    find_stems: bool = True,
    scale: np.ndarray | None = None,
    own_ground: bool = False,
) -> PointCloud:
    """The cloud without its far strays; what is odd about it is said. path: what messages call it. scale: (3,) of the
    coordinates as they were stored, where known.

    Raises:
        InputError, CRSError: as :func:`load_cloud`.
    """
    from ..pointcloud.cloud import usable
    from ..pointcloud.sanity import examine, report
    from ..pointcloud.survey import Survey

    good = usable(cloud)
    survey = Survey()
    survey.add(cloud.xyz if good.all() else cloud.xyz[good])
    extent, findings = examine(survey, path, find_stems, scale, own_ground)
    report(findings, reporter)
    near = extent.holds(cloud.xyz)
    cloud = cloud if near.all() or not good.any() else cloud.select(near)
    check_place(cloud.crs, cloud.xyz, str(path), reporter)
    return cloud


def load_ground(path: Path, dtm_path: Path | None, cloud: PointCloud, reporter: Reporter) -> CloudGround:
    """The ground under the cloud that messages call ``path``: the user's DTM held against what the cloud shows, the
    ground in the cloud, or (one bare tree) its lowest points.

    Raises:
        InputError: the DTM does not cover the cloud or has other heights; no ground was found.
    """
    from ..pointcloud.cloud import thin, usable
    from ..terrain.cloud_ground import found_ground, given_ground
    from ..terrain.dtm import read_dtm, require_coverage

    good = usable(cloud)
    if not good.any():
        raise InputError(f"{path}: holds no usable point (all are noise or withheld); check the file.")
    cloud = cloud if good.all() else cloud.select(good)
    with reporter.stage("ground", 0.15, 0.3):
        if dtm_path is not None:
            dtm = read_dtm(dtm_path, cloud.crs, reporter)
            flat = cloud.xyz * (1.0, 1.0, 0.0)
            require_coverage(dtm, cloud.xyz[thin(flat, 1.0), :2], str(dtm_path))
            return given_ground(dtm, cloud.xyz, str(dtm_path), reporter)
        return found_ground(cloud.xyz, cloud.horizontal_crs, str(path), reporter)


def tree_summary(trees: list[Any], reporter: Reporter) -> dict[str, Any]:
    """Counts for the result, and a line for the technician."""
    from ..trees.reasons import REASONS

    flags = {flag: sum(tree.qc_flag == flag for tree in trees) for flag in ("ok", "check", "reject")}
    measured = [tree for tree in trees if tree.dbh_cm is not None]
    if not trees:
        reporter.warn(
            "No stem was found: the points below 5 m show no upright round stem; check the density under the "
            "canopy and the source setting."
        )
    else:
        reporter.info(
            f"{len(measured)} of the {len(trees)} stems found were measured: {flags['ok']} ok, "
            f"{flags['check']} to check, {flags['reject']} refused."
        )
    for reason in REASONS:
        count = sum(reason in tree.reasons for tree in trees)
        if count:
            reporter.info(f"  {count} x {reason}: {REASONS[reason][0]}.")
    mean = sum(tree.dbh_cm for tree in measured) / len(measured) if measured else None
    return {
        "n_trees": len(trees),
        "n_measured": len(measured),
        "n_ok": flags["ok"],
        "n_check": flags["check"],
        "n_reject": flags["reject"],
        "mean_dbh_cm": round(mean, 2) if mean is not None else None,
    }
