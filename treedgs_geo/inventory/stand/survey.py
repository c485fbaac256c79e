"""The stand from trees and plots: everything that any of the report's files shows, computed once, in metric units."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import pyproj
from shapely.geometry.base import BaseGeometry

from ...core.errors import InputError
from ...core.plausible import mixed_units, slenderness, thick_ones
from ...core.shown import count_of, some
from ..reviewed import Reviewed
from .equations import Equation
from .estimate import (
    Design,
    Estimate,
    dominant_height,
    per_hectare,
    plot_table,
    quadratic_mean_diameter,
    weighted_height,
)
from .expansion import Expanded
from .sample import SamplePlot
from .species import species_of
from .stem_volume import CURVES
from .taped import TapedTotals, TapeInput, correct_estimates, find_homes, scale_rows, with_taped_rows
from .treelist import TreeList
from .unmeasured import Gaps
from .values import TreeValues, ValueOptions, tree_values

#: Basal area that hardly a forest outside the redwoods' reaches, and slenderness (%) of whole stands (chosen, not set
#: on data: pole stands reach 110, open parks 35).
MAX_BASAL_AREA_M2_HA, SLENDER = 120.0, (35, 120)
#: A live tree so few times as high as thick is broken off, or its height wrong.
STUB = 10.0


@dataclass
class Stand:
    """estimates: ``trees, ba, volume, biomass, qmd, lorey, dominant`` (per ha; t for biomass) of the treatment chosen.

    other: the same for the treatment that was not chosen. uncorrected: ``ba, volume, biomass`` from the DBHs as they
    are. rows: the rows that count (``plot, tree, weight, kind``, ``per_ha``: trees a hectare of the stand that a row
    stands for). dead: what does not count; missing: stems without a DBH that may be trees, with their ``chance``;
    n_thin, n_left: stems left out as too thin, and as too low or not in the tally; n_small: measured trees below the
    tally's limit. plot_rows: one row a plot. review: what a person decided on the tree layer. taped: what tapes
    corrected; rows and tree values are scaled to it.
    """

    stand_id: str
    trees: pd.DataFrame
    plots: list[SamplePlot]
    design: Design
    values: TreeValues
    rows: pd.DataFrame
    dead: pd.DataFrame
    missing: pd.DataFrame
    n_thin: int
    n_left: int
    n_small: int
    treatment: str
    estimates: dict[str, Estimate]
    other: dict[str, Estimate]
    uncorrected: dict[str, float]
    dead_per_ha: dict[str, float]
    plot_rows: pd.DataFrame
    boundary: BaseGeometry | None
    crs: pyproj.CRS | None
    from_field: bool
    review: Reviewed = field(default_factory=Reviewed)
    taped: TapedTotals | None = None
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def listed(self) -> pd.DataFrame:
        """Every tree of every plot once: measured, without a DBH, dead (``plot, tree, weight, kind``)."""
        measured = self.rows[self.rows["kind"] == "measured"]
        return pd.concat([measured, self.missing, self.dead], ignore_index=True)

    def tree_rows(self) -> pd.DataFrame:
        """:meth:`listed` with what is known of each tree, metric; texts are '' where nothing is known."""
        v, listed = self.values, self.listed()
        tree, plot = listed["tree"].to_numpy(int), listed["plot"].to_numpy(int)
        own = self.trees.iloc[tree].reset_index(drop=True)
        measured = {"ba_m2": v.value["ba"], "volume_m3": v.value["volume"], "biomass_kg": v.value["biomass"]}
        return pd.DataFrame(
            {
                "plot_id": np.array([p.plot_id for p in self.plots], object)[plot],
                "tree_id": own["tree_id"].astype(str).astype(object),
                "species": own["species"].map(lambda entry: species_of(entry).symbol).astype(object),
                "counts_as": listed["kind"].to_numpy(object),
                "dbh_cm": v.dbh[tree],
                "dbh_se_cm": v.se[tree],
                "height_m": v.height[tree],
                "height_source": v.height_source[tree],
                "weight": listed["weight"].to_numpy(float),
                **{name: values[tree] for name, values in measured.items()},
                **{name: own[name].astype(float) for name in CURVES if name in own},
                "qc_flag": own["qc_flag"].astype(object),
                "qc_reason": own["qc_reason"].fillna("").astype(object),
                "note": own["note"].fillna("").astype(object),
            }
        ).assign(plot=plot, tree=tree)

    @property
    def equations(self) -> list[Equation]:
        """Those that a counted tree uses."""
        counted = self.rows["tree"].unique()
        used = {name for column in self.values.used.values() for name in column[counted]}
        return [e for e in self.values.equations if e.id in used or e.quantity == "height"]


def make_stand(
    trees: TreeList,
    expanded: Expanded,
    book: list[Equation],
    options: ValueOptions,
    treatment: str = "impute",
    confidence: float = 0.95,
    stand_id: str = "stand",
    boundary: BaseGeometry | None = None,
    tapes: TapeInput | None = None,
) -> Stand:
    """Compute the stand. tapes: taped trees that correct its totals.

    Raises:
        InputError: no tree with a DBH in any plot.
    """
    plots = expanded.plots
    census = len(plots) == 1 and plots[0].edge == "census"
    design = Design(np.array([plot.weight_area_ha for plot in plots]), census, confidence)
    measured, filled, dead = (expanded.of(*kinds) for kinds in (("measured",), ("measured", "imputed"), ("dead",)))
    if not len(measured):
        raise InputError(
            f"No tree with a DBH stands in the plots ({len(plots)}): check the plots' coordinates, their "
            "epsg and --min-dbh-cm."
        )
    table = trees.trees.copy()
    valued = table.assign(in_table=np.isin(np.arange(len(table)), filled["tree"]))
    values = tree_values(with_taped_rows(valued, tapes) if tapes else valued, book, options)
    chosen, left = (filled, measured) if treatment == "impute" else (measured, filled)
    estimates, other = (_estimates(design, rows, values, expanded.gaps) for rows in (chosen, left))
    uncorrected = {
        name: float((chosen["weight"] * values.raw[name][chosen["tree"]]).sum(skipna=False))
        / design.areas.sum()
        / (1000 if name == "biomass" else 1)
        for name in ("ba", "volume", "biomass")
    }
    taped = None
    if tapes:
        homes = find_homes(expanded, table, tapes)
        other, _ = correct_estimates(design, other, left, expanded, values, homes, tapes)
        estimates, taped = correct_estimates(design, estimates, chosen, expanded, values, homes, tapes)
        chosen = scale_rows(chosen, values, taped)
    total = design.areas.sum()
    chosen = chosen.assign(per_ha=chosen["weight"] / total).reset_index(drop=True)
    stems = expanded.gaps.stems.astype({"plot": int, "tree": int})
    n_thin = int((stems["why"] == "too_small").sum())
    known_dead = dead[np.isfinite(values.dbh[dead["tree"]])]
    stand = Stand(
        stand_id=stand_id,
        trees=table,
        plots=plots,
        design=design,
        values=values,
        rows=chosen,
        dead=dead,
        missing=stems[stems["chance"] > 0].drop(columns="why").assign(kind="missing").reset_index(drop=True),
        n_thin=n_thin,
        n_left=int((stems["why"] != "").sum()) - n_thin,
        n_small=len(expanded.of("small")),
        treatment=treatment,
        estimates=estimates,
        other=other,
        uncorrected=uncorrected,
        dead_per_ha={
            "trees": float(dead["weight"].sum() / total),
            "ba": float((known_dead["weight"] * values.raw["ba"][known_dead["tree"]]).sum() / total),
        },
        plot_rows=plot_table(design, plots, chosen, values),
        boundary=boundary,
        crs=trees.crs,
        from_field=trees.from_field,
        review=trees.review,
        taped=taped,
        notes=[*trees.notes, *expanded.notes],
        warnings=[*trees.warnings, *expanded.warnings, *values.warnings],
    )
    for kind, frame in (("n_trees", measured), ("n_missing", stand.missing), ("n_dead", dead)):
        stand.plot_rows[kind] = np.bincount(frame["plot"], minlength=design.n)
    _remark(stand, options)
    return stand


def _estimates(design: Design, rows: pd.DataFrame, values: TreeValues, gaps: Gaps) -> dict[str, Estimate]:
    one = np.ones(len(values.dbh))
    found = {"trees": per_hectare(design, rows, one, np.nan * one, 0 * one, gaps)}
    for name in ("ba", "volume", "biomass"):
        unit = 1000 if name == "biomass" else 1
        value, sd, shift = (each[name] / unit for each in (values.value, values.sd, values.shift))
        found[name] = per_hectare(design, rows, value, sd, shift, gaps)
    return found | {
        "qmd": quadratic_mean_diameter(design, rows, values, gaps),
        "lorey": weighted_height(design, rows, values, gaps),
        "dominant": dominant_height(design, rows, values),
    }


def _implausible(stand: Stand) -> list[str]:
    """What no forest, or hardly one, has: diameters in another unit, plots of another size, one tree that is none."""
    found = []
    basal_area = stand.estimates["ba"].mean
    if basal_area > MAX_BASAL_AREA_M2_HA:
        found.append(
            f"A basal area of {basal_area:,.0f} m²/ha, expected up to {MAX_BASAL_AREA_M2_HA:g}: look whether DBHs are "
            "girths or in another unit, plots larger than given, or trees there twice."
        )
    counted = stand.rows["tree"].unique()
    dbh, trees = stand.values.dbh[counted], stand.trees.iloc[counted]
    slender = slenderness(trees["height_m"].to_numpy(float), dbh)
    if not SLENDER[0] <= slender <= SLENDER[1] and np.isfinite(slender):
        found.append(
            f"The trees are {slender:.0f} times as high as they are thick (median), expected {SLENDER[0]} to "
            f"{SLENDER[1]}: look whether DBHs are girths or in inches, or heights in feet."
        )
    plots = stand.rows.drop_duplicates("tree")["plot"].to_numpy()
    if (mixed := mixed_units(trees["height_m"].to_numpy(float), trees["dbh_cm"].to_numpy(float), plots)) is not None:
        odd = some((str(stand.plots[k].plot_id) for k in np.unique(plots[mixed.rows])), 5)
        found.append(f"{mixed.text()[0].upper()}{mixed.text()[1:]} (plot {odd}): look whether they are in two units.")
    if len(stubs := trees[trees["height_m"].to_numpy(float) < STUB * dbh / 100]):
        named = ", ".join(f"{row.tree_id} ({row.height_m:.1f} m)" for row in stubs.head(5).itertuples())
        found.append(
            f"{count_of(len(stubs), 'live tree')} less than {STUB:g} times as high as thick (tree {named}): look "
            "whether the height is right."
        )
    if len(thick := trees[thick_ones(dbh, trees["species"].astype(str).to_numpy())]):
        named = ", ".join(f"{row.tree_id} ({row.dbh_cm:.0f} cm, {row.species})" for row in thick.head(5).itertuples())
        found.append(
            f"{count_of(len(thick), 'tree')} far thicker than the next of {'its' if len(thick) == 1 else 'their'} "
            f"species (tree {named}): look whether the DBH is right."
        )
    return found


def _remark(stand: Stand, options: ValueOptions) -> None:
    """Sentences that a reader of the numbers needs."""
    design, values = stand.design, stand.values
    stand.warnings += _implausible(stand)
    if design.census:
        stand.notes.append("Every tree of the stand was looked for: there is no sampling error, only measuring error.")
    elif design.n == 1:
        stand.warnings.append(
            "One plot: how much the stand differs from it cannot be known, so there is no sampling error and no "
            "interval for the stand; the intervals given are of measuring this one plot."
        )
    elif design.n < 5:
        stand.notes.append(f"{design.n} plots: the standard errors are themselves uncertain, the intervals wide.")
    counted_trees = stand.rows["tree"].unique()
    if n_blind := int((~np.isfinite(values.se[counted_trees])).sum()):
        stand.warnings.append(
            f"{n_blind} of {len(counted_trees)} trees have no standard error of DBH: what it adds to basal area and "
            "volume is not corrected for them (give --dbh-se-cm)."
        )
    if n_check := int((stand.trees["qc_flag"].to_numpy()[counted_trees] == "check").sum()):
        stand.notes.append(f"Counted although the DBH is marked 'check': {count_of(n_check, 'tree')}; look at them.")
    if not np.isfinite(stand.estimates["lorey"].mean) and "height" in values.gaps:
        stand.notes.append(f"No mean height: {'; '.join(values.gaps['height'])}.")
    # What is missing altogether comes before what is only less sure.
    stand.warnings[:0] = [
        f"No {name} for the stand: {'; '.join(values.gaps[name])}."
        for name in ("volume", "biomass")
        if name in values.gaps
    ]
    if options.common_se_cm and stand.taped is None:
        stand.notes.append(
            f"A bias of {options.common_se_cm:g} cm (standard error) that all DBHs share is part of every interval; it "
            "does not average out."
        )
