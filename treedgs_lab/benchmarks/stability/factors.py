"""The factors of the stability suite: one at a time, from harmless to hopeless (standard library only)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

#: The plot that every factor starts from: small, stems well seen. Levels change one thing about it.
BASE: dict[str, Any] = {
    "preset": "micro",
    "stems_per_ha": 1100.0,
    "leaf_area_m2": 12.0,
    "float_epochs": 0,
    "shrubs_per_m2": 0.10,
    "lean_max_deg": 3.0,
}
#: What a method reads.
PHOTOS, CLOUD = "photos", "cloud"


@dataclass(frozen=True)
class Factor:
    """key: short name. title, unit: for the axis. levels: values, harmless first. render: the settings of
    ``simulate-plot`` at a level (the plot is then rendered anew). perturb: name of what is done to the base plot
    instead (:mod:`.perturb`). inputs: which methods it concerns. about: one sentence for the page. labels: words for
    levels that are no number of the unit."""

    key: str
    title: str
    unit: str
    levels: tuple[float, ...]
    about: str
    render: dict[float, dict[str, Any]] = field(default_factory=dict)
    perturb: str = ""
    inputs: tuple[str, ...] = (PHOTOS, CLOUD)
    labels: dict[float, str] = field(default_factory=dict)

    def label(self, level: float) -> str:
        """A level as charts show it."""
        return self.labels.get(level, f"{level:g}")

    def label_with_unit(self, level: float) -> str:
        """A level as tables show it."""
        return self.labels.get(level, f"{level:g} {self.unit}")


def each(name: str, levels: tuple[float, ...], **also: Any) -> dict[float, dict[str, Any]]:
    """``render`` of a factor whose levels are values of one setting; ``also``: more settings of every level."""
    return {level: {name: level, **also} for level in levels}


def rendered(
    key: str,
    title: str,
    unit: str,
    about: str,
    render: dict[float, dict[str, Any]],
    inputs: tuple[str, ...] = (PHOTOS, CLOUD),
    labels: dict[float, str] | None = None,
) -> Factor:
    """A factor of plots that are rendered anew."""
    return Factor(key, title, unit, tuple(render), about, render, "", inputs, labels or {})


def perturbed(key: str, title: str, unit: str, about: str, levels: tuple[float, ...], *inputs: str) -> Factor:
    """A factor that spoils what was made of the base plot."""
    return Factor(key, title, unit, levels, about, {}, key, inputs)


#: What grows: barks, hardwoods, ivy, sections, snags, undergrowth, spacing.
GROWTH_FACTORS: tuple[Factor, ...] = (
    rendered(
        "barks",
        "kinds of bark",
        "step",
        "Furrowed plates only; five kinds of bark, pale and dark; with moss on 30 % and lichen on 20 % of it.",
        {
            0.0: {},
            1.0: {"bark_variety": True},
            2.0: {"bark_variety": True, "moss_pct": 30.0, "lichen_pct": 20.0},
        },
        (PHOTOS,),
        {0.0: "one", 1.0: "five", 2.0: "overgrown"},
    ),
    rendered(
        "hardwoods",
        "half of the trees are hardwoods",
        "step",
        "Limbs, branches and twigs low on the stems, bare or in leaf, and five kinds of bark.",
        {
            0.0: {},
            1.0: {"hardwood_pct": 50.0, "leaf_off": True, "bark_variety": True},
            2.0: {"hardwood_pct": 50.0, "bark_variety": True},
        },
        labels={0.0: "pines", 1.0: "bare", 2.0: "in leaf"},
    ),
    rendered(
        "ivy",
        "stems under ivy",
        "count",
        "Ivy from the ground to 1.5-5 m, its leaves 3-8 cm off the bark; truth is without them.",
        each("ivy_stems", (0, 2, 4)),
    ),
    rendered(
        "wrapped",
        "stems wrapped in shrubs",
        "count",
        "Shrubs all round the lowest 1-2 m of these stems.",
        each("wrapped_stems", (0, 2, 4)),
    ),
    rendered(
        "flutes",
        "depth of the hollows between lobes",
        "% of the radius",
        "Three to six lobes all the way up; truth is the tape's diameter, which spans the hollows.",
        each("flute_pct", (0.0, 8.0, 20.0)),
    ),
    rendered(
        "buttress",
        "buttresses: height to a third",
        "m",
        "Three to six root buttresses that still show at breast height; truth is the tape's diameter.",
        each("buttress_m", (0.0, 0.5, 1.0)),
    ),
    rendered(
        "snags",
        "dead stems without twigs",
        "count",
        "Grey weathered wood, broken off at 4-10 m.",
        each("snags", (0, 3)),
    ),
    rendered(
        "shrubs",
        "height of dense shrubs",
        "m",
        "0.8 shrubs a square metre of several greens and browns, small and large leaves.",
        {0.0: {}, **each("shrub_height_m", (1.0, 2.5, 4.0), shrubs_per_m2=0.8, shrub_variety=True)},
        labels={0.0: "few"},
    ),
    rendered(
        "undergrowth",
        "young broadleaved plants",
        "1/m2",
        "Plants of 0.5-2.5 m with leaves from the ground up.",
        each("undergrowth_per_m2", (0.0, 0.5, 2.0)),
    ),
    rendered(
        "natural",
        "natural spacing, stems",
        "1/ha",
        "Trees at random, some near each other, diameters lognormal; planted rows first.",
        {0.0: {}, **each("stems_per_ha", (700.0, 1500.0), spacing="natural", dbh_distribution="lognormal")},
        labels={0.0: "rows"},
    ),
)


#: About the stand, the cloud, and photos whose cameras are known.
STAND_FACTORS: tuple[Factor, ...] = (
    perturbed(
        "views",
        "photos kept",
        "photos",
        "Oblique photos left of 25, spread over the directions; with 3 hardly any stem has a clear view.",
        (25, 16, 10, 6, 3),
        PHOTOS,
    ),
    rendered(
        "hiding",
        "needle area a tree",
        "m2",
        "Crowns that hide the stems: clear views fall from a handful to none.",
        each("leaf_area_m2", (12.0, 30.0, 80.0)),
    ),
    rendered(
        "gsd",
        "ground sample distance",
        "cm",
        "Pixels across a stem: 28 at 1 cm, 5 at 5 cm.",
        {
            1.84: {},
            1.0: {"gsd_cm": 1.0, "image_width": 960, "image_height": 760},
            3.0: {"gsd_cm": 3.0},
            5.0: {"gsd_cm": 5.0},
        },
        (PHOTOS,),
    ),
    rendered(
        "understory",
        "shrubs",
        "1/m2",
        "Shrubs up to 2 m high about the stems.",
        each("shrubs_per_m2", (0.1, 0.5, 1.5)),
    ),
    rendered(
        "wind",
        "sway of the crowns between photos",
        "cm",
        "Crowns, and less the stems, stand elsewhere in every third photo.",
        each("wind_sway_cm", (0.0, 15.0, 60.0, 200.0)),
        (PHOTOS,),
    ),
    rendered(
        "lean",
        "lean",
        "deg",
        "Every stem of the plot leans.",
        {0.0: {}, **{a: {"lean_max_deg": a, "strong_leans": 10} for a in (10.0, 18.0, 25.0)}},
    ),
    rendered(
        "sweep", "bow of the lowest 4 m", "cm", "Swept stems: no straight axis.", each("sweep_cm", (0.0, 15.0, 40.0))
    ),
    rendered(
        "fork_below",
        "trees forked below breast height",
        "count",
        "Two limbs from one foot.",
        each("forks_below_bh", (0, 3)),
    ),
    rendered(
        "fork_above",
        "trees forked above breast height",
        "count",
        "One stem at breast height, two above.",
        each("forks_above_bh", (0, 3)),
    ),
    rendered(
        "flare",
        "butt flare: height to a third",
        "m",
        "A butt that is still thick at breast height; truth is the tape's, flare included.",
        {0.22: {}, 0.7: {"butt_flare_m": 0.7}, 1.5: {"butt_flare_m": 1.5}},
    ),
    rendered(
        "ellipse",
        "widest less narrowest width",
        "%",
        "Oval stems; truth is the tape's diameter.",
        {3.0: {}, 10.0: {"ellipticity_pct": 10.0}, 25.0: {"ellipticity_pct": 25.0}},
    ),
    rendered(
        "touch",
        "stems touched by a sapling",
        "count",
        "A sapling of 4.5-7 cm against the bark.",
        each("touching_saplings", (0, 4)),
    ),
    rendered(
        "twins",
        "gap between two stems",
        "m",
        "A second full stem beside every stem.",
        {9.0: {}, **{gap: {"twins": 10, "twin_gap_m": gap, "stems_per_ha": 600.0} for gap in (0.4, 0.1, 0.01)}},
    ),
    perturbed(
        "sector",
        "photos from one side only",
        "deg",
        "Directions that the photos come from: a missing half.",
        (360, 180, 90, 45),
        PHOTOS,
    ),
    perturbed(
        "arc",
        "bark hit by the scanner",
        "deg",
        "A missing half of the stem in the cloud: thin arc.",
        (360, 180, 90, 45),
        CLOUD,
    ),
    perturbed(
        "clutter",
        "floating points about the stems",
        "1/m3",
        "Uniform clutter within 0.6 m of the axes.",
        (0, 100, 400, 1500),
        CLOUD,
    ),
    perturbed(
        "poses",
        "pose noise",
        "px",
        "Each photo turned at random (the same photos, wrong directions).",
        (0, 0.5, 1.0, 2.0),
        PHOTOS,
    ),
    perturbed(
        "shaken", "motion blur of a tenth of the photos", "px", "A tenth of the photos is shaken.", (0, 6, 20), PHOTOS
    ),
    perturbed(
        "misexposed",
        "wrong exposure of a tenth of the photos",
        "stops",
        "Half of that tenth too dark, half blown out.",
        (0, 1.5, 3),
        PHOTOS,
    ),
    perturbed(
        "exposure",
        "exposure from photo to photo",
        "stops",
        "Rolling exposure: standard deviation.",
        (0, 0.3, 1.0),
        PHOTOS,
    ),
    perturbed(
        "white",
        "white balance from photo to photo",
        "%",
        "Rolling white balance: standard deviation a channel.",
        (0, 5, 15),
        PHOTOS,
    ),
    perturbed(
        "dtm",
        "error of the ground height",
        "m",
        "The terrain model lies too high by this much, so breast "
        "height does; photos show how much, and intervals are widened by it.",
        (0, 0.1, 0.3, 1.0),
        PHOTOS,
        CLOUD,
    ),
    perturbed(
        "scale",
        "standard error of the block's scale",
        "%",
        "Geotags fix the scale this poorly; how much too "
        "large or too small the block is, is drawn from it. Intervals are widened by the standard error.",
        (0, 0.5, 1.0, 2.0),
        PHOTOS,
    ),
    perturbed("density", "points kept", "1/m2", "Pulses of the scanner, of 1400.", (1400, 500, 150, 50), CLOUD),
    perturbed(
        "range_noise",
        "noise of the points",
        "cm",
        "Range and trajectory noise, standard deviation an axis.",
        (0, 1.5, 3, 6),
        CLOUD,
    ),
    rendered(
        "empty",
        "clearing about the plot's centre",
        "m",
        "No tree to be found: shrubs, grass, logs and saplings only.",
        {0.0: {}, 6.0: {"clearing_m": 6.0, "saplings_per_m2": 0.15, "shrubs_per_m2": 0.5, "logs": 12}},
    ),
)


FACTORS = STAND_FACTORS + GROWTH_FACTORS


def factor(key: str) -> Factor:
    """The factor of this key (KeyError if there is none)."""
    return next(item for item in FACTORS if item.key == key)
