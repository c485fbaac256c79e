"""Fitted stems as plain records, so that a later stage or a later run knows them without fitting them again."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.files import read_json, write_json
from .fit.photo_fit import PhotoFit
from .images.axis_patches import StemAxis
from .tile_calibration import Look

#: Decimals of the probability that a photo sees a stem.
_SEEN_DECIMALS = 4


def fit_record(fit: PhotoFit) -> dict[str, Any]:
    """A fit as JSON: local frame, names of :class:`.fit.photo_fit.PhotoFit`; NaN is ``None``."""
    plain: dict[str, Any] = {}
    for item in fields(fit):
        value = getattr(fit, item.name)
        if isinstance(value, float) and not np.isfinite(value):
            value = None
        plain[item.name] = value
    axis = fit.axis
    plain["axis"] = {
        "p": axis.p.tolist(),
        "s": axis.s.tolist(),
        "c": axis.c.tolist(),
        "ground_z": float(axis.ground_z),
        "bh_m": float(axis.bh_m),
    }
    plain["seen"] = np.round(fit.seen, _SEEN_DECIMALS).tolist()
    plain |= {name: list(getattr(fit, name)) for name in ("reasons", "photos", "oval")}
    return plain


def fit_of_record(record: dict[str, Any]) -> PhotoFit:
    """The fit that :func:`fit_record` wrote.

    Raises:
        KeyError, TypeError, ValueError: another record.
    """
    axis = record["axis"]
    plain: dict[str, Any] = {name: np.nan if value is None else value for name, value in record.items()}
    p, s, c = (np.array(axis[name], float) for name in ("p", "s", "c"))
    plain["axis"] = StemAxis(p, s, c, float(axis["ground_z"]), float(axis["bh_m"]))
    plain["seen"] = np.array(record["seen"], float)
    plain["reasons"], plain["photos"] = tuple(record["reasons"]), tuple(record["photos"])
    east, other = record.get("oval", (0.0, 0.0))
    plain["oval"] = float(east), float(other)
    return PhotoFit(**plain)


@dataclass(frozen=True)
class KeptFits:
    """fits: in the order of the run's trees (``tree_id`` 1 is the first). second_cm: diameters that a second
    measurement read, by index of the fit. looks: what the search learnt of each piece of ground, ``None`` where too few
    photos see it; empty where stems were not searched for in this way."""

    fits: list[PhotoFit]
    second_cm: dict[int, float] = field(default_factory=dict)
    looks: list[Look | None] = field(default_factory=list)


def write_fits(path: Path, kept: KeptFits) -> None:
    """Keep the fits of a run."""
    second = {str(number): round(value, 3) for number, value in kept.second_cm.items()}
    looks = [None if look is None else look.record() for look in kept.looks]
    write_json(path, {"fits": [fit_record(fit) for fit in kept.fits], "second_cm": second, "looks": looks})


def read_fits(path: Path) -> KeptFits:
    """What :func:`write_fits` kept.

    Raises:
        InputError: missing, not readable, or of another version.
    """
    kept = read_json(path)
    try:
        second = {int(number): float(value) for number, value in kept["second_cm"].items()}
        looks = [None if look is None else Look.of_record(look) for look in kept.get("looks", [])]
        return KeptFits([fit_of_record(record) for record in kept["fits"]], second, looks)
    except (KeyError, TypeError, ValueError, AttributeError) as problem:
        raise InputError(
            f"{path}: holds no fitted stems of this version ({problem}); delete it: they are then measured again."
        ) from None
