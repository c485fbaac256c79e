"""When both layers were measured, and at which breast height: what they say themselves, and what contradicts it."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pandas as pd

from ...core.errors import InputError
from ...stems.quality.priors import USUAL_TAPER_CM_M
from ..searched import flown_on
from ..stand.treelist import TreeList

#: Years given may be off those of the flights by this, or this share: seasons of growth are no calendar years.
_OFF_YEARS, _OFF_SHARE = 1.0, 0.25
#: Years are seasons of growth: the last may be counted before its date.
_SOON = datetime.timedelta(days=366)
#: Trees that grow less than this, cm a year, in the median, and more than their errors, are worth a look at the years.
_SLOW_CM = 0.05
#: Survivors from which their growth as a whole is judged; bias of a difference of two dates, cm; and of how many trees
#: that shrink.
_ENOUGH, _BIAS_CM, _SHRUNK = 5, 0.3, 0.75
#: Breast heights that differ by less are the same, m; the taper between them may be off by this share.
_SAME_BH_M = 0.005


def years_between(before: Path, after: Path, given: float | None) -> tuple[float, str]:
    """``(years, a note)``: by the days of both flights; as given where they do not say.

    Raises:
        InputError: dates exchanged or the same, another number of years than given, or none known.
    """
    first, second = flown_on(before), flown_on(after)
    if first is None or second is None:
        if given is None:
            raise InputError(
                "--years: not given, and the layers do not say when they were flown; give the seasons of growth "
                "between the two dates."
            )
        if first is not None and first + datetime.timedelta(days=365.25 * given) > _today() + _SOON:
            raise InputError(
                f"--years: is {given:g}, but {before} was flown on {first}: {first.year + given:.0f} is still to come; "
                "correct it (years, not months)."
            )
        return given, ""
    years = (second - first).days / 365.25
    when = f"{before} was flown on {first}, {after} on {second}"
    if years <= 0:
        raise InputError(
            f"{when}: {'the same day' if years == 0 else 'exchange them'}; give the earlier one as --before."
        )
    if given is not None and abs(given - years) > max(_OFF_YEARS, _OFF_SHARE * years):
        raise InputError(f"--years: is {given:g}, but {when}, {years:.1f} years apart; correct it, or leave it out.")
    return (years, f"{when}: {years:.1f} years.") if given is None else (given, "")


def _today() -> datetime.date:
    return datetime.date.today()


def to_one_breast_height(before: TreeList, after: TreeList) -> list[str]:
    """Take the first date's diameters to the breast height of the second, by the usual taper; says so."""
    heights = [date.trees["bh_m"].dropna() for date in (before, after)]
    if not all(len(height) for height in heights):
        return []
    first, second = (float(height.median()) for height in heights)
    if abs(first - second) < _SAME_BH_M:
        return []
    moved = USUAL_TAPER_CM_M * (first - second)
    before.trees["dbh_cm"] += moved
    before.trees["dbh_se_cm"] = np.hypot(before.trees["dbh_se_cm"], moved / 2)
    return [
        f"Breast heights differ ({first:g} m before, {second:g} m after): the first date's diameters are taken to "
        f"{second:g} m by the usual taper, {moved:+.2f} cm."
    ]


def judge_growth(trees: pd.DataFrame, years: float, most_cm: float) -> list[str]:
    """Warnings about the survivors' growth as a whole. most_cm: what no tree grows more in a year.

    Raises:
        InputError: no forest grows so: the dates are exchanged, or the years wrong.
    """
    grown = (trees["dbh2_cm"] - trees["dbh1_cm"])[trees["fate"] == "survivor"].to_numpy(float)
    n = len(grown)
    if n < _ENOUGH:
        return []
    mean, error = float(grown.mean()), 2 * float(grown.std(ddof=1)) / np.sqrt(n)
    shrunk = f"{int((grown < 0).sum())} of {n} trees are thinner at the second date, by {-mean:.1f} cm on average"
    if mean < -np.hypot(error, 2 * _BIAS_CM) and (grown < 0).mean() >= _SHRUNK:
        raise InputError(f"{shrunk}: exchange --before and --after, or look at the two measurements.")
    yearly = float(np.median(grown)) / years
    if yearly > most_cm:
        raise InputError(
            f"--years: trees grew {yearly:.1f} cm a year in {years:g} years (median of {n}), expected at most "
            f"{most_cm:g} (--max-yearly-growth-cm); correct the years, or raise the limit if they grow so."
        )
    if 0 < yearly < _SLOW_CM and mean > np.hypot(error, 2 * _BIAS_CM):
        return [
            f"Trees grew {mean:.1f} cm in {years:g} years, {yearly:.2f} cm a year (median of {n}): look whether "
            "--years are years, not months."
        ]
    if mean < -error:
        return [f"{shrunk}: a bias of one date, or exchanged dates."]
    return []
