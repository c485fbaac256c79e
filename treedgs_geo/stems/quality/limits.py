"""Every limit that flags or refuses a tree, in one table: what is measured, from where on, and what set the limit.

A route measures some quantities of a stem and hands them to :func:`judge`; the reasons come back in the table's order.
``docs/analyst/quality-limits.md`` is written from this table (``tools/write_limits.py``). A new reason: add it to
:data:`.reasons.REASONS`, add its row here, hand the quantity to :func:`judge` where it is known, write the page again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Literal, NamedTuple

from ...pointcloud.sanity import TALL_M, TALL_SHARE
from ...reconstruction.options import CONFIRMED_SHARE
from .findings import Bound, Findings, Level, Limit, Route, Settings


def judge(
    route: Route, measured: Mapping[str, float], dbh_cm: float = float("nan"), settings: Settings | None = None
) -> Findings:
    """What the measured quantities of a stem say about it.

    measured: quantity -> value; quantities that are not there are not judged. dbh_cm: for limits that are shares of
    the diameter. settings: for limits that are settings.

    Raises:
        KeyError: a quantity without a row, or a limit's setting is missing.
    """
    rows = LIMITS[route]
    if unknown := measured.keys() - {limit.quantity for limit in rows}:
        raise KeyError(f"no limit of the route {route!r}: {', '.join(sorted(unknown))}")
    found = []
    for limit in rows:
        if limit.quantity in measured:
            level = limit.level(measured[limit.quantity], dbh_cm, settings)
            if level is not None:
                found.append((limit, level))
    return Findings(tuple(found))


def bound_of(route: Route, quantity: str, level: Level) -> float:
    """A limit that is a plain number, for code that needs the number itself.

    Raises:
        KeyError: there is no such limit. ValueError: it is a share of the diameter or a setting.
    """
    for limit in LIMITS[route]:
        bound = limit.check if level == "check" else limit.reject
        if limit.quantity == quantity and bound is not None:
            if bound.value is None or bound.share is not None:
                raise ValueError(f"{route}, {quantity}: the limit is no plain number")
            return bound.value
    raise KeyError(f"{route}, {quantity}: no limit for {level}")


_OF_A_SETTING = "setting"
_RENDERED = "rendered plots a and e, 24 to 48 oblique photos (docs/evidence/photos.md)"
_HARDER = "hard simulated plots, seeds 421 to 426 (docs/evidence/photos.md)"
_LEAVES = (
    "58 plots: of 35 stems below 40 that nothing else flagged one was 2.5 cm off, others 1.5 at most; in a world whose "
    "leaves have colours of photographs the network alone saw a stem where none is, at 27"
)
_OUTLINES = "46 simulated and rendered plots: of 18 fits below ten are right; of eight others seven are refused anyway"
_IVY = (
    "45 simulated and rendered plots: of 20 stems that ivy makes thicker one 0.13, the others 0.32 and more; of 582 "
    "others 561 below 0.12, right ones all below 0.24"
)
_IVIED = "simulated stems under ivy, drone LiDAR, seeds 501 to 503 (docs/evidence/point-clouds.md)"
_LEANING = "simulated leaning stems (docs/results/photos_leans.json)"
_CLOUDS = "rendered and simulated drone LiDAR, terrestrial clouds (docs/evidence/point-clouds.md)"
_TOUCHING = "two stems of drone LiDAR that a sapling touches: 2.7, 2.8; 500 others: at most 1.9, simulated and rendered"
_POLES = "poles among trees: 0.32; 500 stems of drone LiDAR, simulated and rendered: 0.62 and more"
_COATED = (
    "chosen: of two clean stems it costs at most 2 %, of more less; 480 real, rendered, simulated ones: 0.15 and more"
)
_FURROWED = "simulated furrows of bark, 2 cm deep: 2.6 to 3.1; two dates 4 cm apart: 3.9 and more"
_ONE_SIDED = (
    "leaves, or a sapling, on one side: 9.5 to 13; 500 other stems of drone LiDAR, simulated and rendered: at most 4.6"
)
_SPARSE = "simulated drone LiDAR of 250 to 1,400 points/m² (docs/evidence/point-clouds.md)"
_TWICE = "simulated scans shifted and of two dates; real terrestrial clouds (docs/evidence/point-clouds.md)"
_BOWED = "bowed stems of the stability suite (docs/results/bowed_stems.json)"
_GROUND = "clouds cut above their ground (docs/results/ground_cut.json)"
_THROUGH = "stems and a place without one, rendered and simulated plots (docs/evidence/photos.md)"
_TWINS = "34 stems of plot_a and a simulated plot: at most 11; two touching pairs taken for one: 62, 113"
_TWINS_SHARE = (
    "189 certain stems of 19 plots: three of four above 0.25 are off by more than stated; two are touched; furrowed "
    "bark gives 9 of 26 right stems more"
)
_ARC = (
    "level photos of a simulated plot: a false stem of 86 cm 36; 11 stems of 58 plots flown over below 40: ten right, "
    "one 2 cm too thin"
)
_LEVEL = (
    "level photos: 13 stems of two simulated plots 0.36 and more on the bark, lead 0.23 and more; real columns, posts "
    "and a tree 0.16 and 0.09; a strip of real wall 0.14 and -0.17; of 15 things in line in real photos 13 at most "
    "0.03, two 0.06 and 0.08"
)
_CONFIRMED = (
    "ten blocks of six plots and a real flight: 79 % and more; one dense stand in wind 68 %, a wrong block 26 %"
)
_BLOCK = "litter, grass and shrubs look like ground in photos, and a block stands some decimetres off its DTM"
_SHORT = "rendered plots a, e and h, drone LiDAR, 127 trees (docs/evidence/point-clouds.md)"
_STANDS = "stands have medians of 40 to 110, dense ones 150; no stand is that tall (docs/evidence/point-clouds.md)"


#: As rows give their bounds: a number, the name of a setting, a :class:`Bound`, or none.
_Given = Bound | float | str | None


def _bound(value: _Given) -> Bound | None:
    if value is None or isinstance(value, Bound):
        return value
    return Bound(setting=value) if isinstance(value, str) else Bound(float(value))


def _limit(
    side: Literal["above", "below"],
    reason: str,
    quantity: str,
    measured: str,
    source: str,
    check: _Given,
    reject: _Given = None,
    unit: str = "",
) -> Limit:
    return Limit(reason, quantity, measured, unit, side, _bound(check), _bound(reject), source)


_above, _below = partial(_limit, "above"), partial(_limit, "below")
#: The share at which :mod:`.pointcloud.sanity` warns is flagged too.
_JUST_BELOW_TALL = math.nextafter(TALL_SHARE, 0.0)
_TOO_LARGE = _above("too_large", "dbh_cm", "diameter", _OF_A_SETTING, None, "max_dbh_cm", unit="cm")

#: route -> its limits, in the order in which their reasons are listed in ``qc_reason``.
LIMITS: dict[Route, tuple[Limit, ...]] = {
    "photos": (
        _below("too_small", "dbh_cm", "diameter", _RENDERED, 10, "min_dbh_cm", unit="cm"),
        _TOO_LARGE,
        _below("few_views", "arc_deg", "directions of the clear photos", _ARC, 60, unit="°"),
        _below("few_views", "arc_alone", "the same, no silhouette to be had", _ARC, None, 40, unit="°"),
        _below(
            "few_views",
            "llr_alone",
            "edge score, neither silhouette nor bark to be had (chance: 45 to 50)",
            _RENDERED,
            60,
            52,
        ),
        _below("few_views", "llr", "edge score, whatever the silhouette says", _LEAVES, 40),
        _below("few_views", "contrast", "silhouette over what chance reaches", _OUTLINES, 1.0),
        _above("covered", "covered", "ivy in what the network sees of the stem, share", _IVY, 0.12, 0.3),
        _above("carried_down", "carried_m", "measured above breast height by", _HARDER, 0.5, unit="m"),
        _above(
            "see_through",
            "through",
            "photos that show the ground through the stem, share of these and the clear ones",
            _THROUGH,
            0.25,
            0.4,
        ),
        _below("see_through", "on_bark", "likeness of neighbouring photos on the bark", _LEVEL, 0.1, 0.05),
        _below(
            "see_through",
            "bark_lead",
            "the same, lead over the plane through the edges, at most (two standard errors)",
            _LEVEL,
            0.05,
            -0.1,
        ),
        _above("merged", "twins", "gain of two stems inside one (log likelihood)", _TWINS, 15, 30),
        _above(
            "merged",
            "twins_share",
            "the same by edges alone, over the score of one, in what is too thick for the stand",
            _TWINS_SHARE,
            0.25,
        ),
        _above("lean", "lean_deg", "lean", _LEANING, None, 27, unit="°"),
        _above("wide_error", "se_cm", "standard error", _RENDERED, Bound(share=0.06), Bound(share=0.25), unit="cm"),
        _above("no_ground", "ground_se_m", "standard error of the ground's height", _BLOCK, 0.5, 5, unit="m"),
        _below(
            "weak_block", "confirmed", "placed photos that others' points confirm, share", _CONFIRMED, CONFIRMED_SHARE
        ),
    ),
    "points": (
        _below("too_small", "dbh_cm", "diameter", _OF_A_SETTING, None, "min_dbh_cm", unit="cm"),
        _above("not_round", "stray", "share of the points outside the bark", _CLOUDS, 0.25, 0.5),
        _below("short_arc", "clear_arc_deg", "well covered arc, with stray points", _SPARSE, None, 240, unit="°"),
        _below("short_arc", "arc_deg", "arc covered by bark", _CLOUDS, 180, 90, unit="°"),
        _above("not_round", "deep", "share of the points inside the bark", _CLOUDS, 0.12, 0.25),
        _above("not_round", "lobes", "waves of the section over its radius", _CLOUDS, 0.1, 0.15),
        _above("lean", "lean_deg", "lean", _CLOUDS, 15, "max_lean_deg", unit="°"),
        _above("lean", "bowed_lean_deg", "lean of a bowed stem at breast height", _BOWED, 15, unit="°"),
        _below("few_slices", "n_slices", "slices with a circle", _CLOUDS, 5),
        _above("no_taper", "taper_cm_m", "change of the diameter with height", _CLOUDS, 2, unit="cm/m"),
        _below("no_taper", "taper_cm_m", "change of the diameter with height", _CLOUDS, -6, unit="cm/m"),
        _above("no_taper", "narrows_cm_m", "narrowing of the fitted cone", _TOUCHING, Bound(2.2, 0.07), unit="cm/m"),
        _below(
            "no_taper",
            "narrows_at_most_cm_m",
            "narrowing of the stem, at most (two standard errors)",
            _POLES,
            0.5,
            unit="cm/m",
        ),
        _above("disagree", "slices_off_se", "slices against cone, in standard errors", _CLOUDS, 4),
        _above("disagree", "bowed_share", "straightened against short cone, share of the DBH", _BOWED, None, 0.2),
        _above(
            "covered",
            "ring_ratio",
            "thickness of the ring of points, over that of the plot's other stems",
            _IVIED,
            1.45,
            1.8,
        ),
        _above("covered", "coat_cm", "what covers the bark that shows, thick", _IVIED, 0, 12, unit="cm"),
        _below(
            "covered",
            "false_share",
            "share of false alarms, if all stems of the plot with as much bark inside their ring were flagged",
            _COATED,
            0.03,
        ),
        _above("covered", "uneven", "thickness of the ring by direction, departures over their errors", _ONE_SIDED, 7),
        _below("covered", "kurtosis", "kurtosis of the distances from the bark", _TWICE, -0.65),
        _above("double", "twice_cm", "two sharp rings, diameters apart by", _FURROWED, 1, 3.5, unit="cm"),
        _above("double", "dates_cm", "diameters that scans or flight lines show, apart by", _TWICE, 1, 2.5, unit="cm"),
        _below("occluded", "purity", "bark among the points on the stem, share", _CLOUDS, 0.6, 0.35),
        _below("occluded", "solid_purity", "the same, stem filled with points", _CLOUDS, 0.6),
        _below("few_points", "n_points", "points on the bark", _SPARSE, None, "least_points"),
        _below("few_points", "n_at_bh", "points within 0.5 m of breast height", _SPARSE, "least_at_bh"),
        _TOO_LARGE,
        _above("wide_error", "se_cm", "standard error", _CLOUDS, Bound(1, 0.06), Bound(2, 0.1), unit="cm"),
        _below("not_round", "on_cylinder", "share of the points on the cylinder", _CLOUDS, 0.2),
        _above("occluded", "clutter", "points just outside bark with gaps, share", _CLOUDS, 0.25),
        _below("occluded", "n_above", "parts of a thick stem above the band", _CLOUDS, 2),
        _below("edge", "rim_m", "bark to the edge of the data", "two centimetres of bark", 0.02, unit="m"),
        _below("merged", "gap_m", "bark to the next stem's bark", _CLOUDS, 0.05, unit="m"),
        _above("no_ground", "ground_se_m", "standard error of the ground's height", _GROUND, 0.3, 5, unit="m"),
    ),
    "survey": (
        _below(
            "too_short", "height_share", "height over the survey's own at that DBH, 4 spreads below it", _SHORT, 0.75
        ),
        _above(
            "odd_heights", "slenderness", "height over diameter (15 cm at least), median of the trees", _STANDS, 150
        ),
        _above(
            "odd_heights",
            "tall_share",
            f"share of the points more than {TALL_M:g} m above the ground",
            _STANDS,
            _JUST_BELOW_TALL,
        ),
    ),
}


class Predictor(NamedTuple):
    """What may speak against a diameter from photos without deciding anything by itself.

    reason: key of :data:`.reasons.REASONS`. measured: in words, 0 where nothing speaks against the stem. weight: what a
    unit of it adds to the log odds that the diameter is not the stem's.
    """

    reason: str
    measured: str
    weight: float


#: Log odds that a diameter is not the stem's (more than 8 % and 2 cm off, or no stem there) where nothing speaks
#: against it.
INTERCEPT = -6.3
#: Name -> predictor. Weights and ``INTERCEPT`` are a logistic regression (no weight negative) over 826 fits of blind
#: plots and of the stability suite; ``docs/results/wrong_diameters.json`` adds later plots to them. Silhouette,
#: directions, coarse fit, taper and the ground seen made it hardly better on plots left out, or worse.
PREDICTORS = {
    "photos": Predictor("few_views", "effective photos (Kish): natural logarithm of 12 over them", 2.4),
    "residual": Predictor("occluded", "edge residual above 0.49 px, over 0.05 px", 2.8),
    "outline": Predictor("disagree", "edges against silhouette, over 10 % of the diameter (at most 3)", 0.5),
    "section": Predictor("not_round", "section off a circle, over 5 % of its radius", 1.1),
    "explanations": Predictor(
        "ambiguous", "probability of the explanation that was taken (selection.py): minus its natural logarithm", 1.5
    ),
    "edges": Predictor(
        "few_views", "natural logarithm of 6 over the edge score of an effective photo (at most 4)", 0.6
    ),
    "stand": Predictor(
        "merged", "standard deviations beyond two by which it is thicker than the stand's stems (at most 2.7)", 1.7
    ),
}
#: Probability of that from which on a stem is flagged, and refused.
WRONG_CHECK, WRONG_REJECT = 0.02, 0.3
