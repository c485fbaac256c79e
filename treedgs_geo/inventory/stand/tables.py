"""The stand's tables in metric or US units: the one place where numbers become columns, for every file alike."""

from __future__ import annotations

from functools import partial

import numpy as np
import pandas as pd

from ...report.blocks import Column, Table, known
from .species import species_of
from .survey import Stand
from .units import FOOT, METRIC, POUND, UNITS, make_classes


def summary_table(stand: Stand, units: str) -> Table:
    """Stand figures with their errors."""
    quantities = UNITS[units]
    level = f"{100 * stand.design.confidence:g} %"
    one = stand.design.n == 1 and not stand.design.census
    whose = "of measuring this plot" if one else "of measuring" if stand.design.census else "of the stand"
    rows = []
    for name, found in stand.estimates.items():
        q = quantities[name]
        row = {key: known(value, q.factor) for key, value in vars(found).items()}
        # An error that is nothing is not shown.
        row |= {key: row[key] or None for key in ("se_common", "se_missing", "se_taped")}
        rows.append({"quantity": q.heading, "key": q.key, **row, "half_pct": known(found.half_pct)})
    return Table(
        "summary",
        "Stand figures",
        [
            Column("quantity", "Quantity"),
            Column("mean", "Mean", 2),
            Column("se_plots", "s.e. between plots", 2),
            Column("se_trees", "s.e. of tree DBHs", 2),
            Column("se_common", "s.e. of common bias", 2),
            Column("se_missing", "s.e. of stems without a DBH", 2),
            Column("se_taped", "s.e. of the tapes", 2),
            Column("se", "s.e. in all", 2),
            Column("low", f"{level} from", 2),
            Column("high", f"{level} to", 2),
            Column("half_pct", "± %", 1),
        ],
        rows,
        f"Interval {whose}. "
        + (
            "Corrected by taped trees: their error"
            + (" and the spread between plots make" if stand.design.n > 1 else " makes")
            + " the interval; a bias of all DBHs and what is unsure of stems without a DBH are in the tapes already. "
            if stand.taped
            else "The spread between plots holds the errors of the trees' own DBHs already; the bias that all DBHs may "
            "share comes on top, and so does what is unsure of stems without a DBH: whether each is a tree, and of "
            "which diameter. "
        )
        + "Errors of heights and of the volume and biomass equations themselves are not known here and not in it.",
    )


def species_class_table(stand: Stand, units: str, width: float | None) -> Table:
    """The stand and stock table in long form: a row for each species and DBH class, then the sums."""
    classes, quantities = make_classes(units, width), UNITS[units]
    rows, per_tree = stand.rows, stand.rows["tree"].to_numpy(int)
    number = classes.of(stand.values.dbh[per_tree])
    names = stand.trees["species"].map(lambda entry: species_of(entry).symbol).to_numpy(object)[per_tree]
    per_ha = rows["per_ha"].to_numpy()
    frame = pd.DataFrame(
        {"species": names, "class": number, "n": (rows["kind"] == "measured").to_numpy(int), "trees": per_ha}
        | {name: per_ha * stand.values.value[name][per_tree] for name in ("ba", "volume", "biomass")}
    )
    frame["biomass"] /= 1000
    lower, upper = f"lower_{classes.unit}", f"upper_{classes.unit}"
    several = frame["species"].nunique() > 1
    groups = [
        *((name, int(k), part) for (name, k), part in frame.groupby(["species", "class"])),
        *((name, None, part) for name, part in frame.groupby("species") if several),
        ("all", None, frame),
    ]
    made = [
        {
            "species": name,
            "class": "all" if k is None else classes.label(k),
            "n": int(part["n"].sum()),
            lower: None if k is None else classes.lower(k),
            upper: None if k is None else classes.upper(k),
            **{quantities[q].key: known(part[q].sum(skipna=False), quantities[q].factor) for q in _STOCK},
        }
        for name, k, part in groups
    ]
    return Table(
        "stand_table",
        "Stand and stock table by species and DBH class",
        [
            Column("species", "Species"),
            Column("class", f"DBH class, {classes.unit}"),
            Column(lower, f"from, {classes.unit}", 1),
            Column(upper, f"below, {classes.unit}", 1),
            Column("n", "Trees measured", 0),
            *(Column(quantities[n].key, quantities[n].heading, quantities[n].decimals) for n in _STOCK),
        ],
        made,
        "Classes by the DBH as measured (its error moves some trees to a neighbouring class). Basal area, volume and "
        "biomass are corrected for the DBHs' errors.",
        sum(row["class"] == "all" for row in made),
        tuple(classes.label(k) for k in range(int(number.min()), int(number.max()) + 1)),
    )


