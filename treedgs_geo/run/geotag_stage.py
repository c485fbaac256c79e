"""The stage ``geotag``: where each photo was taken, and by which name the workspace knows it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.errors import InputError
from ..core.files import content_hashes
from ..core.progress import Reporter
from ..core.workspace import Workspace, in_use, read_record
from ..geotags.photos import list_photos
from ..geotags.reading import read_stations
from ..geotags.sources import find_geotags
from ..geotags.stations import Stations, read_stations_layer, write_stations
from ..planning.flown import read_expected
from ..reconstruction.cameras import View
from ..reconstruction.model import load_views
from .context import PhotoJob
from .published_plot import check_published
from .settings import PhotosToDbhSettings
from .stage import Cost, Findings, Key, Stage, check_target


def stations_of(asked: PhotosToDbhSettings, reporter: Reporter) -> Stations:
    """Where the photos were taken, as files and settings have it."""
    frame, control = asked.geotags_crs, asked.gcp
    return read_stations(asked.photos, asked.geotags, asked.crs, frame=frame, control=control, reporter=reporter)


def _check_outputs(job: PhotoJob) -> None:
    for target in (job.settings.output, job.path("run.json")):
        check_target(target)


def _check_workspace(job: PhotoJob) -> None:
    """Nobody works there; what an earlier run left in it."""
    if used := in_use(job.settings.workspace):
        raise InputError(used)
    stages = (read_record(job.settings.workspace) or {"stages": {}})["stages"]
    done = [name for name, entry in stages.items() if entry.get("status") == "done" and name != "write"]
    broken = [f"{name} ({entry.get('status')})" for name, entry in stages.items() if entry.get("status") != "done"]
    if done:
        job.reporter.info(f"Kept from an earlier run, if inputs and settings are the same: {', '.join(done)}.")
    if broken:
        job.reporter.info(f"Ended early in the earlier run and done again: {', '.join(broken)}.")


def _check_plan(job: PhotoJob) -> None:
    if job.settings.flight_plan:
        read_expected(job.settings.flight_plan)


def _find_photos(job: PhotoJob) -> None:
    job.photos = list_photos(job.settings.photos)
    job.reporter.info(f"Workspace: {job.settings.workspace}")


def _geotag_cost(job: PhotoJob, findings: Findings) -> Cost:
    """Says how the photos are placed."""
    asked, job.stations = job.settings, stations_of(job.settings, findings)
    counts, total = job.stations.counts(), len(job.stations)
    fix_pct = 100 * counts.get("fix", 0) / total
    each = ", ".join(f"{number} {quality}" for quality, number in counts.items())
    findings.info(f"{total} photos; positions: {each} ({fix_pct:.0f} % fixed).")
    findings.facts |= {"n_photos": total, "fix_pct": round(fix_pct, 1)}
    if fix_pct < 90 and job.stations.is_placed.any():
        given = find_geotags(asked.geotags, asked.photos) if asked.geotags else None
        advice = "give PPK files (--geotags), or positions by photo name with their accuracies (CSV)"
        if given and given.tables:
            advice = f"give their accuracies in {given.tables[0].name} (sd_e, sd_n, sd_u, metres) if they are better"
        elif given:
            advice = "process the PPK again with a nearer base station"
        findings.warn(
            f"{f'Only {fix_pct:.0f} %' if fix_pct >= 0.5 else 'None'} of the photos have a fixed (centimetre) "
            f"position: the trees' places and the scale rest on them; {advice}."
        )
    return Cost(seconds=5.0, memory_gb=0.8, disk_gb=0.2)


def photo_files(space: Workspace, folder: Path, photos: list[Path], reporter: Reporter) -> dict[str, Path]:
    """Name -> file of the photos in a folder: the relative path, or what the workspace calls a photo of that content.

    Only where the photos are the same ones, each once: then nothing has to be done again for their names.

    Args:
        photos: all files of the folder that are photos.

    Raises:
        InputError: a photo that cannot be read.
    """
    files = {path.relative_to(folder).as_posix(): path for path in photos}
    settings = (space.record["stages"].get("geotag") or {}).get("settings")
    kept = settings.get("photos") if isinstance(settings, dict) else None  # name -> SHA-256
    if not isinstance(kept, dict) or kept.keys() == files.keys() or len(kept) != len(files):
        return files
    called = {content: name for name, content in kept.items()}
    found = {called.get(content, ""): path for path, content in zip(photos, content_hashes(photos), strict=True)}
    if found.keys() != kept.keys():
        return files
    renamed = sum(folder / name != path for name, path in found.items())
    reporter.info(
        f"{renamed} of {len(photos)} photos have other names than when {space.folder} was made; they are the same "
        "pictures, and its layers call them as before."
    )
    return dict(sorted(found.items()))


def views_of(space: Workspace, folder: Path, reporter: Reporter) -> tuple[LocalFrame, list[View]]:
    """The reconstruction of a workspace, with its photos in ``folder``.

    Raises:
        InputError: no reconstruction, or photos of it that are not there.
    """
    return load_views(space.path(names.SFM), folder, photo_files(space, folder, list_photos(folder), reporter))


def _geotag_key(job: PhotoJob) -> Key:
    # By what the files are, not by where: photos that were moved or renamed are the same photos.
    asked = job.settings
    job.files = photo_files(job.space, asked.photos, job.photos, job.reporter)
    contents = dict(zip(job.files, content_hashes(job.files.values()), strict=True))
    used = {"photos": contents, "geotags": asked.geotags is not None, "crs": asked.crs, "frame": asked.geotags_crs}
    says_crs = [asked.gcp] if asked.gcp and asked.crs is None else []
    return Key(used, find_geotags(asked.geotags, asked.photos).all() if asked.geotags else says_crs)


def _geotag(job: PhotoJob, reporter: Reporter) -> dict[str, Any]:
    if job.read_ahead:
        stations, heard = job.read_ahead
        heard.release(reporter)
    else:
        stations = stations_of(job.settings, reporter)
    write_stations(job.path(names.GEOTAGS), stations)
    return {"photos": len(stations), "positions": stations.counts()}


def _load_stations(job: PhotoJob, _: object) -> None:
    # People may move a camera by hand: the layer is taken as it is.
    stations = read_stations_layer(job.path(names.GEOTAGS))
    paths = [job.files.get(name, job.settings.photos / name) for name in stations.names]
    job.stations = replace(stations, paths=paths)
    job.space.record["crs"] = stations.crs.to_string()


GEOTAG = Stage(
    "geotag",
    0.02,
    _geotag,
    checks=(_check_outputs, _check_workspace, lambda job: check_published(job.settings), _check_plan, _find_photos),
    cost=_geotag_cost,
    key=_geotag_key,
    outputs=lambda job: [job.path(names.GEOTAGS)],
    load=_load_stations,
    readable=lambda job: read_stations_layer(job.path(names.GEOTAGS)),
)
