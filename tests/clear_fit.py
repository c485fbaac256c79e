"""A stem that the photos show clearly: the evidence, to be changed one quantity at a time, and a fit."""

from dataclasses import fields, replace

import numpy as np

from treedgs_geo.stems.photos.fit.photo_fit import PhotoFit
from treedgs_geo.stems.photos.images.axis_patches import StemAxis
from treedgs_geo.stems.photos.quality_control import ErrorParts, Evidence
from treedgs_geo.stems.photos.tuned import ERROR_WEIGHTS


def error_of(se_cm: float) -> ErrorParts:
    """An error of one part."""
    return ErrorParts(soft=se_cm / ERROR_WEIGHTS["soft"])


CLEAR = {
    "dbh_cm": 30,
    "polish_cm": 30.5,
    "r1": -0.005,
    "lean_deg": 1.1,
    "llr": 120,
    "n_views": 12,
    "kish": 10,
    "error": error_of(0.5),
    "rms_px": 0.48,
}


def clear_photo_fit(x: float, dbh_cm: float, **changed) -> PhotoFit:
    """An upright stem at (x, 2) that eight of nine photos show. changed: other fields of the fit."""
    seen = {"llr": 90.0, "n_views": 8, "arc_deg": 250.0}
    evidence = Evidence(**CLEAR | seen | {"dbh_cm": dbh_cm, "polish_cm": dbh_cm})
    fit = PhotoFit(
        axis=StemAxis(np.array([x, 2.0]), np.zeros(2), np.zeros(2), 1.0, 1.37),
        r0=dbh_cm / 200,
        r1=-0.0045,
        evidence=evidence,
        seed_score=100.0,
        seen=np.ones(9),
    )
    return with_changes(fit, **changed)


#: Reason -> evidence for which a clear fit is flagged.
FLAGGED = {"few_views": {"arc_deg": 50.0}, "merged": {"twins": 20.0}, "occluded": {"rms_px": 0.6}}


def with_changes(fit: PhotoFit, flag: str = "", reasons: tuple[str, ...] = ("occluded",), **changed) -> PhotoFit:
    """The fit with other values of fields: its own, else of the evidence. flag: with evidence that makes it so,
    ``check`` for these reasons, ``reject`` for the first of them."""
    if flag == "ok":
        sure = {"sure": 1.0, "oval": 0.0, "refused": ""}
        changed = CLEAR | sure | {"dbh_cm": fit.dbh_cm} | changed
    elif flag == "check":
        for reason in reasons:
            changed |= FLAGGED[reason]
    elif flag == "reject":
        changed["refused"] = reasons[0]
    own = {item.name for item in fields(fit)}
    there = {name: value for name, value in changed.items() if name not in own}
    return replace(fit, **{name: value for name, value in changed.items() if name in own}).knowing(**there)
