"""How well the photos show a stem at breast height, read from the photos, and what that does to the error.

As in the paper: the band about breast height is projected into every photo and the crop is called unoccluded or
occluded. Bark and leaves differ in colour: a band that is free shows bark-like pixels from edge to edge and along its
height, and looks alike in the photos of one flight.
"""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True)
class Stem:
    """A stem's foot x, y, ground height z and axis lean (dx, dy a metre), all local; dbh_m: its width."""

    x: float
    y: float
    z: float
    dbh_m: float
    dx: float = 0.0
    dy: float = 0.0


def classify(views: list[View], stems: list[Stem]) -> pd.DataFrame:
    """One row a stem and photo that frames its band: ``stem, image, share, width_px, free``.

    share: of the band's samples whose colour lies near the stem's own bark colour, which is the median over the least
    green samples of all photos of the flight (brightness may differ from photo to photo: sun and shade side).
    """
    samples: list[dict] = []
    for view in views:
        image = None
        for number, stem in enumerate(stems):
            pixels, width = band_pixels(view, stem)
            if pixels is None:
                continue
            if image is None:
                image = cv2.cvtColor(load_image(view), cv2.COLOR_RGB2LAB).astype(np.float32)
            colour = cv2.remap(
                image,
                pixels[:, 0].astype(np.float32)[None] - 0.5,
                pixels[:, 1].astype(np.float32)[None] - 0.5,
                cv2.INTER_LINEAR,
            )[0]
            samples.append(
                {"stem": number, "image": view.name, "flight": view.flight, "width_px": width, "colour": colour}
            )
    rows = []
    for number in range(len(stems)):
        for flight in sorted({s["flight"] for s in samples if s["stem"] == number}):
            own = [s for s in samples if s["stem"] == number and s["flight"] == flight]
            bark = _bark(np.concatenate([s["colour"] for s in own]))
            for s in own:
                share = float(
                    (
                        np.hypot(*(s["colour"][:, 1:] - bark[1:]).T) * 2.2 + 0.12 * np.abs(s["colour"][:, 0] - bark[0])
                        < BARK_SPREAD
                    ).mean()
                )
                rows.append(
                    {
                        "stem": number,
                        "image": s["image"],
                        "share": round(share, 3),
                        "width_px": round(s["width_px"], 2),
                        "free": share >= FREE_SHARE,
                    }
                )
    return pd.DataFrame(rows, columns=["stem", "image", "share", "width_px", "free"])


def _bark(colours: np.ndarray) -> np.ndarray:
    """(3,) Lab: the median of the least green half (a: green is low)."""
    redness = colours[:, 1]
    return np.median(colours[redness >= np.median(redness)], axis=0)


def band_pixels(view: View, stem: Stem) -> tuple[np.ndarray | None, float]:
    """(ACROSS * ALONG, 2) pixels within the stem's outline, and its width in pixels."""
    height = np.linspace(*BAND_M, ALONG)
    middle = np.column_stack([stem.x + stem.dx * height, stem.y + stem.dy * height, stem.z + height])
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
    free = table[table["free"].astype(bool)]
    views = free.groupby("stem").size().reindex(range(count), fill_value=0)
    width = free.groupby("stem")["width_px"].mean().reindex(range(count))
    return pd.DataFrame({"free_views": views, "width_px": width, "score": views * width.fillna(0)})


def agreement(table: pd.DataFrame, names: list[str], truth: pd.DataFrame) -> dict:
    """The photos' verdict against ``truth/visibility.csv``: precision and recall of ``free``, and the correlation of
    the stems' counts."""
    both = table.assign(tree_id=[names[k] for k in table["stem"]]).merge(truth, on=["tree_id", "image"])
    clear = (both["visible_fraction"] >= 0.7) & (both["in_frame"] == 1) & (both["foreshortening"] > 0.35)
    hit = int((both["free"] & clear).sum())
    counted = both.assign(clear=clear).groupby("tree_id")[["free", "clear"]].sum()
    varied = len(counted) > 2 and counted["free"].nunique() > 1 and counted["clear"].nunique() > 1
    return {
        "views": len(both),
        "clear": int(clear.sum()),
        "called_free": int(both["free"].sum()),
        "precision": round(hit / max(int(both["free"].sum()), 1), 3),
        "recall": round(hit / max(int(clear.sum()), 1), 3),
        "stem_count_r": round(float(np.corrcoef(counted["free"], counted["clear"])[0, 1]), 3) if varied else None,
    }
