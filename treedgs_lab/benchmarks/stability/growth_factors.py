"""Factors about what grows: barks, hardwoods, ivy, sections, snags, undergrowth, spacing (standard library only)."""

from __future__ import annotations

from .factor_type import PHOTOS, Factor, each, rendered

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
