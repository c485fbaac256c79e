"""The measured tree: the record every route fills and the tree layer shows (``docs/technician/tree-layer.md``)."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ...core.intervals import HALF_WIDTH_SE
from .findings import Flag, Level
from .methods import METHODS
from .priors import BREAST_HEIGHT_M, USUAL_TAPER_CM_M
from .reasons import REASONS, split_reasons


@dataclass
class Tree:
    """One stem. Project coordinates in metres; unknown is ``None``, never 0.

    x, y: stem axis at breast height. z_ground: ground at the stem. dbh_*: diameter at ``bh_m`` with its standard error
    and 90 % interval, cm. height_m, height_se_m: tree height and its standard error. height_why: a key of
    :data:`treedgs_geo.stems.quality.tops.HEIGHT_REASONS` where no height was found. lean_deg: stem axis from the
    vertical. arc_deg: covered circumference (points) or spread of azimuths (photos). taper_cm_m:
    d(diameter)/d(height). method: a key of :data:`treedgs_geo.stems.quality.methods.METHODS`. qc_reason:
    comma-separated keys of :data:`treedgs_geo.stems.quality.reasons.REASONS`. species, status (``live`` or ``dead``),
    note and rev_* (decisions: :mod:`treedgs_geo.inventory.reviewed`): a person's, written in the layer; no method
    fills them.

    Raises:
        ValueError: a reason or the method is not in those lists.

    Examples:
        >>> import treedgs_geo as tg
        >>> tree = tg.Tree(1, x=500000.0, y=5200000.0, dbh_cm=30.0, dbh_se_cm=0.5).finish()
        >>> round(tree.dbh_lo_cm, 2), round(tree.dbh_hi_cm, 2), round(tree.ba_m2, 4)
        (29.18, 30.82, 0.0707)
    """

    tree_id: int
    x: float
    y: float
    z_ground: float | None = None
    plot_id: str | None = None
    dbh_cm: float | None = None
    dbh_se_cm: float | None = None
    dbh_lo_cm: float | None = None
    dbh_hi_cm: float | None = None
    bh_m: float = BREAST_HEIGHT_M
    height_m: float | None = None
    height_se_m: float | None = None
    height_why: str | None = None
    ba_m2: float | None = None
    lean_deg: float | None = None
    arc_deg: float | None = None
    n_pts: int | None = None
    n_views: int | None = None
    n_slices: int | None = None
    opac_mean: float | None = None
    taper_cm_m: float | None = None
    method: str = ""
    qc_flag: Flag = "ok"
    qc_reason: str = ""
    run_id: str = ""
    species: str | None = None
    status: str | None = None
    note: str | None = None
    rev_flag: str | None = None
    rev_dbh_cm: float | None = None
    rev_note: str | None = None
    rev_by: str | None = None
    rev_at: str | None = None

    def __post_init__(self) -> None:
        for reason in self.reasons:
            if reason not in REASONS:
                raise ValueError(f"undocumented qc_reason {reason!r}")
        if self.method and self.method not in METHODS:
            raise ValueError(f"undocumented method {self.method!r}")

    @property
    def reasons(self) -> tuple[str, ...]:
        """The keys in ``qc_reason``, in their order."""
        return tuple(split_reasons(self.qc_reason))

    def add_reason(self, reason: str, level: Level = "check") -> Tree:
        """Append a reason (once) and raise the flag to ``level``, in place; a refused tree stays refused, and one that
        is refused now loses its DBH.

        Raises:
            ValueError: the reason is not in the list.
        """
        if reason not in REASONS:
            raise ValueError(f"undocumented qc_reason {reason!r}")
        self.qc_reason = ",".join(dict.fromkeys([*self.reasons, reason]))
        if level == "reject":
            self.qc_flag = "reject"
            return self.finish()
        self.qc_flag = "check" if self.qc_flag == "ok" else self.qc_flag
        return self

    def finish(self) -> Tree:
        """Apply the layer's rules: a rejected tree has no DBH; basal area and interval follow from DBH and error."""
        if self.qc_flag == "reject" or self.dbh_cm is None or not np.isfinite(self.dbh_cm):
            self.qc_flag = "reject"
            self.dbh_cm = self.dbh_se_cm = self.dbh_lo_cm = self.dbh_hi_cm = self.ba_m2 = None
            if not self.qc_reason:
                raise ValueError(f"tree {self.tree_id} is rejected without a reason")
        else:
            self.ba_m2 = np.pi / 4 * (self.dbh_cm / 100) ** 2
            if self.dbh_se_cm is not None and self.dbh_lo_cm is None:
                self.dbh_lo_cm = max(self.dbh_cm - HALF_WIDTH_SE * self.dbh_se_cm, 0.0)
                self.dbh_hi_cm = self.dbh_cm + HALF_WIDTH_SE * self.dbh_se_cm
        return self


def with_block_errors(tree: Tree, scale_sd: float, ground_m: float) -> Tree:
    """The tree with the errors that its whole plot shares added to its own; as it is where it has no error.

    scale_sd: relative standard error of all lengths. ground_m: how far the ground, and so breast height, may be off.
    """
    if tree.dbh_cm is None or tree.dbh_se_cm is None:
        return tree
    # A stem that looks straight at breast height still has a foot.
    taper_cm_m = max(abs(tree.taper_cm_m or 0.0), abs(USUAL_TAPER_CM_M))
    shared_cm = float(np.hypot(scale_sd * tree.dbh_cm, taper_cm_m * ground_m))
    dbh_cm, low_cm, high_cm = tree.dbh_cm, tree.dbh_lo_cm, tree.dbh_hi_cm
    if low_cm is not None and high_cm is not None:
        # An interval need not be symmetrical (a rival explanation on one side): each side is widened by itself.
        below, above = (
            float(np.hypot(side, HALF_WIDTH_SE * shared_cm)) for side in (dbh_cm - low_cm, high_cm - dbh_cm)
        )
        low_cm, high_cm = max(dbh_cm - below, 0.0), dbh_cm + above
    se_cm = float(np.hypot(tree.dbh_se_cm, shared_cm))
    return replace(tree, dbh_se_cm=se_cm, dbh_lo_cm=low_cm, dbh_hi_cm=high_cm).finish()


def on_ground(tree: Tree, scale: float) -> Tree:
    """The tree with what was measured on the map as it is on the ground: diameter, errors, interval, taper, basal area.

    scale: map metres for one metre on the ground (:func:`treedgs_geo.core.map_scale.ground_scale`). Heights are the
    same on both; the lean is not corrected (0.05 degrees at the largest scale that is measured in).
    """
    lengths = ("dbh_cm", "dbh_se_cm", "dbh_lo_cm", "dbh_hi_cm", "taper_cm_m")
    there = {name: value for name in (*lengths, "ba_m2") if (value := getattr(tree, name)) is not None}
    return replace(tree, **{name: value / scale ** (2 if name == "ba_m2" else 1) for name, value in there.items()})


#: Field names of the tree layer, in order (x and y are kept as columns too).
TREE_FIELDS = tuple(item.name for item in fields(Tree))
