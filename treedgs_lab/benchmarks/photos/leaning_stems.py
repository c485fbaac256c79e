"""Where do errors of leaning stems come from: the shape that is fitted, edges in the photos, or the tape's place?

    python -m treedgs_lab.benchmarks.photos.leaning_stems PLOT … --output FILE.json

``geometry``: tapered, bent stems at 0 to 25 degrees, drawn at random before the first plot's cameras. Their silhouettes
are exact (rays that graze the stem); the fit's own linear model is fitted to these, alone and with the noise of edges
and poses that it assumes, in 5 to 12 photos of a stem. Error at breast height, and over what is stated.

``photos``: the plots' own stems that lean by more than :data:`LEANING_DEG`. Each is refined in the photos from its true
axis, with the photos that truly show it (``from_truth``): what is wrong then is edges. Beside it the chain's own result
(``found``) and what the height of its breast height against the true one makes of it by taper (``tape``).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from treedgs_geo.core.progress import Reporter
from treedgs_geo.stems.photos.evidence.error_budget import LEAN_ERROR, standard_error_cm
from treedgs_geo.stems.photos.fit.breast_height import breast_height
from treedgs_geo.stems.photos.fit.edge_adjustment import NO_STEMS, Sighting, _damping, _solve, refine
from treedgs_geo.stems.photos.fit.edge_points import EDGE_SD_PX, gathered
from treedgs_geo.stems.photos.fit.null_model import BREAST
from treedgs_geo.stems.photos.images.axis_patches import StemAxis, StripLayout, cut_strips
from treedgs_geo.stems.photos.images.crops import GroundGrid, PhotoStack
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import photos_of, stems_from_photos
from treedgs_geo.stems.photos.stem_fit import WINDOWS_PX
from treedgs_geo.stems.quality.priors import BREAST_HEIGHT_M, SECTION_SD, START_TAPER
from treedgs_lab.benchmarking.plot import TruePlot
from treedgs_lab.benchmarks.photos.stems_from_photos import pair_up
from treedgs_lab.benchmarks.records import write_record
from treedgs_lab.benchmarks.rendered import local_places, plot_inputs, truth_rows
from treedgs_lab.simulate.scene import PlantedStem, axis_at, grow_stem, total_height
from treedgs_lab.simulate.terrain import Ground

LEANS_DEG = (0.0, 10.0, 18.0, 25.0)
#: Stems drawn for each lean, and photos of one.
STEMS, FEWEST, MOST = 60, 5, 12
#: A plot's stem that leans more than this is looked at.
LEANING_DEG = 13.0
#: Rays are moved sideways until they graze the stem: halvings of this reach, metres.
REACH_M, HALVINGS = 0.25, 16
FLAT = Ground(-200.0, 400.0, np.zeros((2, 2)))


class Drawn(NamedTuple):
    """A stem: its axis points (N, 3) and radii (N,), m, and its truth."""

    points: np.ndarray
    radii: np.ndarray
    stem: PlantedStem

    @property
    def axis(self) -> StemAxis:
        """Straight axis through breast height (along the stem) over flat ground."""
        point, tangent, _ = (part[0] for part in axis_at(self.stem, np.array([BREAST_HEIGHT_M])))
        return StemAxis(point[:2], tangent[:2] / tangent[2], np.zeros(2), point[2] - BREAST_HEIGHT_M, BREAST_HEIGHT_M)


def drawn_stem(rng: np.random.Generator, lean_deg: float) -> Drawn:
    """A stem of the simulator's on flat ground, within 8 m of the plot's centre."""
    dbh = float(rng.uniform(0.15, 0.40))
    xy, turn = rng.uniform(-5.5, 5.5, 2), float(rng.uniform(0, 2 * np.pi))
    named: dict[str, Any] = {
        "tree_id": "T",
        "kind": "lean",
        "status": "live",
        "in_plot": True,
        "crown_base_m": 9.0,
        "detail": 0,
    }
    tall = float(total_height(np.array(dbh)))
    stem = grow_stem(rng, FLAT, xy, dbh, tall, np.radians(lean_deg), turn, **named)
    along = np.arange(0.0, 5.0, 0.01)
    points, _, radii = axis_at(stem, along)
    return Drawn(points, radii, stem)


def exact_edges(stem: Drawn, axis: StemAxis, q: np.ndarray, normal: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """(V, B, 2) metres from ``axis`` at which rays from each photo's centre graze the stem left and right.

    q: (B,) heights above breast height; normal: (V, 2) direction across each view; centre: (V, 3)."""
    base = axis.at(q + axis.bh_m)
    out = np.empty((len(normal), len(q), 2))
    across = np.column_stack([normal, np.zeros(len(normal))])
    for v, (side, eye) in enumerate(zip(across, centre, strict=True)):
        for s, sign in enumerate((-1.0, 1.0)):
            near, far = np.zeros(len(q)), np.full(len(q), REACH_M + stem.radii.max())
            for _ in range(HALVINGS):
                middle = 0.5 * (near + far)
                ray = base + sign * middle[:, None] * side - eye
                ray /= np.linalg.norm(ray, axis=1, keepdims=True)
                to = stem.points - eye
                off = np.sqrt(np.maximum((to * to).sum(axis=1) - (ray @ to.T) ** 2, 0.0))
                hits = (off - stem.radii).min(axis=1) < 0
                near, far = np.where(hits, middle, near), np.where(hits, far, middle)
            out[v, :, s] = sign * 0.5 * (near + far)
    return out


def fit_exact(stem: Drawn, stack: PhotoStack, seen: np.ndarray, rng: np.random.Generator | None, sd_px: float) -> tuple:
    """The fit of a drawn stem's exact edges in the photos ``seen`` (indices), rng: of noise, None without; and its
    standard error, cm, without what lean and section add."""
    axis, r0, r1 = stem.axis, float(stem.radii[137]), START_TAPER
    layout = StripLayout(*BREAST.fine, 0.10, 0.025, r0 + 0.14, 0.005, sigma_px=0.8, linear=True)
    strips = cut_strips(stack, axis, layout, wanted=np.zeros(len(stack), bool))
    shape = (len(seen), len(strips.q), 2)
    noise = np.zeros(shape)
    if rng is not None:
        px = strips.px_m[seen][:, None, None]
        noise = px * (rng.normal(0, sd_px, (len(seen), 1, 1)) + rng.normal(0, EDGE_SD_PX, shape))
    for window in WINDOWS_PX:
        strips = cut_strips(stack, axis, layout, wanted=np.zeros(len(stack), bool))
        kept = strips._replace(
            coherence=strips.coherence[seen],
            gradient=strips.gradient[seen],
            normal=strips.normal[seen],
            px_m=strips.px_m[seen],
            widen=strips.widen[seen],
        )
        place = (exact_edges(stem, axis, strips.q, kept.normal, stack.centre[seen]) + noise)[..., None]
        edges = gathered(kept, place, np.full(place.shape, 0.9), np.ones(len(seen)), window)
        solved = _solve(kept, edges, r0, r1, _damping(kept, axis, sd_px, r0, True), axis) if edges is not None else None
        if solved is None:
            raise RuntimeError("A drawn stem has too few edges.")
        fit = solved[1]
        axis, r0, r1 = fit.axis, fit.r0, fit.r1
    se = standard_error_cm(fit, fit.view_weight, 100 * float(np.median(strips.px_m[seen])), len(seen))
    return fit, se


def rms(values: list[float]) -> float:
    """Root mean square."""
    return round(float(np.sqrt(np.mean(np.square(values)))), 3)


def geometry(stack: PhotoStack, sd_px: float, seed: int) -> dict[str, Any]:
    """Errors of fits to exact silhouettes, by lean."""
    flat = GroundGrid(-60.0, -60.0, 60.0, np.zeros((3, 3), np.float32))
    out = {}
    for lean in LEANS_DEG:
        exact: list[float] = []
        noisy: list[float] = []
        over: list[float] = []
        full: list[float] = []
        for k in range(STEMS):
            rng = np.random.default_rng([seed, int(lean), k])
            stem = drawn_stem(rng, lean)
            seen = np.sort(rng.permutation(len(stack))[: rng.integers(FEWEST, MOST + 1)])
            true_cm = 200 * float(axis_at(stem.stem, np.array([BREAST_HEIGHT_M]))[2][0])
            for noise, into in ((None, exact), (rng, noisy)):
                fit, se = fit_exact(stem, stack, seen, noise, sd_px)
                dq, _ = breast_height(fit.axis, fit.r0, flat)
                into.append(200 * (fit.r0 + fit.r1 * dq) - true_cm)
            parts = LEAN_ERROR * true_cm * np.hypot(*fit.axis.s), SECTION_SD * true_cm
            over.append(noisy[-1] / se)
            full.append(noisy[-1] / float(np.linalg.norm([se, *parts])))
        out[f"{lean:g}"] = {
            "stems": STEMS,
            "exact_bias_cm": round(float(np.mean(exact)), 3),
            "exact_rms_cm": rms(exact),
            "noisy_bias_cm": round(float(np.mean(noisy)), 3),
            "noisy_rms_cm": rms(noisy),
            "over_stated_rms": rms(over),
            "over_stated_with_lean_rms": rms(full),
        }
        print(lean, out[f"{lean:g}"], flush=True)
    return out


def true_axis(plot: TruePlot, tree: dict[str, str]) -> StemAxis:
    """A stem's axis through its true breast height, with its bow over the fitted band."""
    record = json.loads((plot.folder / "truth" / "stems.json").read_text(encoding="utf-8"))
    profile = np.array(record["stems"][tree["tree_id"]])
    points = profile[:, 2:5] + np.array(record["origin"], float) - plot.frame.origin
    breast = np.array([np.interp(BREAST_HEIGHT_M, profile[:, 0], points[:, k]) for k in range(3)])
    band = (profile[:, 0] > 0.4) & (profile[:, 0] < 4.1)
    q = points[band, 2] - breast[2]
    slope = [np.polynomial.polynomial.polyfit(q, points[band, k] - breast[k], [1, 2]) for k in (0, 1)]
    s, c = np.array([part[1] for part in slope]), np.array([part[2] for part in slope])
    return StemAxis(breast[:2], s, c, breast[2] - BREAST_HEIGHT_M, BREAST_HEIGHT_M)


