"""Settings of reading field tallies and of pairing, apart from what they need to run."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.settings import param


@dataclass(frozen=True, kw_only=True)
class Bearings:
    """What bearings refer to."""

    north: str = param(
        "true",
        choices=("true", "grid", "magnetic"),
        help="north that the bearings refer to (magnetic needs the date of the field work, or the declination)",
    )
    declination_deg: float | None = param(
        None,
        unit="degrees, east positive",
        minimum=-180,
        maximum=180,
        help="magnetic declination at the plot on the day of the field work; default: from the World Magnetic Model by "
        "--field-date, or the date column of a field table",
    )
    field_date: str | None = param(None, help="day of the field work, year-month-day, for the declination")


@dataclass(frozen=True, kw_only=True)
class FieldProtocol(Bearings):
    """How the field crew measured."""

    distance: str = param(
        "horizontal",
        choices=("horizontal", "slope"),
        help="distance along the level or along the ground (then the table needs slope_deg or slope_pct)",
    )
    to: str = param(
        "pith",
        choices=("pith", "face"),
        help="distance to the middle of the stem, or to its near face (half the DBH is added)",
    )
    dbh_unit: str = param(
        "auto", choices=("auto", "cm", "mm", "m", "in"), help="unit of the DBH column (auto: from a name like dbh_cm)"
    )
    distance_unit: str = param(
        "auto",
        choices=("auto", "m", "ft"),
        help="unit of a distance column that does not say it (auto: from a name like distance_m)",
    )


@dataclass(frozen=True, kw_only=True)
class PairingOptions:
    """Limits of the search, tuned on simulated plots (seeds 1000 to 3999).

    Of the library only: gate_m: trees further apart than this after co-registration are never a pair. min_ratio: the
    best placing must score this many times the next best, and min_share: this share of the trees must find a partner
    within 1 m, else the plot is left to a person. min_margin: a pair must be exp(min_margin) times as likely as the
    best pairing without it, else it is only suggested.
    """

    centre_error_m: float = param(
        4.0,
        unit="m",
        minimum=0.05,
        maximum=20,
        help="standard error of the plot centres (0.05 for RTK, 4 under dense canopy); the "
        "search reaches three times as far",
    )
    rotation_deg: float = param(
        8.0,
        unit="degrees",
        minimum=0,
        maximum=45,
        help="the plot may be turned by up to this angle (compass, declination)",
    )
    gate_m: float = 1.5
    min_ratio: float = 1.15
    min_share: float = 0.6
    min_margin: float = 2.5
