"""From the settings of ``compare`` to its files: when both layers were measured and at which breast height, then fates
and growth."""

from __future__ import annotations

import datetime
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from shapely import contains_xy

from ... import __version__
from ...core.crs import project_crs
from ...core.errors import InputError
from ...core.files import fingerprint, write_json
from ...core.frames import moved
from ...core.layer_files import write_layer
from ...core.progress import Reporter
from ...core.shown import count_of, some
from ...core.tables import write_csv
from ...report.blocks import known
from ...report.pdf import ensure_pages, write_pages
from ...stems.quality.priors import USUAL_TAPER_CM_M
from ..options import PairingOptions
from ..searched import flown_on, searched_area
from ..stand.estimate import Design, Estimate
from ..stand.sample import SamplePlot, read_sample
from ..stand.treelist import TreeList, measured_trees, on_the_map
from .growth import SharedErrors, stand_change, tree_growth
from .joining import Joined, join_dates
from .report import LAYER, OWN_LAYERS, change_table, make_change_document

#: A tree that shrank, or grew faster than the limit, by more than this many standard errors is named.
_ODD = 3.0
#: How far the maps of two dates may be turned against each other, degrees, and the same tree lie apart after that, m.
_TURN_DEG, _APART_M = 2.0, 1.0
#: Trees this near to ground that both dates searched are compared, m: two maps of it do not agree to the decimetre.
_RIM_M = 0.5

#: Figures of ``change.json``.
_OF_ESTIMATE = ("mean", "se_plots", "se_trees", "se_common", "se", "df", "low", "high")
_FIGURES = {name.replace("common", "shared"): name for name in _OF_ESTIMATE}


def compare_dates(settings: Any, reporter: Reporter) -> dict[str, Any]:
    """settings: ``CompareSettings``.

    Raises:
        InputError: inputs that do not fit together.
    """
    folder = Path(settings.output)
    ensure_pages(folder, "change.json", "change.gpkg", OWN_LAYERS)
    with reporter.stage("read", 0.0, 0.2):
        years, said = years_between(settings.before, settings.after, settings.years)
        settings = replace(settings, years=years)
        before, after, plots = _read(settings)
        before.warnings += to_one_breast_height(before, after)
        before.notes += [said] if said else []
    with reporter.stage("pair trees", 0.2, 0.6):
        options = PairingOptions(centre_error_m=settings.centre_error_m, rotation_deg=_TURN_DEG, gate_m=_APART_M)
        max_growth_cm = settings.max_yearly_growth_cm * settings.years
        joined = join_dates(before, after, plots, options, settings.min_dbh_cm, max_growth_cm)
        joined.warnings += judge_growth(joined.trees, years, settings.max_yearly_growth_cm)
    with reporter.stage("estimate", 0.6, 0.7):
        level = settings.confidence_pct / 100
        shared = SharedErrors(settings.common_se_cm, settings.block_before_pct / 100, settings.block_after_pct / 100)
        trees = joined.trees.join(tree_growth(joined.trees, shared, settings.years, level))
        changes: dict[str, Estimate] = {}
        if plots:
            kept = [k for k in range(len(plots)) if k not in joined.unpaired]
            design = Design(np.array([plots[k].area_ha for k in kept]), False, level)
            number = trees["plot"].map({k: n for n, k in enumerate(kept)})
            paired = trees.assign(plot=number)[number.notna()].reset_index(drop=True)
            changes = stand_change(paired.astype({"plot": int}), design, shared, settings.years)
    warnings, notes = _remarks(before, after, joined, trees, plots, settings)
    reporter.tell(warnings, notes)
    counts = {str(fate): int(n) for fate, n in trees["fate"].value_counts().items()}
    with reporter.stage("write", 0.7, 1.0):
        (folder / "change.json").unlink(missing_ok=True)
        names = [plot.plot_id for plot in plots] or ["all"]
        table = change_table(trees, names, after.crs)
        write_layer(folder / "change.gpkg", OWN_LAYERS, LAYER, table, "Point")
        write_csv(folder / "change.csv", table)
        write_pages(folder / "change", make_change_document(table, changes, counts, warnings, notes, settings))
        figures = {
            name: {key: known(getattr(found, of)) for key, of in _FIGURES.items()} for name, found in changes.items()
        }
        write_json(
            folder / "change.json",
            {
                "years": settings.years,
                "confidence": level,
                "fates": counts,
                "per_ha": figures,
                "offsets_m": {name: [round(v, 3) for v in offset] for name, offset in joined.offsets.items()},
                "warnings": warnings,
                "notes": notes,
                "inputs": {
                    f"{when}: {path.name}": fingerprint([path])
                    for when, path in (("before", settings.before), ("after", settings.after))
                },
                "version": __version__,
            },
        )
    growth, change = (known(changes[name].mean) if changes else None for name in ("growth_cm_a", "ba_change"))
    return {
        "output": str(folder),
        "report": str(folder / "change.html"),
        "pdf": str(folder / "change.pdf"),
        "layer": str(folder / "change.gpkg"),
        "n_survivors": counts.get("survivor", 0),
        **{f"n_{fate}": counts.get(fate, 0) for fate in ("ingrowth", "mortality", "unsure")},
        "growth_cm_a": None if growth is None else round(growth, 4),
        "ba_change_m2_ha": None if change is None else round(change, 4),
    }