def in_photos(folder: Path, options: PhotoStemOptions) -> list[dict[str, Any]]:
    """The plot's leaning stems: from truth, found, and the share of the tape's place."""
    views, frame, ground, area = plot_inputs(folder)
    plot = TruePlot.load(folder)
    fits = stems_from_photos(views, ground, area, options)
    _, stack = photos_of(views, ground, area, options, Reporter())
    names = [view.name for view in stack.views]
    truth = truth_rows(folder)
    pairs = pair_up(local_places(truth, frame), fits)
    clear = plot.visibility[plot.visibility["clear"]]
    rows = []
    for number, tree in enumerate(truth):
        if float(tree["lean_bh_deg"]) < LEANING_DEG:
            continue
        axis, dbh = true_axis(plot, tree), float(tree["dbh_cm"])
        shown = set(clear.loc[clear["tree_id"] == tree["tree_id"], "image"])
        seen = np.array([1.0 if name in shown else 0.0 for name in names])
        where = Sighting(seen, NO_STEMS)
        right = refine(
            stack, axis, dbh / 200, START_TAPER, where, BREAST.fine, options.offset_sd_px, WINDOWS_PX, oval=True
        )
        row: dict[str, Any] = {"plot": folder.name, "tree": tree["tree_id"], "dbh_cm": round(dbh, 2)}
        row |= {"lean_deg": round(float(tree["lean_bh_deg"]), 1), "clear": len(shown & set(names))}
        if right is not None:
            # The true axis goes through breast height; the fit may have moved it by some centimetres.
            row |= {
                "from_truth_cm": round(200 * right.r0 - dbh, 2),
                "from_truth_fit_sd_cm": round(200 * right.fit_sd_m, 2),
            }
        if number in pairs:
            fit = fits[pairs[number]]
            off = float(fit.axis.ground_z + fit.axis.bh_m - axis.ground_z - axis.bh_m)
            row |= {"found_cm": round(fit.dbh_cm - dbh, 2), "se_cm": round(fit.se_cm, 2), "flag": fit.flag}
            row |= {"tape_cm": round(200 * fit.r1 * off, 2), "tape_off_m": round(off, 3), "n_views": fit.n_views}
            row |= {"reasons": ",".join(fit.reasons), "oval_pct": round(100 * float(np.hypot(*fit.oval)) / fit.r0, 1)}
        rows.append(row)
        print(row, flush=True)
    return rows


def main() -> int:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plots", type=Path, nargs="+")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--output", type=Path)
    arguments = parser.parse_args()
    options = PhotoStemOptions()
    views, _, ground, area = plot_inputs(arguments.plots[0])
    _, stack = photos_of(views, ground, area, options, Reporter())
    figures: dict[str, Any] = {"geometry": geometry(stack, options.offset_sd_px, arguments.seed)}
    figures["photos"] = [row for plot in arguments.plots for row in in_photos(plot, options)]
    write_record(arguments.output, figures, seeds=[arguments.seed])
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
