"""How well the photos show a stem at breast height, read from the photos, and what that does to the error.

As in the paper: the band about breast height is projected into every photo and the crop is called unoccluded or
occluded. Bark and leaves differ in colour: a band that is free shows bark-like pixels from edge to edge and along its
height, and looks alike in the photos of one flight.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
import pandas as pd

from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.reconstruction.images import load_image

from ..simulate.truth import BAND_M

#: Samples across and along the band of the stem.
ACROSS, ALONG = 9, 12
#: Steeper views show no stem (sine of the angle between ray and stem).
MIN_SINE = 0.35
#: Share of the band that has to look like this stem's bark.
FREE_SHARE = 0.7
#: How far a pixel may lie from the stem's own median colour (Lab units) and still be its bark.
BARK_SPREAD = 13.0


class SeenStem(NamedTuple):
    """Where a stem is looked for in photos, local metres."""

    #: Its foot.
    east: float
    north: float
    #: Height of the ground there.
    ground: float
    #: Its width.
    dbh_m: float


def classify(views: list[View], stems: list[SeenStem]) -> pd.DataFrame:
    """One row a stem and photo that frames its band: ``stem, image, share, width_px, free``.

    share: of the band's samples whose colour lies near the stem's own bark colour, which is the median over the least
    green samples of all photos of the flight (brightness may differ from photo to photo: sun and shade side).
    """
    samples: list[tuple] = []
    for view in views:
        image = None
        for number, stem in enumerate(stems):
            pixels, width = band_pixels(view, stem)
            if pixels is None:
                continue
            if image is None:
                image = cv2.cvtColor(load_image(view), cv2.COLOR_RGB2LAB).astype(np.float32)
            u, v = pixels.astype(np.float32).T - np.float32(0.5)
            samples.append(
                (number, view.flight, view.name, width, cv2.remap(image, u[None], v[None], cv2.INTER_LINEAR)[0])
            )
    rows = []
    for _, own in pd.DataFrame(samples, columns=["stem", "flight", "image", "width", "colour"]).groupby(
        ["stem", "flight"]
    ):
        colours = np.stack(own["colour"])
        red = colours[..., 1]  # a of Lab: green is low
        bark = np.median(colours[red >= np.median(red)], axis=0)
        off = colours - bark
        like = np.hypot(off[..., 1], off[..., 2]) * 2.2 + 0.12 * np.abs(off[..., 0]) < BARK_SPREAD
        for row, share in zip(own.itertuples(), like.mean(axis=1), strict=True):
            rows.append((row.stem, row.image, round(float(share), 3), round(row.width, 2), share >= FREE_SHARE))
    return pd.DataFrame(rows, columns=["stem", "image", "share", "width_px", "free"])


def band_pixels(view: View, stem: SeenStem) -> tuple[np.ndarray | None, float]:
    """(ACROSS * ALONG, 2) pixels within the stem's outline, and its width in pixels."""
    height = np.linspace(*BAND_M, ALONG)
    middle = np.column_stack([0 * height + stem.east, 0 * height + stem.north, stem.ground + height])
    ray = middle[ALONG // 2] - view.centre
    distance = float(np.linalg.norm(ray))
    if np.hypot(ray[0], ray[1]) / distance < MIN_SINE:
        return None, 0.0
    side = np.array([-ray[1], ray[0], 0.0]) / np.hypot(ray[0], ray[1])
    # Within the outline: blurred edges show what is behind.
    offset = np.linspace(-0.36, 0.36, ACROSS) * stem.dbh_m
    points = (middle[:, None] + offset[None, :, None] * side).reshape(-1, 3)
    pixels, depth = view.project(points)
    if not np.isfinite(pixels).all() or not view.contains(pixels, 2.0).all():
        return None, 0.0
    return pixels, view.camera.fx * stem.dbh_m / float(np.median(depth))


def per_stem(table: pd.DataFrame, count: int) -> pd.DataFrame:
    """A row a stem: ``free_views``, mean ``width_px`` over them, and their product ``score``."""
    free = table[table["free"].astype(bool)].groupby("stem")["width_px"]
    views, width = free.size().reindex(range(count), fill_value=0), free.mean().reindex(range(count))
    return pd.DataFrame({"free_views": views, "width_px": width, "score": views * width.fillna(0)})


def agreement(table: pd.DataFrame, names: list[str], truth: pd.DataFrame) -> dict:
    """The photos' verdict against ``truth/visibility.csv``: precision and recall of ``free``, and the correlation of
    the stems' counts."""
    both = table.assign(tree_id=[names[k] for k in table["stem"]]).merge(truth, on=["tree_id", "image"])
    clear = (both["visible_fraction"] >= FREE_SHARE) & (both["in_frame"] == 1) & (both["foreshortening"] > MIN_SINE)
    free, hit = both["free"].astype(bool), int((both["free"].astype(bool) & clear).sum())
    counted = both.assign(clear=clear).groupby("tree_id")[["free", "clear"]].sum()
    varied = len(counted) > 2 and (counted.nunique() > 1).all()
    return {
        "views": len(both),
        "clear": int(clear.sum()),
        "called_free": int(free.sum()),
        "precision": round(hit / max(int(free.sum()), 1), 3),
        "recall": round(hit / max(int(clear.sum()), 1), 3),
        "stem_count_r": round(float(np.corrcoef(*counted.T.astype(float).to_numpy())[0, 1]), 3) if varied else None,
    }
