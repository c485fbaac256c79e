"""Photos that are there twice: a backup in a sub-folder, the same exposure exported again."""

from __future__ import annotations

import filecmp
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

if TYPE_CHECKING:
    from .photos import Photo

#: Two pictures with the same name and time are one exposure when their thumbnails differ by less than this (median, of
#: 255, after equal brightness and contrast); rigs of several cameras expose at one time too, and look elsewhere.
_SAME_GREY = 6.0


def find_copies(photos: list[Photo]) -> dict[str, str]:
    """Name of each photo that is a copy -> name of the one that is used (the one least deep in the folders)."""
    order = sorted(photos, key=lambda photo: (photo.name.count("/"), len(photo.name), photo.name))
    by_content: dict[tuple, list[Photo]] = {}
    by_exposure: dict[tuple, list[Photo]] = {}
    copies: dict[str, str] = {}
    for photo in order:
        content = _glance(photo.path)
        exposure = (photo.path.stem.lower(), photo.local_time, photo.model)
        twin = next((other for other in by_content.get(content, []) if _same_bytes(photo.path, other.path)), None)
        if twin is None and np.isfinite(photo.local_time):
            twin = next((other for other in by_exposure.get(exposure, []) if _same_picture(photo, other)), None)
        if twin is not None:
            copies[photo.name] = twin.name
            continue
        by_content.setdefault(content, []).append(photo)
        by_exposure.setdefault(exposure, []).append(photo)
    return copies


def _glance(path: Path) -> tuple:
    """Size, first and middle bytes: quick to read, and rarely the same for two exposures."""
    with open(path, "rb") as stream:
        size = stream.seek(0, 2)
        stream.seek(0)
        first = stream.read(4096)
        stream.seek(size // 2)
        return size, hash(first), hash(stream.read(4096))


def _same_bytes(one: Path, other: Path) -> bool:
    try:
        return filecmp.cmp(one, other, shallow=False)
    except OSError:
        return False


def _same_picture(one: Photo, other: Photo) -> bool:
    try:
        first, second = _thumbnail(one.path), _thumbnail(other.path)
    except (OSError, SyntaxError, ValueError):
        return False
    return bool(np.median(np.abs(first - second)) < _SAME_GREY)


def _thumbnail(path: Path) -> np.ndarray:
    """(48, 48) grey, mean 128, standard deviation 50."""
    with Image.open(path) as image:
        image.draft("L", (192, 192))
        grey = np.asarray(image.convert("L").resize((48, 48), Image.Resampling.BOX), np.float32)
    return 128 + 50 * (grey - grey.mean()) / max(float(grey.std()), 1.0)