_STOCK = ("trees", "ba", "volume", "biomass")


def stock_table(long: Table) -> Table:
    """All species together: classes down, the quantities across."""
    columns = [
        column for column in long.columns if column.key != "species" and not column.key.startswith(("lower_", "upper_"))
    ]
    rows = []
    for label in (*long.classes, "all"):
        mine = [r for r in long.rows if (r["class"] == label if label != "all" else r["species"] == "all")]
        parts = {column.key: [r[column.key] for r in mine] for column in columns[1:]}
        rows.append({"class": label, **{key: None if None in part else sum(part) for key, part in parts.items()}})
    return Table("stock_table", "Stand and stock table", columns, rows, long.note, 1)


def cross_table(long: Table, units: str, name: str) -> Table:
    """One quantity with classes down and species across (up to six, the rest together)."""
    q = UNITS[units][name]
    cells = pd.DataFrame([row for row in long.rows if row["class"] != "all"]).astype({q.key: float})
    whole = partial(pd.Series.sum, skipna=False)  # what is not known stays so
    species = cells.groupby("species")[q.key].agg(whole).sort_values(ascending=False, kind="stable").index.tolist()
    shown = species if len(species) <= 6 else species[:5]
    cells["column"] = cells["species"].where(cells["species"].isin(shown), "other")
    sums = cells.groupby(["class", "column"])[q.key].agg(whole).unstack(fill_value=0.0)
    sums = sums.reindex(list(long.classes), fill_value=0.0)
    sums.loc["all"] = sums.sum(skipna=False)
    sums["all"] = sums.sum(axis=1, skipna=False)
    rows = sums.rename_axis("class").reset_index().to_dict("records")
    columns = [Column("class", next(c.heading for c in long.columns if c.key == "class"))]
    columns += [Column(s, species_of(s).label, q.decimals) for s in shown]
    if len(species) > len(shown):
        columns.append(Column("other", "other species", q.decimals))
    if len(species) > 1:
        columns.append(Column("all", "all", q.decimals))
    return Table(f"{name}_by_class", f"{q.heading} by DBH class and species", columns, rows, "", 1)


def plots_table(stand: Stand, units: str) -> Table:
    """One row a plot."""
    quantities = UNITS[units]
    names = ("trees", "ba", "qmd", "lorey", "dominant", "volume", "biomass")
    rows = stand.plot_rows.assign(
        expansion=stand.plot_rows["expansion"] * quantities["trees"].factor,
        **{
            quantities[name].key: stand.plot_rows[METRIC[name].key] * quantities[name].factor
            for name in ("area", *names)
        },
    )
    area = quantities["area"]
    return Table(
        "plots",
        "Plots",
        [
            Column("plot_id", "Plot"),
            Column("shape", "Shape"),
            Column(area.key, area.heading, 4),
            Column("expansion", f"Expansion, {quantities['trees'].unit}", 2),
            Column("edge", "Stand's edge"),
            Column("searched_pct", "Searched, %", 1),
            Column("n_trees", "Measured", 0),
            Column("n_missing", "Without DBH", 0),
            Column("n_dead", "Dead", 0),
            *(Column(quantities[n].key, quantities[n].heading, quantities[n].decimals) for n in names),
        ],
        rows.to_dict("records"),
        "Expansion: what one tree of the plot stands for. Area is horizontal.",
    )


