"""Why a tree has no DBH, or one of low confidence: one list, used in every layer, table and report."""

from __future__ import annotations

#: reason -> (what it means, what to do about it)
REASONS: dict[str, tuple[str, str]] = {
    "few_views": ("too few photos see the stem at breast height", "fly more oblique photos over this part of the plot"),
    "occluded": ("foliage or other stems hide the stem at breast height", "fly leaf-off or from other directions"),
    "ambiguous": ("two different stems explain the photos equally well", "check the photos or measure by hand"),
    "covered": (
        "ivy or other growth covers the bark at breast height",
        "measure under it by hand; what is seen is thicker than the stem",
    ),
    "double": (
        "the bark is seen twice: two dates in one cloud, or scans that do not fit together",
        "give the scans of one date, registered to each other",
    ),
    "see_through": (
        "photos show the ground, or no bark, where the stem should stand: other things may line up there",
        "look at its photos or on site; there may be no stem",
    ),
    "short_arc": ("the points cover too little of the stem's circumference", "scan or fly from more sides"),
    "few_points": ("too few stem points at the lower stem", "raise the point density"),
    "few_slices": ("too few slices of the stem gave a circle", "raise the point density"),
    "not_round": ("the cross-section is not a circle (buttress, fork or several stems)", "measure by hand"),
    "no_taper": ("diameters along the stem do not form a plausible taper", "check the stem for branches or a fork"),
    "lean": ("the stem leans more than the method allows", "measure by hand"),
    "merged": ("two stems may have been taken for one", "check the segmentation"),
    "too_small": ("the stem is thinner than the photos or points can resolve", "fly lower or scan closer"),
    "too_large": ("the fitted stem is thicker than the allowed maximum", "raise the maximum diameter if it is real"),
    "too_short": (
        "the tree is far shorter than the others of its diameter",
        "check the diameter, and whether the top is broken",
    ),
    "wide_error": ("the estimated error is too large to be useful", "fly more photos or measure by hand"),
    "carried_down": (
        "breast height is hidden: measured 2 to 5 m above the ground, carried down by the taper of the plot's stems",
        "check, or measure by hand where the tenth of a centimetre counts",
    ),
    "disagree": ("two measuring methods disagree", "check this tree by hand"),
    "unchecked": ("the published method has no check and no error of its own", "compare with the default method"),
    "no_ground": (
        "the height of the ground at the tree is unknown or unsure",
        "give the cloud with its ground, or a DTM that fits it",
    ),
    "weak_block": (
        "the photos of this run hardly fit together: points of some are not found where they must be in others",
        "fly with more overlap or in less wind, or check by hand",
    ),
    "odd_heights": (
        "the trees are taller than trees of their diameter are: heights may be in feet",
        "check the unit of the cloud's heights and measure again",
    ),
    "not_found": (
        "a person says that a stem stands here, but none was found",
        "measure it at its place in the photos, or by tape",
    ),
    "edge": ("the tree stands at the edge of the data", "extend the survey beyond the plot"),
}


def split_reasons(reasons: object) -> list[str]:
    """``"few_views,lean"`` -> its keys, unknown ones too; none for what is no text (missing values of a table)."""
    text = reasons if isinstance(reasons, str) else ""
    return [part.strip() for part in text.split(",") if part.strip()]


def explain(reasons: str) -> str:
    """``"few_views,lean"`` -> the sentences a forester reads.

    Raises:
        InputError: a word that is no reason.

    Examples:
        >>> import treedgs_geo as tg
        >>> tg.explain("too_large")
        'the fitted stem is thicker than the allowed maximum: raise the maximum diameter if it is real'
    """
    # Not above: PyQGIS reads this file alone, for the styles.
    from ...core.errors import InputError

    parts = []
    for reason in split_reasons(reasons):
        if reason not in REASONS:
            raise InputError(f"{reason!r} is no reason of a tree layer; expected some of {', '.join(REASONS)}.")
        meaning, action = REASONS[reason]
        parts.append(f"{meaning}: {action}")
    return "; ".join(parts)
