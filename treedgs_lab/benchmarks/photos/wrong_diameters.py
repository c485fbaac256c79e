"""How probable is it that a diameter from photos is not the stem's, and how far is it off where it is? What each
predictor and each part of the error weighs, and whether that holds.

    python -m treedgs_lab.benchmarks.photos.wrong_diameters --set DIR [...] --held DIR [...] [--output FILE]

DIR: a folder of plots with their truth, and of their workspaces of ``photos-to-dbh``: NAME and NAME_ws. A workspace
keeps the fits, those that were refused too.
``weights``: a logistic regression over the plots that set them, none negative; its prior are the library's own, which
earlier plots gave, so that ``--set`` takes plots that are not in them yet (copied to
``treedgs_geo.stems.quality.limits.PREDICTORS`` by hand; a test compares). ``set``, ``held``: fits by the probability of
a wrong diameter (``from`` it on), how many are wrong and how many should be, false ones (nothing stands there) and the
RMSE of the others; of the plots that set the weights each by those of all others. A diameter is wrong that is off by
more than 8 % and 2 cm, or where nothing stands.
``error_weights``: of the parts of the error, by maximum likelihood; the prior are again the library's own
(:data:`treedgs_geo.stems.photos.tuned.ERROR_WEIGHTS`), each known to a factor of two.
``strata``: how many of the right diameters that these weights give out lie within 0.67 standard errors (half should)
and in the 90 % interval, by kind of stem.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import minimize
from scipy.spatial.distance import cdist
from scipy.special import expit

from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.intervals import HALF_WIDTH_SE
from treedgs_geo.inventory.accuracy.scores import MATCH_M, pair_by_position
from treedgs_geo.stems.photos.fit_records import read_fits
from treedgs_geo.stems.photos.quality_control import ErrorParts
from treedgs_geo.stems.photos.tuned import ERROR_WEIGHTS, MIN_SPLIT_M, WRONG_SD
from treedgs_geo.stems.quality.limits import INTERCEPT, PREDICTORS
from treedgs_lab.benchmarks.plot import TruePlot
from treedgs_lab.benchmarks.records import write_record

#: A diameter is wrong that is off by more than both.
WRONG_SHARE, WRONG_CM = 0.08, 2.0
#: Inverse variance of the prior of the intercept and of each weight: about what the 800 fits say that set it.
PRIOR = 10.0
#: Intercept and weights of the library, log odds.
OWN = np.array([INTERCEPT, *(predictor.weight for predictor in PREDICTORS.values())])
#: Standard deviation of the logarithm of each weight of an error before these fits.
FACTOR = np.log(2.0)
#: Strata: a lean above, clear photos below.
LEANING_DEG, FEW_VIEWS = 6.0, 8
#: Columns of the parts of the error.
PARTS = [f"error_{name}" for name in ErrorParts._fields]
BINS = (0.0, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)


def fits_of(workspace: Path) -> pd.DataFrame:
    """One row a fit that is not too thin: its predictors, ``error_cm`` (NaN where nothing stands), ``wrong``."""
    plot = workspace.with_name(workspace.name.removesuffix("_ws"))
    truth, fits = TruePlot.load(plot), read_fits(workspace / "fits.json").fits
    fits = [fit for fit in fits if np.isfinite(fit.evidence.se_cm) and fit.r0 >= MIN_SPLIT_M]
    frame = LocalFrame.load(workspace / "sfm" / "frame.json")
    found = frame.to_project(np.array([[*fit.axis.p, 0.0] for fit in fits]))[:, :2] - truth.frame.origin[:2]
    places, true_cm = truth.trees[["x_bh", "y_bh"]].to_numpy(float), np.full(len(fits), np.nan)
    free = np.arange(len(places))
    for group in (np.array([k for k, fit in enumerate(fits) if fit.measured == flag], int) for flag in (True, False)):
        pairs = [(int(i), int(j)) for i, j in pair_by_position(places[free], found[group], MATCH_M)]
        for i, j in pairs:
            true_cm[group[j]] = truth.trees["dbh_cm"].iloc[free[i]]
        free = np.delete(free, [i for i, _ in pairs])
    rows = pd.DataFrame([fit.evidence.predictors() for fit in fits])
    rows["plot"], rows["error_cm"] = plot.name, [fit.dbh_cm for fit in fits] - true_cm
    parts = pd.DataFrame([fit.evidence.error or ErrorParts() for fit in fits], columns=PARTS)
    rows = pd.concat([rows, parts], axis=1).assign(fit=fits)
    off = np.abs(rows["error_cm"])
    rows["wrong"] = ~((off <= WRONG_CM) | (off <= WRONG_SHARE * true_cm))
    # A second look at a stem that is paired already says nothing.
    return rows[~np.isnan(true_cm) | (cdist(found, truth.anything).min(axis=1) > MATCH_M)].reset_index(drop=True)


def error_weights(fits: pd.DataFrame) -> dict[str, float]:
    """Weights of the parts of the error under which the errors of the stems that were fitted are most probable: normal,
    or with the probability of a wrong diameter those of one."""
    stems = fits[fits["error_cm"].notna()]
    parts, squared = stems[PARTS].to_numpy() ** 2, stems["error_cm"].to_numpy() ** 2
    wrong, own = probabilities(stems, OWN), np.log(list(ERROR_WEIGHTS.values()))
    far = (WRONG_SD * stems["error_section"].to_numpy()) ** 2

    def loss(log_weights: np.ndarray) -> float:
        right, (near, off) = parts @ np.exp(2 * log_weights), (1 - wrong, wrong)
        density = sum(p * np.exp(-0.5 * squared / v) / np.sqrt(v) for p, v in ((near, right), (off, far)))
        return float(0.5 * (((log_weights - own) / FACTOR) ** 2).sum() - np.log(density).sum())

    return dict(zip(ERROR_WEIGHTS, [float(f"{w:.2g}") for w in np.exp(minimize(loss, own).x)], strict=True))


def stated(fits: pd.DataFrame, weights: dict[str, float]) -> pd.DataFrame:
    """What is given out of fits where their errors have these weights: flag, standard error, ``inside`` (the interval
    holds the truth), and the stratum, the first that a stem is of."""
    rows = []
    for fit, error_cm in zip(fits["fit"], fits["error_cm"], strict=True):
        evidence = fit.evidence
        weighted = {name: part * weights[name] / ERROR_WEIGHTS[name] for name, part in evidence.error._asdict().items()}
        found = fit.knowing(error=ErrorParts(**weighted)).assessment
        half = HALF_WIDTH_SE * found.se_cm
        low, high = (found.lo_cm, found.hi_cm) if np.isfinite(found.lo_cm) else (fit.dbh_cm - half, fit.dbh_cm + half)
        kinds = {
            "carried down": fit.carried, "leaning": evidence.lean_deg > LEANING_DEG,
            "few photos": evidence.n_views < FEW_VIEWS, "clean": True,
        }  # fmt: skip
        stratum = next(name for name, is_of in kinds.items() if is_of)
        inside = low <= fit.dbh_cm - error_cm <= high
        rows.append({"stratum": stratum, "flag": found.flag, "se_cm": found.se_cm, "inside": inside})
    return pd.concat([fits, pd.DataFrame(rows, index=fits.index)], axis=1)


def strata(fits: pd.DataFrame) -> list[dict[str, Any]]:
    """One row a stratum and flag, of the right diameters that are given out. fits: of :func:`stated`."""
    given = fits[~fits["wrong"] & (fits["flag"] != "reject")]
    rows = []
    for (stratum, flag), here in [*given.groupby(["stratum", "flag"]), (("all", ""), given)]:
        error, se_cm = here["error_cm"], here["se_cm"]
        rows.append(
            {
                "stratum": stratum,
                "flag": flag,
                "stems": len(here),
                "rmse_cm": round(float(np.sqrt((error**2).mean())), 2),
                "bias_cm": round(float(error.mean()), 2),
                "median_se_cm": round(float(se_cm.median()), 2),
                "within_067_se": round(float((np.abs(error) < 0.6745 * se_cm).mean()), 3),
                "inside_90": round(float(here["inside"].mean()), 3),
            }
        )
    return rows


def regression(fits: pd.DataFrame, prior: np.ndarray = OWN) -> np.ndarray:
    """(1 + predictors,) intercept and weights, log odds. prior: the same before these fits."""
    amount, wrong = fits[list(PREDICTORS)].to_numpy(), fits["wrong"].to_numpy(float)

    def loss(b: np.ndarray) -> tuple[float, np.ndarray]:
        odds = b[0] + amount @ b[1:]
        off = expit(odds) - wrong
        value = np.logaddexp(0, odds).sum() - wrong @ odds + 0.5 * PRIOR * ((b - prior) ** 2).sum()
        return value, np.r_[off.sum(), amount.T @ off] + PRIOR * (b - prior)

    bounds = [(None, None), *[(0.0, None)] * len(PREDICTORS)]
    return minimize(loss, prior, jac=True, bounds=bounds).x


def probabilities(fits: pd.DataFrame, weights: np.ndarray) -> np.ndarray:
    """(N,) of a wrong diameter."""
    return expit(weights[0] + fits[list(PREDICTORS)].to_numpy() @ weights[1:])


def calibration(fits: pd.DataFrame, wrong: np.ndarray) -> list[dict]:
    """One row a bin of the probabilities ``wrong`` (N,)."""
    rows = []
    for low, high in zip(BINS, (*BINS[1:], 1.0), strict=True):
        here = fits[(wrong >= low) & (wrong < high)]
        right = here["error_cm"][~here["wrong"]]
        rows.append(
            {
                "from": low,
                "fits": len(here),
                "wrong": int(here["wrong"].sum()),
                "expected": round(float(wrong[here.index].sum()), 1),
                "false": int(here["error_cm"].isna().sum()),
                "rmse_of_right_cm": round(float(np.sqrt((right**2).mean())), 2) if len(right) else None,
            }
        )
    return rows


def main() -> int:
    """Set the weights, and see whether they hold."""
    parser = argparse.ArgumentParser(description="weights of the predictors of a wrong diameter from photos")
    for name in ("set", "held"):
        parser.add_argument(f"--{name}", nargs="+", type=Path, required=True, metavar="DIR")
    parser.add_argument("--output", type=Path)
    args = parser.parse_args()
    setting, held = (
        pd.concat([fits_of(ws) for folder in folders for ws in sorted(folder.glob("*_ws"))], ignore_index=True)
        for folders in (args.set, args.held)
    )
    left_out = np.zeros(len(setting))
    for plot, own in setting.groupby("plot"):
        left_out[own.index] = probabilities(own, regression(setting[setting["plot"] != plot]))
    weights, of_errors = np.round(regression(setting), 1), error_weights(setting)
    record = {
        "plots": {"set": setting["plot"].nunique(), "held": held["plot"].nunique()},
        "intercept": float(weights[0]),
        "weights": dict(zip(PREDICTORS, weights[1:].tolist(), strict=True)),
        "error_weights": of_errors,
        "set": calibration(setting, left_out),
        "held": calibration(held, probabilities(held, OWN)),
        "strata": {name: strata(stated(fits, of_errors)) for name, fits in (("set", setting), ("held", held))},
    }
    write_record(args.output, record)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
