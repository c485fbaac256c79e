"""Fitted stems as plain records, so that a later stage or a later run knows them without fitting them again."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.files import read_json, write_json
from .fit import PhotoFit
from .strips import StemAxis

#: Decimals of the probability that a photo sees a stem.
_SEEN_DECIMALS = 4


def fit_record(fit: PhotoFit) -> dict[str, Any]:
    """A fit as JSON: local frame, names of :class:`.fit.PhotoFit`; NaN is ``None``."""
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
    plain["reasons"], plain["photos"] = list(fit.reasons), list(fit.photos)
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
    return PhotoFit(**plain)


def write_fits(path: Path, fits: list[PhotoFit], second_cm: dict[int, float] | None = None) -> None:
    """Keep the fits of a run, in the order of its trees (``tree_id`` 1 is the first). second_cm: diameters that a
    second measurement read, by index of the fit."""
    second = {str(number): round(value, 3) for number, value in (second_cm or {}).items()}
    write_json(path, {"fits": [fit_record(fit) for fit in fits], "second_cm": second})


def read_fits(path: Path) -> tuple[list[PhotoFit], dict[int, float]]:
    """What :func:`write_fits` kept.

    Raises:
        InputError: missing, not readable, or of another version.
    """
    kept = read_json(path)
    try:
        second = {int(number): float(value) for number, value in kept["second_cm"].items()}
        return [fit_of_record(record) for record in kept["fits"]], second
    except (KeyError, TypeError, ValueError, AttributeError) as problem:
        raise InputError(
            f"{path}: holds no fitted stems of this version ({problem}); delete it: they are then measured again."
        ) from None
