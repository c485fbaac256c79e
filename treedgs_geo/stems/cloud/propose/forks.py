"""A fork above breast height is one tree: limbs that grow out of a stem are none of their own."""

from __future__ import annotations

import numpy as np

from .candidate_check import ConeStem
from .region_growing import Search
from .sensors import tolerance

#: Heights between which a tree has bark of its own at its foot, and from which on a limb's own bark counts, m.
FOOT_M, LIMB_M = (0.4, 1.5), 1.6
#: A limb has less than this share of its own density of points at the foot; its stem more than the second.
OWN_FOOT, STEM_FOOT = 0.2, 0.4
#: Limbs start this close to the bark of their stem at one of these heights, m.
JOINS_M, _JOINED_AT_M = 0.15, (1.3, 2.0, 3.0)


def without_limbs(search: Search, found: list[ConeStem]) -> list[ConeStem]:
    """The stems without those that are limbs of another one: no bark of their own at the foot, and joining it."""
    at = np.array([[*stem.cone.centre(h), stem.cone.radius(h)] for stem in found for h in _JOINED_AT_M])
    at = at.reshape(len(found), len(_JOINED_AT_M), 3)
    limbs = set()
    for number, limb in enumerate(found):
        # Stems whose axes come close enough for this one to grow out of them.
        gap = np.hypot(at[:, :, 0] - at[number, :, 0], at[:, :, 1] - at[number, :, 1])
        for other in np.flatnonzero((gap < at[:, :, 2] + at[number, :, 2] + JOINS_M).any(axis=1)):
            stem = found[other]
            if other != number and not stem.refused and not stem.at_seed and _is_limb(search, limb, stem):
                limbs.add(number)
    return [stem for number, stem in enumerate(found) if number not in limbs]


def _is_limb(search: Search, limb: ConeStem, stem: ConeStem) -> bool:
    """Bark that each of the two has for itself, below and above: a point belongs to the nearer bark; what lies within
    the stem is not the limb's."""
    sensor, top_m = search.sensor, search.options.fitted_m[1]
    middle = limb.cone.centre(2.0)
    reach = float(limb.cone.radius(0.5)) + 0.1 + 3.0 * float(np.hypot(limb.cone.dx, limb.cone.dy))
    reach += float(np.hypot(*(middle - stem.cone.centre(2.0)))) + float(stem.cone.radius(0.5))
    near = search.points[search.tree.within(middle, reach, FOOT_M[0], top_m)]
    of_limb, of_stem = limb.cone.residuals(near), stem.cone.residuals(near)
    near_stem = of_stem < tolerance(stem.cone, sensor)
    low, high = (near[:, 2] < FOOT_M[1]), (near[:, 2] > LIMB_M)
    own = (np.abs(of_limb) < tolerance(limb.cone, sensor)) & ~(near_stem & (near[:, 2] < FOOT_M[1]))
    main = np.abs(of_stem) < tolerance(stem.cone, sensor)
    foot, above = FOOT_M[1] - FOOT_M[0], top_m - LIMB_M
    usual = np.count_nonzero(own & high & ~near_stem) / above
    below = np.count_nonzero(own & low) / foot
    return bool(usual > 0 and below < OWN_FOOT * usual and np.count_nonzero(main & low) / foot > STEM_FOOT * usual)