def equations_table(stand: Stand) -> Table:
    """Which equations were used, for how many trees, and for what they hold."""
    counted = stand.rows["tree"].unique()
    rows = []
    for equation in stand.equations:
        row = {
            **vars(equation),
            "formula": equation.formula.text,
            "units": f"D {equation.dbh_unit}, H {equation.height_unit}, result {equation.result_unit}",
            "range": f"{equation.range_text} ({equation.limits or 'limits: not said by whom'})",
        }
        if equation.quantity != "height":
            mine = stand.values.used[equation.quantity][counted] == equation.id
            row["n"] = int(mine.sum())
            row["beyond"] = int((stand.values.outside[equation.quantity][counted] & mine).sum())
        rows.append(row)
    return Table(
        "equations",
        "Equations",
        [
            Column("id", "Equation"),
            Column("quantity", "For"),
            Column("n", "Trees", 0),
            Column("beyond", "outside its range", 0),
            Column("formula", "Formula"),
            Column("units", "Units"),
            Column("range", "Range"),
            Column("source", "Source"),
        ],
        rows,
    )


def trees_table(stand: Stand, units: str) -> Table:
    """Every tree of the plots, also those that do not count."""
    quantities = UNITS[units]
    d, h, per_area = (quantities[name] for name in ("dbh", "height", "trees"))
    rows = stand.tree_rows()
    plot, tree = rows.pop("plot"), rows.pop("tree")
    area, volume, kg = ("m²", "m³", "kg") if units == "metric" else ("ft²", "ft³", "lb")
    m2, m3 = ("m2", "m3") if units == "metric" else ("ft2", "ft3")
    square, cubic, pounds = (1, 1, 1) if units == "metric" else (1 / FOOT**2, 1 / FOOT**3, 1 / POUND)
    curves = {f"stem_{m3}": "stem_m3", f"stem_se_{m3}": "stem_se_m3"} if "stem_m3" in rows else {}
    tapes = {f"taped_{d.unit}": stand.taped.taped_cm[tree] * d.factor} if stand.taped else {}
    per_ha = rows["weight"] / stand.design.areas[plot]
    shown = {
        **tapes,
        d.key: rows["dbh_cm"] * d.factor,
        f"dbh_se_{d.unit}": rows["dbh_se_cm"] * d.factor,
        h.key: rows["height_m"] * h.factor,
        per_area.key: per_ha * per_area.factor,
        f"ba_{m2}": rows["ba_m2"] * square,
        f"volume_{m3}": rows["volume_m3"] * cubic,
        f"biomass_{kg}": rows["biomass_kg"] * pounds,
        **{key: rows[name] * cubic for key, name in curves.items()},
    }
    return Table(
        "trees",
        "Trees",
        [
            Column("plot_id", "Plot"),
            Column("tree_id", "Tree"),
            Column("species", "Species"),
            Column("counts_as", "Counts as"),
            Column(d.key, d.heading, 1),
            *(Column(key, f"Taped, {d.unit}", 1) for key in tapes),
            Column(f"dbh_se_{d.unit}", f"s.e., {d.unit}", 2),
            Column(h.key, h.heading, 1),
            Column("height_source", "Height from"),
            Column("weight", "Weight", 2),
            Column(per_area.key, f"Stands for, {per_area.unit}", 2),
            Column(f"ba_{m2}", f"Basal area, {area}", 4),
            Column(f"volume_{m3}", f"Volume, {volume}", 3),
            Column(f"biomass_{kg}", f"Biomass, {kg}", 1),
            *(
                Column(key, name, 3)
                for key, name in zip(curves, (f"Stem by its curve, {volume}", "s.e."), strict=False)
            ),
            Column("qc_flag", "Flag"),
            Column("qc_reason", "Reason"),
            Column("note", "Note"),
        ],
        rows.assign(**shown).replace("", None).to_dict("records"),
        "Basal area, volume and biomass of each tree are corrected for its DBH error"
        + (", and by one factor for what all tapes together say; its DBH is as measured." if tapes else "."),
    )