def _read(settings: Any) -> tuple[TreeList, TreeList, list[SamplePlot]]:
    crs = project_crs(settings.crs) if settings.crs else None
    before, after = (on_the_map(measured_trees(path, crs), path, crs) for path in (settings.before, settings.after))
    if before.crs != after.crs:
        before.searched = searched_area(settings.before, after.crs)
        before.trees[["x", "y"]] = moved(before.trees[["x", "y"]].to_numpy(float), before.crs, after.crs)
        before.crs = after.crs
    if len(before.trees) and len(after.trees):
        away = np.hypot(*(before.trees[["x", "y"]].mean() - after.trees[["x", "y"]].mean()))
        span = sum(np.ptp(date.trees[["x", "y"]].to_numpy(float), axis=0).max() for date in (after, before))
        if away > max(span, 50.0):
            raise InputError(
                f"{settings.after}: its trees are {away:,.0f} m away from those of {settings.before}; give two layers "
                "of the same ground."
            )
    _refuse_same(before.trees, after, settings)
    return before, after, _common_ground(before, after, settings)


def _common_ground(before: TreeList, after: TreeList, settings: Any) -> list[SamplePlot]:
    """The plots as far as both dates searched them; a tree on ground that one date did not search is neither new nor
    gone, so that without plots only trees on common ground stay."""
    plots = read_sample(settings.plots, after.crs) if settings.plots is not None else []
    for path, date in ((settings.before, before), (settings.after, after)):
        plots = date.plots_searched(plots, path.name) if plots else []
    if plots or before.searched is None or after.searched is None:
        return plots
    common = before.searched.intersection(after.searched)
    for date, text in ((before, "first"), (after, "second")):
        inside = contains_xy(common.buffer(_RIM_M), date.trees["x"], date.trees["y"])
        if not inside.all():
            date.notes.append(
                f"{count_of(int((~inside).sum()), 'tree')} of the {text} date left out: on ground that was not "
                "searched at both dates."
            )
        date.trees = date.trees[inside].reset_index(drop=True)
    return plots


