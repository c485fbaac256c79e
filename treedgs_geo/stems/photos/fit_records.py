"""Fitted stems as plain records, so that a later stage or a later run knows them without fitting them again."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...core.errors import InputError
from ...core.files import read_json, write_json
from .fit.photo_fit import PhotoFit
from .images.axis_patches import StemAxis
from .quality_control import ErrorParts, Evidence, OtherExplanation
from .tile_calibration import Look


def fit_record(fit: PhotoFit) -> dict[str, Any]:
    """A fit as JSON: local frame, names of :class:`.fit.photo_fit.PhotoFit`; a number that is not finite is ``None``
    (NaN) or ``"inf"``."""
    plain = _plain(asdict(fit))
    return plain | {"seen": np.round(fit.seen, 4).tolist()}


def fit_of_record(record: dict[str, Any]) -> PhotoFit:
    """The fit that :func:`fit_record` wrote.

    Raises:
        KeyError, TypeError, ValueError: another record.
    """
    axis, evidence = (_numbers(record[name]) for name in ("axis", "evidence"))
    evidence["others"] = tuple(OtherExplanation(*other) for other in evidence["others"])
    evidence["error"] = None if record["evidence"]["error"] is None else ErrorParts(*evidence["error"])
    p, s, c = (np.array(axis[name], float) for name in ("p", "s", "c"))
    east, north = record["oval"]
    parts = {
        "axis": StemAxis(p, s, c, float(axis["ground_z"]), float(axis["bh_m"])),
        "evidence": Evidence(**evidence),
        "seen": np.array(record["seen"], float),
        "photos": tuple(record["photos"]),
        "oval": (float(east), float(north)),
    }
    numbers = {name: value for name, value in _numbers(record).items() if name in PhotoFit.__dataclass_fields__}
    return PhotoFit(**numbers | parts)  # earlier versions kept more


def look_record(look: Look) -> dict[str, Any]:
    """What a search learnt of a piece of ground, as JSON."""
    return _plain(asdict(look))


def look_of_record(record: dict[str, Any]) -> Look:
    """What :func:`look_record` wrote.

    Raises:
        KeyError, TypeError, ValueError: another record.
    """
    sun, places = np.array(record["sun"], float), np.array(record["places"], float).reshape(-1, 2)
    numbers = {name: value for name, value in _numbers(record).items() if name in Look.__dataclass_fields__}
    return Look(**numbers | {"sun": sun, "places": places})  # earlier versions kept more


def _plain(value: Any) -> Any:
    """The same in types of JSON."""
    if isinstance(value, dict):
        return {name: _plain(item) for name, item in value.items()}
    if isinstance(value, np.ndarray | tuple | list):
        return [_plain(item) for item in value]
    if isinstance(value, float | np.floating) and not np.isfinite(value):
        return None if np.isnan(value) else "inf"
    return value.item() if isinstance(value, np.generic) else value


def _numbers(record: dict[str, Any]) -> dict[str, Any]:
    """The same with numbers that are not finite put back."""
    special: dict[Any, float] = {None: np.nan, "inf": np.inf}
    return {name: special.get(item, item) if item is None or item == "inf" else item for name, item in record.items()}


@dataclass(frozen=True)
class KeptFits:
    """fits: in the order of the run's trees (``tree_id`` 1 is the first). looks: what the search learnt of each piece
    of ground, ``None`` where too few photos see it; empty where stems were not searched for in this way."""

    fits: list[PhotoFit]
    looks: list[Look | None] = field(default_factory=list)


def write_fits(path: Path, kept: KeptFits) -> None:
    """Keep the fits of a run."""
    looks = [None if look is None else look_record(look) for look in kept.looks]
    write_json(path, {"fits": [fit_record(fit) for fit in kept.fits], "looks": looks})


def read_fits(path: Path) -> KeptFits:
    """What :func:`write_fits` kept.

    Raises:
        InputError: missing, not readable, or of another version.
    """
    kept = read_json(path)
    try:
        looks = [None if look is None else look_of_record(look) for look in kept.get("looks", [])]
        return KeptFits([fit_of_record(record) for record in kept["fits"]], looks)
    except (KeyError, TypeError, ValueError, AttributeError) as problem:
        raise InputError(
            f"{path}: holds no fitted stems of this version ({problem}); delete it: they are then measured again."
        ) from None
