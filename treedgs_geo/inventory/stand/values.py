"""What each tree is worth: basal area, height, volume, biomass, freed of what the DBH's own error adds to them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from scipy.optimize import least_squares

from ...core.shown import count_of
from ...stems.quality.priors import BREAST_HEIGHT_M
from .equations import Equation, choose
from .species import species_of

#: A curve from fewer heights, or over a narrower range of DBH (largest / smallest), says more about chance than trees.
MIN_HEIGHTS, MIN_SPREAD = 10, 1.5


@dataclass(frozen=True)
class HeightCurve:
    """h = bh + (d / (a + b d))^2 (Naslund 1936), d in cm, h in m.

    rmse_m: root mean square residual (n - 2 degrees of freedom). low_cm, high_cm: DBHs it was fitted to.
    """

    a: float
    b: float
    breast_height_m: float
    n: int
    rmse_m: float
    low_cm: float
    high_cm: float

    def __call__(self, dbh_cm: np.ndarray) -> np.ndarray:
        """Heights, m."""
        d = np.asarray(dbh_cm, float)
        return self.breast_height_m + (d / (self.a + self.b * d)) ** 2

    def outside(self, dbh_cm: np.ndarray) -> np.ndarray:
        """True where the curve is used beyond the DBHs it was fitted to."""
        d = np.asarray(dbh_cm, float)
        return (d < self.low_cm) | (d > self.high_cm)

    @property
    def text(self) -> str:
        """The curve with its numbers."""
        return f"h = {self.breast_height_m:g} + (d / ({self.a:.4f} + {self.b:.4f} d))²"


def fit_curve(
    dbh_cm: np.ndarray, height_m: np.ndarray, breast_height_m: float = BREAST_HEIGHT_M
) -> tuple[HeightCurve | None, str]:
    """Fit by least squares on the heights themselves, so that their mean is met; outliers count less (soft L1 at 2 m).

    Returns:
        the curve, or None with the reason why there is none.
    """
    d, h = np.asarray(dbh_cm, float), np.asarray(height_m, float)
    use = np.isfinite(d) & np.isfinite(h) & (h > breast_height_m + 0.3) & (d > 0)
    d, h = d[use], h[use]
    if len(d) < MIN_HEIGHTS:
        return None, f"{len(d)} trees with DBH and height, a curve needs {MIN_HEIGHTS}"
    if d.max() < MIN_SPREAD * d.min():
        return None, f"heights only of trees from {d.min():.1f} to {d.max():.1f} cm DBH, too narrow for a curve"
    # Linear in a and b after the transformation: where the search starts.
    start = np.polyfit(d, d / np.sqrt(h - breast_height_m), 1)[::-1]
    start = np.clip(start, [1e-3, 1e-3], [1e3, 1e3])

    def residual(p: np.ndarray) -> np.ndarray:
        return breast_height_m + (d / (p[0] + p[1] * d)) ** 2 - h

    found = least_squares(
        residual, start, bounds=([1e-6, 1e-6], [1e4, 1e4]), loss="soft_l1", f_scale=2.0, x_scale=start
    )
    rmse = float(np.sqrt(np.sum(residual(found.x) ** 2) / max(len(d) - 2, 1)))
    a, b = (float(value) for value in found.x)
    curve = HeightCurve(a, b, breast_height_m, len(d), rmse, float(d.min()), float(d.max()))
    return curve, ""


BA = np.pi / 4e4
#: Half the distance of the outer nodes of the three-point Gauss-Hermite rule, in standard errors.
_NODE = np.sqrt(3.0)
#: What is summed up, beside the number of trees.
QUANTITIES = ("ba", "volume", "biomass")


#: DBHs (cm) of all trees, and how much higher they are taken (m) -> their values.
Rule = Callable[..., np.ndarray]


@dataclass(frozen=True)
class ValueOptions:
    """heights: ``measured`` (only those), ``fitted`` (curve from the measured ones) or ``published``. dbh_se_cm:
    for trees without one. common_se_cm: standard error of what all DBHs share."""

    heights: str = "fitted"
    origin: str = "natural"
    dbh_se_cm: float | None = None
    common_se_cm: float = 0.2
    breast_height_m: float = BREAST_HEIGHT_M


@dataclass
class TreeValues:
    """Arrays, one entry a tree (NaN: not known). Per quantity of :data:`QUANTITIES`: ``raw`` from the DBH as measured,
    ``value`` corrected, ``sd`` from the tree's own error, ``shift`` when all DBHs are one common error thicker.

    ba in m2, volume in m3, biomass in kg. equations: rows of the equations table. curves: sentences. gaps: quantity ->
    why some trees have none. outside: (tree, quantity) flags. refit: heights of all trees by
    curves fitted without the measured heights of some (a mask), for the error that the curve itself brings.
    """

    dbh: np.ndarray
    se: np.ndarray
    height: np.ndarray
    height_source: np.ndarray
    raw: dict[str, np.ndarray] = field(default_factory=dict)
    value: dict[str, np.ndarray] = field(default_factory=dict)
    sd: dict[str, np.ndarray] = field(default_factory=dict)
    shift: dict[str, np.ndarray] = field(default_factory=dict)
    used: dict[str, np.ndarray] = field(default_factory=dict)
    outside: dict[str, np.ndarray] = field(default_factory=dict)
    equations: list[Equation] = field(default_factory=list)
    curves: list[str] = field(default_factory=list)
    gaps: dict[str, list[str]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    far: Counter[str] = field(default_factory=Counter)
    refit: Callable[[np.ndarray], np.ndarray] | None = None


def tree_values(trees: pd.DataFrame, book: list[Equation], options: ValueOptions) -> TreeValues:
    """trees: ``dbh_cm`` (NaN: none), ``dbh_se_cm``, ``height_m``, perhaps ``height_se_m``, ``species``, ``dead``,
    ``in_table`` (False: counts for the height curve only), and perhaps ``in_curve`` (False: not for that either, it is
    only valued)."""
    d, se = trees["dbh_cm"].to_numpy(float), trees["dbh_se_cm"].to_numpy(float)
    known = np.isfinite(d)
    if options.dbh_se_cm is not None:
        se = np.where(np.isfinite(se), se, options.dbh_se_cm)
    species = np.array([species_of(entry).symbol for entry in trees["species"]], dtype=object)
    found = TreeValues(d, se, trees["height_m"].to_numpy(float).copy(), np.full(len(d), "", object))
    in_table = trees["in_table"].to_numpy(bool) & known
    height_of = _heights(found, trees, species, book, options, in_table)
    error = np.where(known & np.isfinite(se), se, 0.0)
    n_wide = int((in_table & (error > d / 2)).sum())
    if n_wide:
        found.warnings.append(
            f"The DBH error of {count_of(n_wide, 'tree')} is above half the DBH: the basal area is nearly guesswork."
        )
    # A height of the tree's own brings its own error; that of the curve is the survey's (``refit``).
    own_height = found.height_source == "measured"
    height_se = np.where(own_height, np.nan_to_num(np.asarray(trees.get("height_se_m", np.nan), float)), 0.0)
    rules: dict[str, Rule] = {"ba": lambda x, _higher_m=0.0: BA * x**2}
    for name in ("volume", "biomass"):
        rules[name] = _equations(found, name, species, book, options.origin, height_of, in_table)
    for name, rule in rules.items():
        _propagate(found, name, rule, error, height_se, options.common_se_cm)
    if far := +found.far:
        named = "; ".join(f"{number} {what}" for what, number in far.most_common(6))
        more = f"; and {len(far) - 6} more kinds" if len(far) > 6 else ""
        found.warnings.append(
            f"Extrapolated, for trees outside the range that a curve or equation holds for: {named}{more}."
        )
    return found


def _propagate(
    found: TreeValues, name: str, rule: Rule, error: np.ndarray, height_se: np.ndarray, common: float
) -> None:
    """Mean and spread of ``rule(DBH + error)`` by the three-point Gauss-Hermite rule (exact for basal area); the error
    of the tree's own height (``height_se``, m) is added to the spread, to first order.

    With measured = true + error the mean of ``rule(measured)`` is too large (convex rules): what the same error adds at
    the measured DBH is taken off.
    """
    d = found.dbh
    middle, low, high = rule(d), rule(np.maximum(d - _NODE * error, 0.1)), rule(d + _NODE * error)
    # Where the lower node leaves the rule's reach, the tree keeps its value uncorrected.
    gain = BA * error**2 if name == "ba" else np.nan_to_num((low + high) / 6 - middle / 3)
    spread = np.sqrt(
        np.maximum((low**2 + high**2) / 6 + middle**2 * 2 / 3 - ((low + high) / 6 + middle * 2 / 3) ** 2, 0)
    )
    by_height = np.nan_to_num(rule(d, height_se) - rule(d, -height_se)) / 2
    spread = np.hypot(np.nan_to_num(spread), by_height)
    found.raw[name] = middle
    found.value[name] = np.maximum(middle - gain, 0.0)
    found.sd[name] = np.where(np.isfinite(found.se), np.nan_to_num(spread), np.nan)
    shifted = (rule(d + common) - rule(np.maximum(d - common, 0.1))) / 2
    found.shift[name] = np.nan_to_num(shifted)


def _heights(
    found: TreeValues,
    trees: pd.DataFrame,
    species: np.ndarray,
    book: list[Equation],
    options: ValueOptions,
    in_table: np.ndarray,
) -> Callable[[np.ndarray], np.ndarray]:
    """Fill ``height`` and ``height_source``; returns heights as a function of the DBHs of all trees."""
    d, h = found.dbh, found.height.copy()
    measured = np.isfinite(h)
    found.height_source[measured] = "measured"
    rules: list[tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]] = []
    open_ = np.isfinite(d) & ~measured
    n_open = int((open_ & in_table).sum())
    live = ~trees["dead"].to_numpy(bool) & np.asarray(trees.get("in_curve", True), bool)
    if n_open and options.heights == "fitted":
        pooled, why = fit_curve(d[live], h[live], options.breast_height_m)
        for name in sorted(set(species[open_])):
            own, _ = fit_curve(d[live & (species == name)], h[live & (species == name)], options.breast_height_m)
            curve = own or pooled
            if curve is not None:
                chosen, of = open_ & (species == name), name if own else "all species"
                rules.append((chosen, curve))
                text = (
                    f"Height curve ({of}): {curve.text}, from {curve.n} trees of {curve.low_cm:.1f} to "
                    f"{curve.high_cm:.1f} cm, residual {curve.rmse_m:.2f} m."
                )
                found.curves += [] if text in found.curves else [text]
                found.far[f"heights from the curve ({of})"] += int((chosen & in_table & curve.outside(d)).sum())
        if pooled is None:
            found.gaps["height"] = [f"{count_of(n_open, 'tree')} without a height ({why})"]
    elif n_open and options.heights == "published":
        for name in sorted(set(species[open_])):
            chosen = open_ & (species == name)
            equation = choose(book, "height", species_of(name), options.origin, False)
            if equation is None:
                found.gaps.setdefault("height", []).append(f"no published height curve for {name}")
                continue
            found.equations += [] if equation in found.equations else [equation]
            rules.append((chosen, equation.value))
            found.curves.append(
                f"{int((chosen & in_table).sum())} heights of {name} are from {equation.id}, a regional curve: this "
                "stand's may differ by metres."
            )
    elif n_open:
        found.gaps["height"] = [f"{count_of(n_open, 'tree')} without a measured height"]

    def height_of(x: np.ndarray) -> np.ndarray:
        heights = h.copy()
        for chosen, rule in rules:
            heights[chosen] = rule(x[chosen])
        return heights

    for chosen, _ in rules:
        found.height_source[chosen] = "curve" if options.heights == "fitted" else "published"
    found.height = height_of(d)

    kept: dict[bytes, np.ndarray] = {}

    def refit(without: np.ndarray) -> np.ndarray:
        use = live & measured & ~without
        if (found_before := kept.get(use.tobytes())) is not None:
            return found_before
        heights = kept[use.tobytes()] = found.height.copy()
        for chosen, _ in rules:
            same = use & np.isin(species, np.unique(species[chosen]))
            curve, _ = fit_curve(d[same], h[same], options.breast_height_m)
            if curve is None:
                curve, _ = fit_curve(d[use], h[use], options.breast_height_m)
            # With too few heights left that plot's part of the curve's error stays unknown.
            if curve is not None:
                heights[chosen] = curve(d[chosen])
        return heights

    if rules and options.heights == "fitted":
        found.refit = refit
    return height_of


def _equations(
    found: TreeValues,
    quantity: str,
    species: np.ndarray,
    book: list[Equation],
    origin: str,
    height_of: Callable[[np.ndarray], np.ndarray],
    in_table: np.ndarray,
) -> Rule:
    """Choose each tree's equation; returns the quantity as a function of the DBHs of all trees."""
    d, h = found.dbh, found.height
    used = np.full(len(d), "", object)
    beyond = np.zeros(len(d), bool)
    groups: list[tuple[np.ndarray, Equation]] = []
    why: Counter[str] = Counter()
    generic: Counter[str] = Counter()
    for name in sorted(set(species)):
        for tall in (True, False):
            chosen = np.isfinite(d) & (species == name) & (np.isfinite(h) == tall)
            if not chosen.any():
                continue
            equation = choose(book, quantity, species_of(name), origin, tall)
            if equation is None:
                with_height = not tall and choose(book, quantity, species_of(name), origin, True)
                reason = "without a height" if with_height else f"of species {name} without an equation"
                why[reason] += int((chosen & in_table).sum())
                continue
            outside = equation.outside(d, h) & chosen
            beyond |= outside
            found.far[f"{quantity} by {equation.id} ({equation.range_text})"] += int((outside & in_table).sum())
            if equation.id.startswith("form-factor"):
                generic[name] += int((chosen & in_table).sum())
            used[chosen] = equation.id
            groups.append((chosen, equation))
            found.equations += [] if equation in found.equations else [equation]
    if generic := +generic:
        found.warnings.append(
            f"The volume of {count_of(sum(generic.values()), 'tree')} is a generic form factor, no equation of the "
            f"species ({', '.join(generic)}): give --species or --equations."
        )
    if gaps := [f"{count_of(count, 'tree')} {reason}" for reason, count in why.items() if count]:
        found.gaps[quantity] = gaps
    found.used[quantity], found.outside[quantity] = used, beyond

    def rule(x: np.ndarray, higher_m: np.ndarray | float = 0.0) -> np.ndarray:
        heights, result = height_of(x) + higher_m, np.full(len(x), np.nan)
        for chosen, equation in groups:
            result[chosen] = equation.value(x[chosen], heights[chosen])
        return result

    return rule