def _refuse_same(before: pd.DataFrame, after: TreeList, settings: Any) -> None:
    """Refuse one layer as both dates: no two flights give the same DBHs at the same places. A warning of the second
    date where it holds part of the first."""
    one, two = (
        set(map(tuple, trees[["x", "y", "dbh_cm"]].dropna().round({"x": 1, "y": 1, "dbh_cm": 3}).to_numpy().tolist()))
        for trees in (before, after.trees)
    )
    share = len(one & two) / max(min(len(one), len(two)), 1)
    said = (
        f"{len(one & two)} of its {len(two)} trees have the places and DBHs of those in {settings.before} to the digit"
    )
    if len(one) >= 3 and share > 0.9:
        raise InputError(f"{settings.after}: {said}: it is the same measurement; give the layers of two dates.")
    if len(one & two) >= 3 and share > 0.1:
        after.warnings.append(
            f"{settings.after.name}: {said}: were they not measured again? They count as trees that did not grow."
        )


def _remarks(
    before: TreeList, after: TreeList, joined: Joined, trees: pd.DataFrame, plots: list[SamplePlot], settings: Any
) -> tuple[list[str], list[str]]:
    warnings = [*before.warnings, *after.warnings, *joined.warnings]
    notes = [f"First date: {text}" for text in before.notes] + [f"Second date: {text}" for text in after.notes]
    fate = trees["fate"]
    lost = (fate == "mortality") & trees["after_id"].isna()
    if n_lost := int(lost.sum()):
        dead = float(trees.loc[lost, "chance"].sum())
        said = (
            f"{count_of(joined.n_missed, 'thick tree')} of the second date {'was' if joined.n_missed == 1 else 'were'} "
            f"missed at the first ({100 * joined.miss:.1f} %); if the second flight missed as many, {dead:.1f} of the "
            "lost ones are dead, and so many count"
            if joined.n_missed
            else "nothing says that a flight misses trees here: all of them count as dead"
        )
        warnings.append(
            f"Not found again: {count_of(n_lost, 'tree')}. A flight may miss a living tree ({said}). Look at them "
            "(fate 'mortality' in the layer) before you report mortality."
        )
    if joined.unpaired and plots:
        named = some((plots[k].plot_id for k in joined.unpaired), 8)
        warnings.append(
            f"Left out of every figure: {count_of(len(joined.unpaired), 'plot')} ({named}) in which the trees of both "
            "dates could not be paired."
        )
    if unsure := int((fate == "unsure").sum()):
        warnings.append(
            f"Which tree is which is not sure for {count_of(unsure, 'tree')}: they count neither as growth nor as dead."
        )
    if open_ := int((fate == "no growth").sum()):
        notes.append(
            f"Alive, without a DBH at one date: {count_of(open_, 'tree')}; each counts as the mean of its plot."
        )
    growth, error, limit = trees["growth_cm"], trees["growth_se"], settings.max_yearly_growth_cm * settings.years
    for odd, text in (
        (growth < -_ODD * error, "shrank by more than their errors allow"),
        (growth > limit + _ODD * error.fillna(0.0), "grew faster than --max-yearly-growth-cm"),
    ):
        if len(part := trees[(fate == "survivor") & odd]):
            named = some((f"{row.after_id:.0f} ({row.growth_cm:+.1f} cm)" for row in part.itertuples()), 8)
            warnings.append(
                f"{count_of(len(part), 'tree')} {text}: {named}; look whether they are the same trees, and at their "
                "flags."
            )
    if blind := int(trees.loc[fate == "survivor", "growth_se"].isna().sum()):
        warnings.append(f"{count_of(blind, 'survivor')} without a standard error of DBH: their growth has no interval.")
    if not plots:
        notes.append("Without --plots there is no area: nothing is given per hectare.")
    elif len(plots) == 1:
        warnings.append(
            "One plot: how much the stand differs from it cannot be known; the intervals are of measuring this one "
            "plot."
        )
    notes.append(
        "The bias of both dates is taken as independent. Flown with the same camera and measured in the same way, part "
        "of it cancels in the growth: the intervals are then too wide."
    )
    return warnings, notes


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
        if first is not None and first + datetime.timedelta(days=365.25 * given) > datetime.date.today() + _SOON:
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
