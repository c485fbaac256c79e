"""Photos at other sizes: enlarged, to see what many megapixels cost (not how accurate they are: nothing is added to
them), and reduced."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.images import load_image


def enlarge(source: Path, target: Path, width: int) -> float:
    """Write one photo enlarged to ``width`` pixels across, without its metadata; returns its megapixels."""
    image = np.asarray(cv2.imread(str(source), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION))
    size = width, round(image.shape[0] * width / image.shape[1])
    large = cv2.resize(image, size, interpolation=cv2.INTER_CUBIC)
    # Sensor noise of the large photo: without it JPEG files would be unusually small and quick to read.
    grain = np.random.default_rng(0).integers(-4, 5, (*large.shape[:2], 1), np.int8)
    large = np.clip(large.astype(np.int16) + grain, 0, 255).astype(np.uint8)
    cv2.imwrite(str(target), large, [cv2.IMWRITE_JPEG_QUALITY, 88])
    return size[0] * size[1] / 1e6


def scaled(views: list[View], scale: float, folder: Path) -> list[View]:
    """The photos at a multiple of their size, with cameras that fit (not timed: a drone would store them so); as they
    are where it is 1."""
    if scale == 1:
        return views
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    for view in views:
        image = load_image(view)[..., ::-1]
        height, width = round(image.shape[0] * scale), round(image.shape[1] * scale)
        path = folder / view.path.name
        small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
        cv2.imwrite(str(path), small, [cv2.IMWRITE_JPEG_QUALITY, 95])
        sx, sy = width / image.shape[1], height / image.shape[0]
        c = view.camera
        camera = replace(c, width=width, height=height, fx=c.fx * sx, fy=c.fy * sy, cx=c.cx * sx, cy=c.cy * sy)
        made.append(replace(view, path=path, camera=camera))
    return made
