"""The photos of a workspace by the names that it knows them by, whatever they are called now."""

from __future__ import annotations

from pathlib import Path

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.files import content_hashes
from ..core.progress import Reporter
from ..core.workspace import Workspace
from ..geotags.photos import list_photos
from ..reconstruction.cameras import View
from ..reconstruction.model import load_views


def photo_files(space: Workspace, folder: Path, photos: list[Path], reporter: Reporter) -> dict[str, Path]:
    """Name -> file of the photos in a folder: the relative path, or what the workspace calls a photo of that content.

    Only where the photos are the same ones, each once: then nothing has to be done again for their names.

    Args:
        photos: all files of the folder that are photos.

    Raises:
        InputError: a photo that cannot be read.
    """
    files = {path.relative_to(folder).as_posix(): path for path in photos}
    kept = _recorded(space)
    if not kept or kept.keys() == files.keys() or len(kept) != len(files):
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


def _recorded(space: Workspace) -> dict[str, str]:
    """Name -> SHA-256 of the photos of the workspace's last run; empty where it says none."""
    settings = (space.record["stages"].get("geotag") or {}).get("settings")
    photos = settings.get("photos") if isinstance(settings, dict) else None
    return photos if isinstance(photos, dict) else {}
