"""Photos that can only do harm: a covered lens, a black or white frame, motion or focus blur."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from PIL import Image

#: A frame whose grey values spread less than this (standard deviation, of 255) shows nothing.
BLANK_SPREAD = 4.0
BLANK = "shows nothing (lens cap?)"
#: Sharpness below this fraction of the set's median means blur; tuned on drone_agung_badframes and plot_a.
BLUR_FRACTION = 0.25
#: ... and below this it is blur whatever the rest looks like.
BLUR_FLOOR = 0.09
#: Photos that are decoded at once: a large one takes 80 MB.
MAX_READERS = 4


def measure_detail(path: Path) -> tuple[float, float] | None:
    """Spread of grey values (0..255) and sharpness of one photo; ``None`` of what is no picture.

    Sharpness: energy of one-pixel differences over that of four-pixel differences, at full resolution, in the
    sharpest of nine windows of 384 px; it does not depend on contrast, and little on the scene.
    """
    try:
        with Image.open(path) as image:
            # DCT scaling by 2 halves decoding time on large photos and still shows blur of 2 px and more.
            if image.width > 3000:
                image.draft("L", (image.width // 2, image.height // 2))
            grey = np.asarray(image.convert("L"), np.float32)
    except (OSError, SyntaxError, ValueError):
        return None
    size = min(384, grey.shape[0], grey.shape[1])
    ratios = []
    for top in np.linspace(0, grey.shape[0] - size, 3).astype(int):
        for left in np.linspace(0, grey.shape[1] - size, 3).astype(int):
            window = grey[top : top + size, left : left + size]
            fine = np.var(window[:, 1:] - window[:, :-1]) + np.var(window[1:] - window[:-1])
            coarse = np.var(window[:, 4:] - window[:, :-4]) + np.var(window[4:] - window[:-4])
            if coarse > 4.0:
                ratios.append(fine / coarse)
    return float(grey.std()), float(max(ratios, default=0.0))


def find_defects(paths: list[Path]) -> dict[Path, str]:
    """Photos to leave out, with the reason."""
    with ThreadPoolExecutor(min(MAX_READERS, os.cpu_count() or 1)) as readers:
        measured = dict(zip(paths, readers.map(measure_detail, paths), strict=True))
    found = {path: "cannot be decoded" for path, seen in measured.items() if seen is None}
    detail = {path: seen for path, seen in measured.items() if seen is not None}
    for path, (spread, _) in detail.items():
        if spread < BLANK_SPREAD:
            with Image.open(path) as image:
                deep = image.tile and any("16" in str(part) for part in image.tile[0][3:] if part is not None)
            found[path] = "holds 16 bits of which the upper 8 show nothing" if deep else BLANK
    sharp = [value for path, (_, value) in detail.items() if path not in found]
    usual = float(np.median(sharp)) if sharp else 0.0
    for path, (_, value) in detail.items():
        if path not in found and value < max(BLUR_FRACTION * usual, BLUR_FLOOR):
            found[path] = "is blurred"
    return found
