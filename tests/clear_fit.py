"""A stem that the photos show clearly: what the verdict is given, to be changed one quantity at a time, and a fit."""

import numpy as np

from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.images.axis_patches import StemAxis

CLEAR = {
    "dbh_cm": 30,
    "polish_cm": 30.5,
    "r1": -0.005,
    "lean_deg": 1.1,
    "llr": 120,
    "gap": 60,
    "n_views": 12,
    "kish": 10,
    "se_cm": 0.5,
    "rms_px": 0.48,
}


def clear_photo_fit(x: float, dbh_cm: float, **changed) -> PhotoFit:
    """An upright stem at (x, 2) that eight of nine photos show. changed: other fields of the fit."""
    fields = {
        "axis": StemAxis(np.array([x, 2.0]), np.zeros(2), np.zeros(2), 1.0, 1.37),
        "r0": dbh_cm / 200,
        "r1": -0.0045,
        "dbh_cm": dbh_cm,
        "se_cm": 0.5,
        "flag": "ok",
        "reasons": (),
        "seed_score": 100.0,
        "llr": 90.0,
        "gap": 20.0,
        "n_views": 8,
        "kish": 7.0,
        "arc_deg": 250.0,
        "rms_px": 0.5,
        "polish_cm": dbh_cm,
        "seen": np.ones(9),
    }
    return PhotoFit(**(fields | changed))
