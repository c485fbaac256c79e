"""``photos-to-dbh`` on a simulated plot with nothing true, and how true its block is: cameras, lens and scale of
``sfm/`` against ``truth/``."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from treedgs_geo.core import workspace as names
from treedgs_geo.core.crs import LocalFrame
from treedgs_geo.core.files import read_json
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.reconstruction.cameras import OBLIQUE_DEG, View
from treedgs_geo.reconstruction.model import REPORT, load_views
from treedgs_geo.reconstruction.poses import fit_similarity
from treedgs_geo.stems.quality.tree import TREE_FIELDS, Tree

from .plot import TruePlot
from .processes import run_photo_chain

#: A scale is wrong where it is off by more than so many of its stated standard errors and this share besides.
WRONG_SCALE_SD, WRONG_SCALE_SHARE = 2.0, 0.005
#: A photo whose axis is this far off its true one is placed wrong, wherever it stands.
TURNED_DEG = 2.0
#: Width whose length in the block is compared with its true one, m.
_BAR_M = 0.3


@dataclass(frozen=True)
class ChainResult:
    """What the whole chain gave.

    refused: why it refused, empty where it ended. trees: placed where they are in truth (:func:`on_true_ground`): a
    block that lies metres off has measured the same trees. block: what the block states of itself and how true it is:
    ``photos, registered, scale_sd`` (stated), ``warnings``, ``scale_error`` (share) and :func:`camera_errors`; empty
    where nothing was reconstructed.
    """

    refused: str = ""
    trees: list[Tree] = field(default_factory=list)
    block: dict[str, Any] = field(default_factory=dict)


def through_chain(plot: TruePlot) -> ChainResult:
    """Trees and block of a plot through the whole chain.

    Raises:
        ChainCrash: as :func:`.run_photo_chain`.
    """
    with tempfile.TemporaryDirectory(prefix="treedgs-chain-") as scratch:
        workspace = Path(scratch) / "ws"
        sfm = workspace / names.SFM
        refused = run_photo_chain(plot.folder, plot.frame.crs.to_string(), workspace)
        # Photos that cannot show stems are not reconstructed: an empty layer, no block.
        if refused or not (sfm / REPORT).exists():
            return ChainResult(refused)
        table = read_trees(workspace / names.TREES).drop(columns="geometry")
        if len(table):
            up = table["z_ground"].fillna(plot.frame.origin[2]).to_numpy(float)
            table[["x", "y"]] = on_true_ground(plot, sfm, np.column_stack([table[["x", "y"]], up]))[:, :2]
        trees = [
            Tree(**{name: row[name] for name in TREE_FIELDS if name in row and not pd.isna(row[name])})
            for row in table.to_dict("records")
        ]
        report = read_json(sfm / REPORT)
        stated = {name: report[name] for name in ("photos", "registered", "scale_sd", "warnings")}
        block = {**stated, "scale_error": scale_error(plot, sfm), **camera_errors(plot, sfm)}
        return ChainResult("", trees, block)


def camera_errors(plot: TruePlot, sfm: Path) -> dict[str, Any]:
    """Camera centres, focal length (of each flight) and principal point of a block against ``truth/``.

    Returns:
        ``centre_rms_e_n_u_cm, centre_rms_3d_cm, centre_max_cm, common_shift_cm, focal_error_pct`` (a list, by flight),
        ``turned_photos`` (looking more than :data:`TURNED_DEG` elsewhere), ``true_focal_px``,
        ``true_principal_point_px``.
    """
    frame, views = load_views(sfm, plot.folder / "images")
    true = {view.name: view for view in plot.views()}
    errors = _centres(plot, frame, views) - np.array([true[view.name].centre for view in views])
    flights = sorted({view.flight for view in views})
    firsts = [next(view for view in views if view.flight == flight) for flight in flights]
    lens = true[firsts[0].name].camera
    towards = np.array([view.rotation[2] @ true[view.name].rotation[2] for view in views])
    return {
        "centre_rms_e_n_u_cm": _rounded(100 * np.sqrt(np.mean(errors**2, axis=0))),
        "centre_rms_3d_cm": _rounded(100 * np.sqrt(np.mean(np.sum(errors**2, axis=1)))),
        "centre_max_cm": _rounded(100 * np.linalg.norm(errors, axis=1).max()),
        "common_shift_cm": _rounded(100 * errors.mean(axis=0)),
        "focal_error_pct": [_rounded(100 * (view.camera.fx / true[view.name].camera.fx - 1), 4) for view in firsts],
        "turned_photos": int((towards < np.cos(np.radians(TURNED_DEG))).sum()),
        "true_focal_px": lens.fx,
        "true_principal_point_px": [lens.cx, lens.cy],
    }


def scale_error(plot: TruePlot, sfm: Path) -> float | None:
    """By what share the block makes widths at breast height too large, and so every diameter.

    Two spots 15 cm left and right of each true breast height, where the true camera shows them, are measured with the
    block's cameras at the depth that these give the stem. Mean over the oblique photos (all, where none is oblique) and
    stems; None where fewer than two photos show any stem.
    """
    views = load_views(sfm, plot.folder / "images")[1]
    oblique = [view for view in views if view.nadir_angle_deg > OBLIQUE_DEG]
    true = {view.name: view for view in plot.views()}
    near = plot.trees[plot.trees["near"]]
    found = [
        _widths_of(stem, [(view, true[view.name]) for view in oblique or views])
        for stem in plot.frame.to_local(near[["E_bh", "N_bh", "h_bh"]].to_numpy(float))
    ]
    ratios = np.concatenate([np.zeros(0), *found])
    return float(ratios.mean() - 1) if len(ratios) else None


def _widths_of(stem: np.ndarray, pairs: list[tuple[View, View]]) -> np.ndarray:
    """(V,) width of the bar at ``stem`` (3,) by the block's view over that by the true one, of the photos that show
    it; pairs: (view of the block, true view)."""
    seen = []
    for view, true in pairs:
        across = np.cross(true.centre - stem, [0.0, 0.0, 1.0])
        across *= 0.5 * _BAR_M / max(float(np.linalg.norm(across)), 1e-9)
        pixels, depth = true.project(np.array([stem, stem - across, stem + across]))
        if (depth > 0).all() and true.contains(pixels).all():
            seen.append((view, true, pixels, depth))
    if len(seen) < 2:
        return np.zeros(0)
    # A photo that looks elsewhere shows no stem here: without those whose ray passes by far.
    for _ in range(5):
        place, away = _intersection([view for view, *_ in seen], [pixels[0] for _, _, pixels, _ in seen])
        kept = [part for part, off in zip(seen, away, strict=True) if off <= max(3 * np.median(away), 0.05)]
        if len(kept) in (len(seen), 0, 1):
            break
        seen = kept
    ratios = []
    for view, true, pixels, depth in seen:
        ours = (view.rotation @ (place - _centre_at_row(view, pixels[0])))[2]
        ratios.append(_spread(view, pixels) * ours / (_spread(true, pixels) * depth[0]))
    return np.array(ratios)


def _spread(view: View, pixels: np.ndarray) -> float:
    """Distance of the last two of (3, 2) pixels on the plane at depth 1."""
    x, y = view.camera.undistort(pixels[1:, 0], pixels[1:, 1])
    return float(np.hypot(x[1] - x[0], y[1] - y[0]))


def _centre_at_row(view: View, pixel: np.ndarray) -> np.ndarray:
    """(3,) where the camera stood when the row of ``pixel`` (2,) was read."""
    return view.centre + (pixel[1] / view.camera.height - 0.5) * view.readout_travel_m


def _intersection(views: Sequence[View], pixels: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """(3,) point nearest to the rays of one pixel (2,) in each view, least squares, and its (V,) distances from them,
    metres."""
    matrix, right, rays = np.zeros((3, 3)), np.zeros(3), []
    for view, pixel in zip(views, pixels, strict=True):
        ray = view.rays(pixel[None])[0]
        across = np.eye(3) - np.outer(ray, ray)
        matrix += across
        right += across @ _centre_at_row(view, pixel)
        rays.append((across, _centre_at_row(view, pixel)))
    place = np.linalg.solve(matrix, right)
    return place, np.array([np.linalg.norm(across @ (place - centre)) for across, centre in rays])


def on_true_ground(plot: TruePlot, sfm: Path, xyz: np.ndarray) -> np.ndarray:
    """(N, 3) project coordinates in the block -> where they are in truth, by the similarity that puts the block's
    cameras on the true ones: a block whose geotags are metres off lies metres off, and its trees are the same trees."""
    frame, views = load_views(sfm, plot.folder / "images")
    true = {view.name: view for view in plot.views()}
    ours = _centres(plot, frame, views)
    target = np.array([true[view.name].centre for view in views])
    fitted = fit_similarity(ours, target, np.ones(len(views)))
    # Once more without the photos that the block has placed wrong.
    away = np.linalg.norm(fitted.apply(ours) - target, axis=1)
    fitted = fit_similarity(ours, target, (away <= 3 * np.median(away) + 1e-6).astype(float))
    return plot.frame.to_project(fitted.apply(plot.frame.to_local(xyz)))


def _centres(plot: TruePlot, frame: LocalFrame, views: list[View]) -> np.ndarray:
    """(V, 3) camera centres of a block in the true plot's local frame."""
    return plot.frame.to_local(frame.to_project(np.array([view.centre for view in views])))


def wrong_scale(relative_error: float | None, scale_sd: float | None) -> bool | None:
    """Whether an error of the scale (share) is beyond what is stated; None without one. A block that states no
    standard error states none."""
    if relative_error is None:
        return None
    return bool(abs(relative_error) > WRONG_SCALE_SD * (scale_sd or 0.0) + WRONG_SCALE_SHARE)


def _rounded(value: Any, digits: int = 2) -> Any:
    return np.round(value, digits).tolist()
