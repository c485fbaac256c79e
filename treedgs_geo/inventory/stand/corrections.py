"""What was corrected: the DBHs' errors, the stems without a DBH, what tapes say."""

from __future__ import annotations

import numpy as np

from ...report.blocks import Column, Table, known
from .survey import Stand
from .units import UNITS


def correction_table(stand: Stand, units: str) -> Table:
    """What the DBHs' errors add, and what the trees without a DBH change."""
    quantities = UNITS[units]
    rows = []
    for name in ("ba", "volume", "biomass"):
        q, raw = quantities[name], stand.uncorrected[name]
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