def correction_table(stand: Stand, units: str) -> Table:
    """What the DBHs' errors add, and what the trees without a DBH change."""
    quantities = UNITS[units]
    rows = []
    for name, raw in stand.uncorrected.items():
        q = quantities[name]
        corrected = (stand.taped.before if stand.taped else stand.estimates)[name].mean
        final = stand.estimates[name].mean
        rows.append(
            {
                "quantity": q.heading,
                "key": q.key,
                "uncorrected": known(raw, q.factor),
                "inflation": known(raw - corrected, q.factor),
                "inflation_pct": known(100 * (raw - corrected) / corrected) if corrected else None,
                "taped": known(final - corrected, q.factor) if stand.taped else None,
                "corrected": known(final, q.factor),
                "other": known(stand.other[name].mean, q.factor),
            }
        )
    other = "without them" if stand.treatment == "impute" else "with them imputed"
    return Table(
        "corrections",
        "What was corrected",
        [
            Column("quantity", "Quantity"),
            Column("uncorrected", "From the DBHs as measured", 3),
            Column("inflation", "Added by DBH error", 3),
            Column("inflation_pct", "in %", 2),
            Column("taped", "By the tapes", 3),
            Column("corrected", "Corrected (used)", 3),
            Column("other", f"Trees without a DBH: {other}", 3),
        ],
        rows,
        "A random error of standard deviation s makes the mean of DBH² too large by s², so basal area by π/4 s² a "
        "tree; volume and biomass by the same reasoning (three-point Gauss-Hermite rule). The error has to be "
        "independent of the true DBH for this.",
    )


def missing_sentences(stand: Stand, units: str) -> list[str]:
    """How stems without a DBH were treated, with the result of both treatments."""
    n = len(stand.missing)
    if not n:
        return []
    q, share = UNITS[units]["ba"], n / (n + stand.n_small + int((stand.rows["kind"] == "measured").sum()))
    if stand.treatment == "impute":
        read = stand.missing["read_cm"].notna()
        n_read, thin = int(read.sum()), int((stand.missing["thin"] & ~read).sum())
        what, other = "each counts as the mean of its plot's measured trees", "without them"
        if n_read:
            what = f"{n_read} of them count{'s' * (n_read == 1)} as trees of about the diameter that was read"
            what += " of it" if n == 1 else "; the others as the mean of their plot's measured trees" * (n_read < n)
        chance = float(stand.missing["chance"].sum())
        if thin:
            what += f" ({thin} read as thin: of the thinnest quarter)"
        if chance < n - 0.005:
            what += f", by the chance that it is a tree ({chance:.1f} trees in all)"
    else:
        what, other = "they are left out: the figures are too low if the stems are trees", "with them imputed"
    ba = stand.estimates["ba"]
    figure = f"{ba.mean * q.factor:.2f} {q.unit}"
    if np.isfinite(ba.low) and np.isfinite(ba.high):
        figure = f"{ba.low * q.factor:.2f} to {ba.high * q.factor:.2f} {q.unit} ({ba.mean * q.factor:.2f})"
    found = [
        f"{n} stem{'s were' if n > 1 else ' was'} seen but without a DBH ({100 * share:.0f} %); {what}. Basal area "
        f"{figure}, {stand.other['ba'].mean * q.factor:.2f} {other}."
    ]
    if share > 0.3:
        found.append("More than 30 % of the stems have no DBH: take both figures as guesses.")
    return found
