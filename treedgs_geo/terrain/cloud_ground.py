"""The ground under a cloud and how far it can be trusted: a given terrain model against what the cloud shows itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pyproj

from ..core.errors import InputError
from ..core.progress import Reporter
from ..pointcloud.cloud import extent
from .credibility import NO_GROUND_M, SEEN_SE_M, GroundLayer
from .dtm import GROUND_WARN_M, OTHER_HEIGHTS_M, Dtm
from .ground import MANY_POINTS, dtm_from_cloud, flat_ground, lowest_z
from .surface import cell_quantile

#: Where the cloud shows no ground, its lowest points should still be on the stems that are measured, up to here, m.
LOWER_STEM_M = 5.0
#: So many places, 2 m apart, have to show ground before a given terrain model is judged by them.
MIN_PLACES = 3
#: A bare tree: so wide at most, and at its foot (the lowest points, so high) no wider than this, m.
_TREE_M, _FOOT_M, _FOOT_HEIGHT_M = 20.0, 3.0, 1.5
#: Radius of its stem at most, m.
_STEM_M = 0.3
#: A model this far above the lowest points of stems is above the ground, m.
_SURE_BELOW_M = 0.3
#: The ground of a cloud that shows none is about where the lowest points of its stems are: filters take off half a
#: metre, seldom more. Its standard error, m.
LOWEST_SE_M = 1.0
#: The lowest points of a cloud whose z is height above ground: with its ground, or cut so far above it at most, metres.
CUT_M = (-0.3, 1.1)
#: In blocks of this side; those with stems or low plants have points up to ``LOW_M`` above the cloud's lowest, and such
#: a share of them begins within ``LEVEL_M`` of it. A slope or relief spreads over ``LOW_M``.
BLOCK_M, LOW_M, LEVEL_M, LEVEL_SHARE = 3.0, 2.0, 0.25, 0.7
#: So many blocks tell a plot; fewer are one tree.
MIN_BLOCKS = 4
#: Standard error of heights that another program's ground was taken off from, metres.
NORMALISED_SE_M = 0.1


@dataclass(frozen=True)
class CloudGround:
    """dtm: what heights are counted from. given: the user's terrain model, if any. own, layer: the ground that the
    cloud shows, and how well it does (``None``: it shows none). above_m: how far ``given`` lies above ``own`` (median
    over the places that show ground). lowest: the ground is the lowest points of one bare tree. least_m: the error that
    a given model has where nothing contradicts it."""

    dtm: Dtm
    given: Dtm | None = None
    own: Dtm | None = None
    layer: GroundLayer | None = None
    above_m: float = 0.0
    lowest: bool = False
    least_m: float = 0.0

    @property
    def shows_ground(self) -> bool:
        """Whether the cloud shows a ground surface anywhere."""
        return self.layer is not None and bool(self.layer.seen(self.layer.places()).any())

    def shows_ground_at(self, points: np.ndarray) -> bool:
        """Whether ground is seen round most of (N, 3) points, or anywhere away from zero."""
        if self.layer is None or self.own is None or not len(points):
            return False
        seen = self.layer.seen(points[:, :2])
        z = self.own.height(*points[seen, :2].T)
        return bool(seen.mean() > 0.5 or (seen.any() and abs(float(np.nanmedian(z))) > _SURE_BELOW_M))

    def se_m(self, xy: np.ndarray, clear_m: np.ndarray) -> np.ndarray:
        """(K,) standard error of the ground's height at stems, metres; at most :data:`LOWEST_SE_M` without a given
        model, for stems do not hang in the air. xy: (K, 2) places. clear_m: (K,) radius round each that its own foot
        takes up.

        A given model is off by as much as it differs from the ground seen there, or from that of the whole cloud; a
        cloud that shows no ground says nothing about it, unless its stems reach below it.
        """
        xy = np.asarray(xy, float).reshape(-1, 2)
        if self.layer is None or self.own is None:
            return np.full(len(xy), self.least_m if self.given is not None else LOWEST_SE_M)
        seen = np.minimum(self.layer.without(xy, clear_m).se_m(xy, self.own), LOWEST_SE_M)
        if self.given is None:
            return seen
        given, used, own = (model.height(*xy.T) for model in (self.given, self.dtm, self.own))
        gap = np.abs(given - own)
        # Points that only stems have are above the ground, whatever hides it: a model above them is wrong.
        below = np.where(given - own > _SURE_BELOW_M, given - own, 0.0)
        of_given = np.where((seen <= SEEN_SE_M) & np.isfinite(gap), gap, np.maximum(abs(self.above_m), below))
        of_given = np.maximum(of_given, self.least_m)
        from_own = np.isfinite(used) & ~(np.abs(used - given) < GROUND_WARN_M)
        return np.where(from_own, seen, of_given)


def own_ground(xyz: np.ndarray, crs: pyproj.CRS | None) -> CloudGround:
    """The ground that (N, 3) points show, or for one bare tree its lowest points.

    Raises:
        InputError: none was found.
    """
    foot = _only_foot(xyz)
    try:
        dtm = dtm_from_cloud(xyz, 0.25 if len(xyz) <= MANY_POINTS else 0.5, crs=crs)
    except InputError:
        if foot is None:
            raise
        return CloudGround(flat_ground(xyz, crs), lowest=True)
    layer = GroundLayer.of(xyz, dtm)
    if foot is not None:
        layer = layer.without(foot[None], np.array([_STEM_M]))
        if layer.se_m(foot[None], dtm)[0] >= NO_GROUND_M:
            return CloudGround(flat_ground(xyz, crs), lowest=True)
    return CloudGround(dtm, own=dtm, layer=layer)


def found_ground(
    xyz: np.ndarray, crs: pyproj.CRS | None, where: str, reporter: Reporter, z_is: str = "auto"
) -> CloudGround:
    """:func:`own_ground` of the cloud named ``where``, or zero where its z is height above ground; what is missing of
    it is said. z_is: ``height``, ``elevation`` or, to be told by the points, ``auto``.

    Raises:
        InputError: none was found; z is said to be height, and the cloud shows ground elsewhere.
    """
    if z_is == "height":
        zero = given_ground(flat_ground(xyz, crs, 0.0), xyz, f"{where}: the ground at z = 0 (--z-is height)", reporter)
        return replace(zero, least_m=NORMALISED_SE_M)
    low = lowest_height(xyz) if z_is == "auto" else None
    try:
        ground = own_ground(xyz, crs)
    except InputError:
        if low is None:
            raise
        ground = CloudGround(flat_ground(xyz, crs, 0.0), lowest=True)
    if low is not None and not ground.shows_ground_at(cell_quantile(xyz, BLOCK_M, 0.0)):
        reporter.info(
            f"{where}: shows little ground, and its lowest points lie {low:.2f} m high everywhere: z is taken as "
            "height above ground (--z-is elevation: it is not)."
        )
        level = flat_ground(xyz, crs, 0.0)
        return CloudGround(level, level, least_m=NORMALISED_SE_M)
    if not ground.shows_ground:
        reporter.warn(
            f"{where}: shows no ground surface between the stems (its lowest metres may have been clipped or "
            "filtered out): heights are counted from its lowest points and intervals are wider for it (no_ground); "
            "give the cloud with its ground, a DTM with --dtm, or say that z is height above ground (--z-is height)."
        )
    return ground


def _only_foot(xyz: np.ndarray) -> np.ndarray | None:
    """(2,) where (N, 3) points have their foot if they are one tree with hardly any surroundings, else ``None``."""
    low, high = extent(xyz)
    if float((high - low)[:2].max()) > _TREE_M:
        return None
    foot = xyz[xyz[:, 2] < lowest_z(xyz) + _FOOT_HEIGHT_M, :2]
    wide = float(np.ptp(np.percentile(foot, [2, 98], axis=0), axis=0).max())
    return np.median(foot, axis=0) if wide < _FOOT_M else None


def given_ground(given: Dtm, xyz: np.ndarray, where: str, reporter: Reporter) -> CloudGround:
    """A given terrain model (named ``where``) under (N, 3) points, held against the ground that they show.

    Where it knows no height, or a clearly wrong one, the ground of the cloud stands in, so that no stem is lost there.

    Raises:
        InputError: its heights are not those of the cloud.
    """
    try:
        found = own_ground(xyz, given.crs)
    except InputError:
        found = CloudGround(given, lowest=True)
    if found.lowest:
        _require_possible(given, xyz, where)
        reporter.info(f"{where}: could not be checked, the cloud shows no ground of its own.")
        return CloudGround(given, given)
    assert found.layer is not None and found.own is not None
    places = found.layer.places()
    seen = found.layer.seen(places)
    theirs, ours = given.height(*places.T), found.own.height(*places.T)
    above = theirs - ours
    known = above[seen & np.isfinite(above)]
    median = 0.0
    if len(known) >= MIN_PLACES:
        same = np.abs(known) <= OTHER_HEIGHTS_M
        if same.mean() < 0.5:
            other = seen & np.isfinite(theirs) & ~(np.abs(above) <= OTHER_HEIGHTS_M)
            low, high, gap = (float(np.median(part[other])) for part in (theirs, ours, above))
            raise InputError(
                f"{where}: lies at {low:.1f} m where the cloud's own ground lies at {high:.1f} m ({gap:+.1f} m, at "
                f"{100 * (1 - float(same.mean())):.0f} % of the places that show ground), expected within "
                f"{OTHER_HEIGHTS_M:g} m; bring both to one vertical datum (ellipsoid or geoid) and to metres, or leave "
                "--dtm out."
            )
        median = float(np.median(known[same]))
        if abs(median) > GROUND_WARN_M:
            reporter.warn(
                f"{where}: lies {median:+.2f} m from the ground that the cloud shows (median), expected within "
                f"{GROUND_WARN_M:g} m; breast height may be off by as much and the trees' intervals are widened by it: "
                "check its datum, or leave --dtm out."
            )
    else:
        _require_possible(given, xyz, where)
        reporter.info(f"{where}: could not be checked, the cloud shows too little ground of its own.")
    completed, holes, wrong = _completed(given, found, places, seen)
    if holes or wrong:
        faults = [f"no height in {holes:.0f} m2"] * (holes > 0)
        faults += [f"a height more than {OTHER_HEIGHTS_M:g} m off in {wrong:.0f} m2"] * (wrong > 0)
        reporter.warn(
            f"{where}: has {' and '.join(faults)} of the ground under the cloud; the ground that the cloud shows "
            "stands in there, and stems where it shows none have no_ground."
        )
    return CloudGround(completed, given, found.own, found.layer, median)


def require_same_heights(dtm: Dtm, xyz: np.ndarray, where: str) -> None:
    """Refuse a DTM whose heights are not those of the cloud (ellipsoid against geoid, feet, normalised heights).

    The low points of (N, 3) ``xyz`` in 1 m cells should lie on the ground.

    Raises:
        InputError: their lower quartile lies farther than :data:`.dtm.OTHER_HEIGHTS_M` from it.
    """
    gap = _lowest_above(dtm, xyz)
    # The lower quartile: under dense canopy most cells hold no ground return, but some do.
    quartile = float(np.percentile(gap, 25)) if gap.size else 0.0
    if abs(quartile) > OTHER_HEIGHTS_M:
        raise InputError(
            f"{where}: the cloud's lowest points lie {quartile:+.1f} m from this ground, expected within "
            f"{OTHER_HEIGHTS_M:g} m; bring both to one vertical datum (ellipsoid or geoid) and to metres, or leave "
            "--dtm out."
        )


def _lowest_above(dtm: Dtm, xyz: np.ndarray) -> np.ndarray:
    """(K,) metres of the lowest of (N, 3) points in 1 m cells above a terrain model, where it knows a height."""
    lows = cell_quantile(xyz, 1.0, 0.0)
    above = lows[:, 2] - dtm.height(*lows[:, :2].T)
    return above[np.isfinite(above)]


def _require_possible(given: Dtm, xyz: np.ndarray, where: str) -> None:
    """Without ground of its own a cloud still has no points far under the ground, and some on lower stems.

    Raises:
        InputError: it has, or has not.
    """
    above = _lowest_above(given, xyz)
    # Under crowns alone the lowest points are high.
    deep, lowest = (float(np.percentile(above, 5)), float(above.min())) if above.size else (0.0, 0.0)
    if deep < -OTHER_HEIGHTS_M or lowest > LOWER_STEM_M:
        lowest = deep if deep < -OTHER_HEIGHTS_M else lowest
        raise InputError(
            f"{where}: the cloud's lowest points lie {lowest:+.1f} m from this ground, expected -{OTHER_HEIGHTS_M:g} "
            f"to {LOWER_STEM_M:g} m; bring both to one vertical datum (ellipsoid or geoid) and to metres, or leave "
            "--dtm out."
        )


def _completed(given: Dtm, found: CloudGround, places: np.ndarray, seen: np.ndarray) -> tuple[Dtm, float, float]:
    """``(model, m2 without a height, m2 with a wrong one)``: the given model as it is, or on the cloud's own grid with
    the cloud's ground where the given one has none, or where the cloud shows ground at another height."""
    from scipy.spatial import cKDTree

    own = found.own
    assert own is not None
    x, y = own.centres()
    theirs = given.height(x, y)
    holes = ~np.isfinite(theirs) & np.isfinite(own.heights)
    wrong = np.abs(theirs - own.heights) > OTHER_HEIGHTS_M
    if wrong.any():
        wrong[wrong] = seen[cKDTree(places).query(np.column_stack([x[wrong], y[wrong]]))[1]]
    bad = holes | wrong
    if not bad.any():
        return given, 0.0, 0.0
    completed, area = replace(own, heights=np.where(bad, own.heights, theirs)), own.resolution_m**2
    return completed, area * float(holes.sum()), area * float(wrong.sum())


def lowest_height(xyz: np.ndarray) -> float | None:
    """z of the lowest points of (N, 3) ``xyz`` where it looks like height above ground, else ``None``.

    The ground may be in the cloud or cut off at one height. A cloud of one tree says little about its slope, but there
    zero and the lowest points are hardly a metre apart.
    """
    lows = cell_quantile(xyz, BLOCK_M, 0.0)[:, 2]
    low = lowest_z(xyz)
    if not CUT_M[0] <= low <= CUT_M[1]:
        return None
    near = lows[lows < low + LOW_M]
    return low if len(near) < MIN_BLOCKS or np.mean(near < low + LEVEL_M) >= LEVEL_SHARE else None
