"""Photos enlarged, to see what many megapixels cost (not how accurate they are: nothing is added to them)."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np


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
