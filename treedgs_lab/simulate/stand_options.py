"""What else grows in real stands: barks, hardwoods, ivy, odd sections, snags, undergrowth, natural spacing.

Everything is off by default. Like the troubles (:mod:`.trouble`), each part draws from a random stream of its own and
only when it is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

from treedgs_geo.core.settings import param

from .declare import count, flag, number


@dataclass(frozen=True, kw_only=True)
class StemLookSettings:
    """Bark, section and what grows on and about the stems (part of the settings of ``simulate-plot``)."""

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
    """The stand and its undergrowth (part of the settings of ``simulate-plot``)."""

    hardwood_pct: float = number(0.0, 0, 100, "%", "trees that are hardwoods")
    leaf_off: bool = flag("hardwoods are bare, and so is a third of the shrubs of several kinds")
    spacing: str = param(
        "rows",
        choices=("rows", "natural"),
        dialog=False,
        help="rows: planted, jittered; natural: at random with a least distance, denser here and thinner there",
    )
    dbh_distribution: str = param(
        "normal",
        choices=("normal", "lognormal"),
        dialog=False,
        help="of the diameters, with the stated mean and standard deviation",
    )
    shrub_height_m: float = number(2.0, 0.3, 5, "m", "height of the tallest shrubs")
    shrub_variety: bool = flag("shrubs of several kinds: greens and browns, small and large leaves")
    undergrowth_per_m2: float = number(
        0.0, 0, 4, "1/m2", "young broadleaved plants 0.5-2.5 m high with leaves down to the ground"
    )
