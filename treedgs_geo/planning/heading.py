"""Which way the lines run: along the contours of a slope, else so that no photo looks into the sun."""

from __future__ import annotations

import numpy as np

from .missions import compass
from .site import PlanSite
from .sun import SunDay

#: Steeper ground decides the heading: lines along the contours keep their height.
STEEP_PCT = 15.0


def slope_of(site: PlanSite) -> tuple[float, float]:
    """Mean slope of the ground over the plots, per cent, and the azimuth it falls to, degrees."""
    if site.dtm is None:
        return 0.0, 0.0
    centres = np.array([target.centre for target in site.targets])
    reach = max(max(target.radius_m for target in site.targets), 10.0)
    xy = (centres[:, None] + reach * compass(15)).reshape(-1, 2)
    z = site.ground(xy)
    known = np.isfinite(z)
    plane = np.linalg.lstsq(np.column_stack([xy[known], np.ones(known.sum())]), z[known], rcond=None)[0]
    return 100 * float(np.hypot(*plane[:2])), float(np.degrees(np.arctan2(-plane[0], -plane[1])) % 360)


def heading_of(site: PlanSite, sun: SunDay) -> tuple[float, str]:
    """Grid azimuth of the lines and why."""
    slope, falls_to = slope_of(site)
    if slope >= STEEP_PCT:
        return (falls_to + 90) % 180, f"along the contours of a slope of {slope:.0f} %"
    if sun.elevation_deg[sun.noon] < 5:
        return 45.0, "the sun stays low: any heading does"
    return (sun.azimuth_deg[sun.noon] + 45) % 180, "45° to the sun at its highest: no photo looks into it or along it"
