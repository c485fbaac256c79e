"""What grows on a plot, and how: leans, forks, barks, hardwoods, ivy, odd sections, snags, undergrowth, spacing.

What is odd about a stand is off by default. Like the troubles (:mod:`.trouble`), each part draws from a random stream
of its own and only when it is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

from treedgs_geo.core.settings import param

from .declare import count, flag, number


@dataclass(frozen=True, kw_only=True)
class StemLookSettings:
    """Bark, section and what grows on and about the stems (keys of ``simulate-plot --stand``)."""

    sweep_cm: float = number(0.0, 0, 100, "cm", "sideways bow of every in-plot stem over its lowest 4 m")
    butt_flare_m: float = number(
        0.0, 0, 3, "m", "height over which the butt flare falls to a third; 0 = 0.16 to 0.28 m, drawn"
    )
    ellipticity_pct: float = number(
        0.0, 0, 40, "%", "widest less narrowest width of every stem, of the mean; 0 = up to 6, drawn"
    )

    bark_variety: bool = flag(
        "each stem has one of five barks: furrowed plates, smooth grey, pale with dark lenticels, dark furrows, "
        "reddish flakes; off = furrowed plates"
    )
    moss_pct: float = number(
        0.0, 0, 60, "%", "bark under moss, mean of the lowest 2 m; most at the foot and on the north side"
    )
    lichen_pct: float = number(0.0, 0, 60, "%", "bark under pale lichen, mean")
    ivy_stems: int = count(
        0, 0, 100, "in-plot stems under ivy from the ground to 1.5-5 m, its leaves 3-8 cm off the bark"
    )
    wrapped_stems: int = count(0, 0, 100, "in-plot stems with shrubs all round their lowest 1-2 m")
    flute_pct: float = number(
        0.0, 0, 40, "%", "depth of the hollows between 3 to 6 lobes all the way up every stem, of its radius"
    )
    buttress_m: float = number(
        0.0, 0, 3, "m", "height over which 3 to 6 root buttresses (a third of the radius at the ground) fall to a third"
    )
    snags: int = count(0, 0, 100, "in-plot dead stems of weathered wood, without twigs, broken off at 4-10 m")


@dataclass(frozen=True, kw_only=True)
class StandSettings(StemLookSettings):
    """The stand and its undergrowth: the keys of ``simulate-plot --stand``."""

    dbh_sd_cm: float = number(6.7, 0, 25, "cm", "standard deviation of the diameters")
    lean_max_deg: float = number(4.0, 0, 30, "deg", "largest lean of any stem")
    strong_leans: int = count(0, 0, 10, "in-plot stems that lean by 75-100 % of the largest lean")
    forks_below_bh: int = count(0, 0, 10, "in-plot trees forked below breast height")
    forks_above_bh: int = count(0, 0, 10, "in-plot trees forked above breast height")
    touching_saplings: int = count(0, 0, 10, "in-plot stems touched by a sapling")
    twins: int = count(0, 0, 10, "in-plot trees with a second full stem beside them")
    twin_gap_m: float = number(0.1, 0, 2, "m", "gap between the bark of twins at breast height")
    clearing_m: float = number(0.0, 0, 30, "m", "no tree stands within this distance of the plot's centre")
    leaf_area_m2: float = number(
        38.0, 0, 200, "m2", "one-sided needle area of a tree of mean DBH; what hides the stems"
    )
    shrubs_per_m2: float = number(0.13, 0, 2, "1/m2", "shrubs, up to shrub_height_m")
    saplings_per_m2: float = number(0.025, 0, 1, "1/m2", "saplings below 7.5 cm DBH")
    logs: int = count(5, 0, 50, "logs lying about")
    slope_pct: float = number(3.0, 0, 60, "%", "slope of the ground")

    hardwood_pct: float = number(0.0, 0, 100, "%", "trees that are hardwoods")
    leaf_off: bool = flag("hardwoods are bare, and so is a third of the shrubs of several kinds")
    spacing: str = param(
        "rows",
        choices=("rows", "natural"),
        help="rows: planted, jittered; natural: at random with a least distance, denser here and thinner there",
    )
    dbh_distribution: str = param(
        "normal",
        choices=("normal", "lognormal"),
        help="of the diameters, with the stated mean and standard deviation",
    )
    shrub_height_m: float = number(2.0, 0.3, 5, "m", "height of the tallest shrubs")
    shrub_variety: bool = flag("shrubs of several kinds: greens and browns, small and large leaves")
    undergrowth_per_m2: float = number(
        0.0, 0, 4, "1/m2", "young broadleaved plants 0.5-2.5 m high with leaves down to the ground"
    )
