"""How true a block is: cameras and lens of ``sfm/`` against ``truth/`` of a simulated or rendered plot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo.reconstruction.model import load_views

from .plot import TruePlot

#: A photo whose axis is this far off its true one is placed wrong, wherever it stands.
TURNED_DEG = 2.0


def camera_errors(plot: TruePlot, sfm: Path) -> dict[str, Any]:
    """Camera centres, focal length (of each flight) and principal point of a block against ``truth/``.

    Returns:
        ``centre_rms_e_n_u_cm, centre_rms_3d_cm, centre_max_cm, common_shift_cm, focal_error_pct`` (a list, by flight),
        ``turned_photos`` (looking more than :data:`TURNED_DEG` elsewhere), ``true_focal_px``,
        ``true_principal_point_px``.
    """
    frame, views = load_views(sfm, plot.folder / "images")
    ours = np.array([view.centre for view in views])
    true = {view.name: view for view in plot.views()}
    errors = plot.frame.to_local(frame.to_project(ours)) - np.array([true[view.name].centre for view in views])
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


def _rounded(value: Any, digits: int = 2) -> Any:
    return np.round(value, digits).tolist()
