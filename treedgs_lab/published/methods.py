"""The paper's comparison in one run: LiDAR and splat points, each by cylinder, unweighted and weighted circle.

One segmentation a source, one held-out split for all, the exponent p of eq:weighted_score chosen on the held-out stems
alone, figures on the others: over what each method measured, and over the stems that all of them measured.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from treedgs_geo.core.errors import InputError
from treedgs_geo.inventory.accuracy.scores import MATCH_M, pair_by_position, score
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.stems.cloud.estimate.cloud import point_weights
from treedgs_geo.stems.cloud.estimate.frames import TreeFrame
from treedgs_geo.stems.cloud.estimate.published import PublishedOptions, measure_published
from treedgs_geo.stems.geometry.circles import SolidCircle
from treedgs_geo.stems.geometry.cylinder import fit_cylinder
from treedgs_geo.stems.quality.priors import BREAST_HEIGHT_M
from treedgs_geo.terrain.dtm import Dtm

from .reference import Reference

#: Exponents tried on the held-out stems.
POWERS = (0.2, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)
#: Share of the stems that is held out, and the seed of that choice and of all fits.
SHARE, SEED = 0.1, 0
#: A stem without a diameter counts as one that is so wrong when p is chosen, cm.
FAILED_CM = 10.0
#: Reliability of each source's points.
WEIGHTS = {"lidar": "intensity", "splats": "opacity"}
FITS = ("cylinder", "circle", "weighted circle")
#: "All" row of the paper's table (context: other plots, 189 stems): RMSE, ME, cm.
PAPER_ALL = {
    ("lidar", "cylinder"): (7.66, 1.50),
    ("lidar", "circle"): (16.61, 14.67),
    ("lidar", "weighted circle"): (10.29, 1.02),
    ("splats", "cylinder"): (13.29, -6.46),
    ("splats", "circle"): (9.61, 5.79),
    ("splats", "weighted circle"): (4.79, -0.38),
}
#: Values of the paper's ablation: setting -> (name there, values, the default).
ABLATION = {
    "thickness_m": ("slice H, m", (0.2, 0.5, 1.0, 1.5, 2.0), 1.0),
    "least_points": ("n_min", (3, 5, 10, 20), 5),
    "threshold_cm": ("epsilon, cm", (1.0, 2.0, 3.0, 5.0), 2.0),
    "steepest_cm_m": ("kappa, cm/m", (0.1, 0.2, 0.3, 0.5, 1e6), 0.3),
    "weights": ("w_k", ("weighted", "uniform"), "weighted"),
}
SAME_STEM_TOP_M = 8.0


#: Segmented points of one source, stem by stem in the order of the reference: (N, 3) local x, y and height above the
#: ground at the stem's foot (:class:`.frames.TreeFrame`), m, and (N,) reliability, ones where there is none; ``None``:
#: not found.
StemPoints = list[tuple[np.ndarray, np.ndarray] | None]


def stem_points(cloud: PointCloud, tree_id: np.ndarray, dtm: Dtm, reference: Reference, weights: str) -> StemPoints:
    """Give each reference stem its segmented points, by position alone.

    Raises:
        InputError: the attribute named by ``weights`` is missing.
    """
    reliability = point_weights(cloud, weights)
    height = cloud.xyz[:, 2] - dtm.height(cloud.xyz[:, 0], cloud.xyz[:, 1])
    ids = [int(i) for i in np.unique(tree_id) if i > 0]
    groups, places = [], []
    for one in ids:
        own = np.flatnonzero((tree_id == one) & np.isfinite(height) & (height < SAME_STEM_TOP_M))
        near = own[np.abs(height[own] - BREAST_HEIGHT_M) < 1.0]
        if len(near) < 3:
            continue
        groups.append(own)
        places.append(np.median(cloud.xyz[near, :2], axis=0))
    found: StemPoints = [None] * len(reference)
    for i, j in pair_by_position(reference.xy, np.array(places).reshape(-1, 2), MATCH_M):
        own = groups[int(j)]
        weight = np.ones(len(own)) if reliability is None else reliability[own]
        found[int(i)] = TreeFrame.of(cloud, own, dtm).points, weight
    return found


def hold_out(count: int, share: float, seed: int) -> np.ndarray:
    """(count,) bool: the stems on which p is chosen; at least one, never all."""
    wanted = min(max(round(share * count), 1), count - 1)
    chosen = np.zeros(count, bool)
    chosen[np.random.default_rng(seed).permutation(count)[:wanted]] = True
    return chosen


def measure(stems: StemPoints, fit: str, options: PublishedOptions, only: np.ndarray | None = None) -> np.ndarray:
    """(K,) DBH in cm by one published fit, NaN where it failed or the stem was not found."""
    result = np.full(len(stems), np.nan)
    found = {k: own for k, own in enumerate(stems) if own is not None and (only is None or only[k])}
    if fit == "cylinder":
        for k, (points, _) in found.items():
            cylinder = fit_cylinder(points, seed=SEED)
            result[k] = np.nan if cylinder is None else 200 * cylinder.r
        return result
    work = [(points, weight if fit == "weighted circle" else np.ones(len(points))) for points, weight in found.values()]
    for k, measured in zip(found, measure_published(work, BREAST_HEIGHT_M, options, SEED), strict=True):
        if measured.taper is not None:
            result[k] = measured.taper.at_bh_cm
    return result


def figures(read_cm: np.ndarray, true_cm: np.ndarray, counted: np.ndarray) -> dict:
    """``n, of, rmse_cm, rrmse_pct, mae_cm, me_cm`` of diameters (K,), NaN = failed, over the counted stems (K,)."""
    done = counted & np.isfinite(read_cm)
    found = score((read_cm - true_cm)[done], true_cm[done], int(counted.sum()))
    return {
        "n": found.n_measured,
        "of": found.n_reference,
        **{key: getattr(found, key) for key in ("rmse_cm", "rrmse_pct", "mae_cm", "me_cm")},
    }


def with_power(power: float) -> PublishedOptions:
    """The published fit with another exponent."""
    return PublishedOptions(circle=SolidCircle(power=power))


def choose_power(stems: StemPoints, reference: Reference, held: np.ndarray) -> tuple[float, list[dict]]:
    """The exponent of the weighted circle that the held-out stems choose (:func:`best_power`), and the whole sweep."""
    sweep = []
    for power in POWERS:
        read = measure(stems, "weighted circle", with_power(power), held)
        sweep.append(power_row(power, (read - reference.dbh_cm)[held]))
    return best_power(sweep), sweep


def power_row(power: float, error_cm: np.ndarray) -> dict:
    """One exponent on the held-out stems; error_cm: (H,), NaN = no diameter."""
    done = np.isfinite(error_cm)
    return {
        "p": power,
        "measured": int(done.sum()),
        "held_out": len(error_cm),
        "rmse_cm": float(np.sqrt(np.mean(error_cm[done] ** 2))) if done.any() else None,
        "mae_cm": float(np.mean(np.abs(error_cm[done]))) if done.any() else None,
    }


def best_power(sweep: list[dict]) -> float:
    """The exponent with the least RMSE where a failure counts as :data:`FAILED_CM`, the smallest of equal ones.

    Fewest failures alone would choose a circle so large that it never fails and is never right.
    """
    worth = []
    for row in sweep:
        failed = row["held_out"] - row["measured"]
        square = row["measured"] * (row["rmse_cm"] or 0.0) ** 2 + failed * FAILED_CM**2
        worth.append(square / row["held_out"])
    return float(sweep[worth.index(min(worth))]["p"])


def compare_methods(
    sources: dict[str, StemPoints], reference: Reference, share: float = SHARE, seed: int = SEED
) -> dict:
    """Every source by every fit.

    Returns:
        ``split`` (names of the held-out stems, share, seed), ``powers`` (source/fit -> p), ``sweep``, ``rows`` (one a
        method and plot, and ``All``; ``subset``: ``own`` = what it measured, ``common`` = what all measured),
        ``estimates`` (method -> (K,) cm, NaN = failed).

    Raises:
        InputError: fewer than three reference stems.
    """
    if len(reference) < 3:
        raise InputError(f"{len(reference)} reference stems are too few to hold some out; expected three or more.")
    held = hold_out(len(reference), share, seed)
    estimates: dict[tuple[str, str], np.ndarray] = {}
    powers, sweeps = {}, []
    for source, stems in sources.items():
        # As published: one exponent a source, chosen for the weighted fit.
        power, sweep = choose_power(stems, reference, held)
        powers[source] = power
        sweeps += [{"source": source, **row} for row in sweep]
        for fit in FITS:
            estimates[source, fit] = measure(stems, fit, with_power(power))
    common = ~held & np.all([np.isfinite(read) for read in estimates.values()], axis=0)
    rows = []
    for (source, fit), read in estimates.items():
        for plot in ["All", *dict.fromkeys(reference.plot)]:
            here = ~held & ((reference.plot == plot) | (plot == "All"))
            for subset, counted in (("own", here), ("common", here & common)):
                paper = PAPER_ALL.get((source, fit)) if plot == "All" and subset == "own" else None
                rows.append(
                    {
                        "source": source,
                        "fit": fit,
                        "plot": plot,
                        "subset": subset,
                        **figures(read, reference.dbh_cm, counted),
                        "paper_rmse_cm": paper[0] if paper else None,
                        "paper_me_cm": paper[1] if paper else None,
                    }
                )
    names = [f"{p}/{t}" for p, t in zip(reference.plot, reference.tree, strict=True)]
    return {
        "split": {
            "held_out": [name for name, out in zip(names, held, strict=True) if out],
            "share": share,
            "seed": seed,
            "test": int((~held).sum()),
        },
        "powers": powers,
        "sweep": sweeps,
        "rows": rows,
        "estimates": {f"{source}, {fit}": read for (source, fit), read in estimates.items()},
    }


def ablate(stems: StemPoints, reference: Reference, held: np.ndarray, power: float) -> list[dict]:
    """One setting of the published fit at a time, on the stems that were not held out."""
    rows = []
    for name, (label, values, default) in ABLATION.items():
        for value in values:
            options = with_power(power)
            fit = "weighted circle"
            if name == "weights":
                fit = "circle" if value == "uniform" else fit
            elif name in ("thickness_m", "least_points"):
                options = replace(options, **{name: value})  # type: ignore[arg-type]
            else:
                options = replace(options, taper=replace(options.taper, **{name: value}))  # type: ignore[arg-type]
            read = measure(stems, fit, options, ~held)
            shown = "unbounded" if value == 1e6 else value
            row = {"setting": label, "value": shown, "default": value == default}
            rows.append({**row, **figures(read, reference.dbh_cm, ~held)})
    return rows
