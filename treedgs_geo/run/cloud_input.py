"""What the point-cloud verbs share: the cloud, its CRS and the ground under it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.errors import CRSError, InputError
from ..core.machine import require_memory
from ..core.progress import Reporter
from .settings import CloudSettings

if TYPE_CHECKING:
    from ..pointcloud.cloud import PointCloud
    from ..pointcloud.survey import Extent
    from ..terrain.cloud_ground import CloudGround

#: Memory of a point while a cloud is read: coordinates twice, a few attributes; and where it is thinned.
_POINT_BYTES, _THINNED_BYTES = 60, 40
#: A larger share of points classed as noise or withheld is a warning: a filter may have taken bark with it.
MUCH_NOISE = 0.05
#: So is a larger share of points below the ground: the edges of ditches are less.
MUCH_LOW_NOISE = 0.001


def read_checked(
    path: Path,
    crs: str | None,
    reporter: Reporter,
    attributes: tuple[str, ...] | None = None,
    find_stems: bool = True,
    dtm: Path | None = None,
) -> tuple[PointCloud, Extent]:
    """The cloud in a file as :func:`checked` gives it; a large one of which only some attributes are asked for without
    the points that measuring stems does not need (:mod:`treedgs_geo.terrain.thinned`). Says what it is.

    Raises:
        InputError, CRSError: see :func:`treedgs_geo.pointcloud.files.read_cloud`,
            :func:`treedgs_geo.pointcloud.sanity.examine` and :func:`treedgs_geo.pointcloud.file_crs.placed`.
    """
    from ..pointcloud.cloud import extent
    from ..pointcloud.files import describe_cloud, read_cloud
    from ..terrain.thinned import WHOLE_CLOUD_POINTS, read_thinned

    if attributes is not None:
        attributes = (*attributes, "classification", "withheld")
    about = describe_cloud(path)
    thinned = attributes if about.scale is not None and about.n_points > WHOLE_CLOUD_POINTS else None
    require_memory(
        (_POINT_BYTES if thinned is None else _THINNED_BYTES) * about.n_points,
        f"{path}: reading {about.n_points:,} points at once",
        "cut the cloud to the plots, thin it, or use a machine with more memory",
    )
    if thinned is not None:
        cloud = read_thinned(path, crs, thinned, need_crs=False)
        reporter.info(
            f"{len(cloud):,} of {about.n_points:,} points are used: the stem band, of dense ground and crowns a part."
        )
    else:
        cloud = read_cloud(path, crs=crs, attributes=attributes, need_crs=False)
    cloud, held = checked(cloud, path, reporter, find_stems, about.scale, dtm, crs, need_crs=True)
    if attributes is not None:  # they have told which points are usable
        kept = {name: values for name, values in cloud.attributes.items() if name not in ("classification", "withheld")}
        cloud = replace(cloud, attributes=kept)
    where = cloud.horizontal_crs.name if cloud.horizontal_crs is not None else "local metres, no CRS"
    low, high = extent(cloud.xyz)
    span = high - low
    reporter.info(f"{len(cloud):,} points, {span[0]:.0f} x {span[1]:.0f} m, {where}.")
    return cloud, held


def checked(
    cloud: PointCloud,
    path: Path,
    reporter: Reporter,
    find_stems: bool = True,
    scale: np.ndarray | None = None,
    dtm: Path | None = None,
    crs: str | None = None,
    need_crs: bool = False,
) -> tuple[PointCloud, Extent]:
    """The cloud's usable points (:func:`treedgs_geo.pointcloud.cloud.usable`) without far strays, what every verb
    works on, and the extent beyond which points are such strays. What is odd about the cloud is said.

    path: what messages call it. find_stems: stems are to be found in it, not only measured. scale: (3,) of the
    coordinates as they were stored, where known. dtm: the user's terrain model. crs: the user's word for the CRS, if
    any. need_crs: see :func:`treedgs_geo.pointcloud.file_crs.placed`.

    Raises:
        InputError, CRSError: as :func:`read_checked`; no usable point.
    """
    from ..pointcloud.cloud import usable
    from ..pointcloud.file_crs import LOCAL, agreed_crs, file_crs, placed
    from ..pointcloud.sanity import examine, report

    good = usable(cloud)
    if not good.any():
        raise InputError(
            f"{path}: holds no usable point, all are classed as noise (7, 18) or withheld, expected a point cloud; "
            "check its classes."
        )
    if not good.all():
        share = 1.0 - float(good.mean())
        text = f"{path}: {np.count_nonzero(~good):,} points ({share:.1%}) are classed as noise or withheld: left out."
        (reporter.warn if share > MUCH_NOISE else reporter.info)(text)
    xyz = cloud.xyz if good.all() else cloud.xyz[good]
    if dtm is None:  # else the ground is not the cloud's
        good, xyz = _without_low_noise(good, xyz, path, reporter)
    extent, findings = examine(xyz, path, find_stems, scale, dtm is not None)
    if (cloud.attributes.get("tree_id", np.zeros(1)) > 0).all():  # stems alone: no ground that could lie across
        findings = [finding for finding in findings if finding.kind != "axis"]
    report(findings, reporter)
    if crs is not None and crs.lower() == LOCAL and cloud.layout is not None:
        try:
            agreed_crs(file_crs(cloud.layout, path), None, path, False)
        except CRSError as said:
            reporter.warn(f"{said} Its coordinates are taken as local metres (--crs {LOCAL}).")
    kept = extent.holds(cloud.xyz) & good
    cloud = cloud if kept.all() else cloud.select(kept)
    return replace(cloud, crs=placed(cloud.crs, cloud.xyz, path, reporter, crs, dtm, need_crs)), extent


def _without_low_noise(
    good: np.ndarray, xyz: np.ndarray, path: Path, reporter: Reporter
) -> tuple[np.ndarray, np.ndarray]:
    """``((M,) bool, (K, 3))``: the good ones of M points without those far below the ground, which is said."""
    from ..pointcloud.survey import survey
    from ..terrain.low_noise import low_noise

    held = survey(xyz).holds(xyz)
    noise = np.zeros(len(xyz), bool)
    noise[held], deep = low_noise(xyz if held.all() else xyz[held])
    if not noise.any():
        return good, xyz
    text = (
        f"{path}: {np.count_nonzero(noise):,} points ({noise.mean():.2%}) lie up to {deep:.1f} m below the ground, "
        "which is denser and goes on above them: left out as noise; if they are ground (a pit, a cliff), give its "
        "terrain model with --dtm."
    )
    (reporter.warn if noise.mean() > MUCH_LOW_NOISE else reporter.info)(text)
    left = good.copy()
    left[good] = ~noise
    return left, xyz[~noise]


def load_ground(settings: CloudSettings, cloud: PointCloud, reporter: Reporter) -> CloudGround:
    """The ground under a cloud's usable points: the user's DTM held against the cloud, zero where z is height above
    ground, the ground in the cloud, or its lowest points.

    Raises:
        InputError: the DTM does not cover the cloud or has other heights; no ground was found; ``dtm`` and ``z_is``
            contradict each other.
    """
    from ..pointcloud.cloud import thin
    from ..terrain.cloud_ground import found_ground, given_ground
    from ..terrain.dtm import read_dtm, require_coverage

    if settings.dtm is not None and settings.z_is == "height":
        raise InputError(
            "--z-is height: z is counted from the ground already, expected no --dtm; leave one of them out."
        )
    if settings.dtm is not None:
        dtm = read_dtm(settings.dtm, cloud.crs, reporter)
        flat = cloud.xyz * (1.0, 1.0, 0.0)
        require_coverage(dtm, cloud.xyz[thin(flat, 1.0), :2], str(settings.dtm))
        return given_ground(dtm, cloud.xyz, str(settings.dtm), reporter)
    return found_ground(cloud.xyz, cloud.horizontal_crs, str(settings.input), reporter, settings.z_is)


def tree_summary(trees: list[Any], reporter: Reporter) -> dict[str, Any]:
    """Counts for the result, and a line for the technician."""
    from ..stems.quality.reasons import REASONS
    from ..stems.quality.tops import heights_sentence

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
    if heights := heights_sentence(trees):
        reporter.info(f"{heights}.")
    mean = sum(tree.dbh_cm for tree in measured) / len(measured) if measured else None
    return {
        "n_trees": len(trees),
        "n_measured": len(measured),
        **{f"n_{flag}": count for flag, count in flags.items()},
        "mean_dbh_cm": round(mean, 2) if mean is not None else None,
    }
