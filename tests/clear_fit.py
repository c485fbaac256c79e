"""A stem that the photos show clearly: the evidence, to be changed one quantity at a time, and a fit."""

from dataclasses import fields, replace

import numpy as np

from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.quality_control import Evidence
from treedgs_geo.stems.quality.assessment import Assessment

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
    evidence = Evidence(**CLEAR | {"dbh_cm": dbh_cm, "polish_cm": dbh_cm, "llr": 90.0, "gap": 20.0, "n_views": 8})
    fit = PhotoFit(
        axis=StemAxis(np.array([x, 2.0]), np.zeros(2), np.zeros(2), 1.0, 1.37),
        r0=dbh_cm / 200,
        r1=-0.0045,
        evidence=evidence,
        assessment=Assessment(dbh_cm, 0.5),
        seed_score=100.0,
        arc_deg=250.0,
        seen=np.ones(9),
    )
    return with_changes(fit, **changed)


def with_changes(fit: PhotoFit, **changed) -> PhotoFit:
    """The fit with other values of fields: its own, else of what is stated of it, else of the evidence."""
    for part in ("assessment", "evidence"):
        own = {item.name for item in fields(getattr(fit, part))} - {"r1"}
        if part == "evidence":
            own -= {"dbh_cm", "se_cm", "lean_deg", "oval"}
        here = {name: changed.pop(name) for name in list(changed) if name in own}
        fit = replace(fit, **{part: replace(getattr(fit, part), **here)})
    return replace(fit, **changed)
