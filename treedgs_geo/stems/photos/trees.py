"""Fitted stems -> tree records."""

from __future__ import annotations

import numpy as np

from ...core.crs import LocalFrame
from ..quality.tree import Tree
from .fit.photo_fit import PhotoFit


def trees_of_photo_fits(
    fits: list[PhotoFit], frame: LocalFrame, plot_id: str | None = None, run_id: str = "", first_id: int = 1
) -> list[Tree]:
    """Stems fitted to the photos as trees in project coordinates, numbered from ``first_id`` in the order given.

    Refused stems keep their place and reasons but carry no diameter.
    """
    trees = []
    for number, fit in enumerate(fits, start=first_id):
        foot = fit.foot_z if np.isfinite(fit.foot_z) else fit.axis.ground_z
        x, y, z = frame.to_project(np.array([[*fit.axis.p, foot]]))[0]
        trees.append(
            Tree(
                tree_id=number,
                x=float(x),
                y=float(y),
                z_ground=float(z),
                plot_id=plot_id,
                bh_m=fit.axis.bh_m,
                lean_deg=fit.lean_deg,
                arc_deg=fit.evidence.arc_deg,
                n_views=fit.evidence.n_views,
                taper_cm_m=200 * fit.r1 if fit.measured else None,
                method="photos",
                run_id=run_id,
                **fit.assessment.of_tree(),
            ).finish()
        )
    return trees
