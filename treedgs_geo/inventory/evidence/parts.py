"""What every sheet has: the headline, diameter against height, the numbers, the reasons in words."""

from __future__ import annotations

import numpy as np

from ...core.shown import shown_cm
from ...report.charts import FLAGS
from ...stems.quality.methods import METHODS
from ...stems.quality.reasons import REASONS
from ...stems.quality.tree import Tree
from .canvas import BLUE, FAINT, FLAG_COLOURS, INK, LINE, PAPER, Canvas, font, shortened

WIDTH, MARGIN = 1200, 14
#: Heights above the ground that sheets show, metres.
LOW_M, HIGH_M = 0.0, 3.6
#: Left, top, width and height of a part, pixels.
Box = tuple[float, float, float, float]
#: Longest plot id on a sheet, letters, and the width of its reasons, pixels.
_LONGEST_ID, _REASONS = 40, 300


def begin_sheet(tree: Tree, below: int, high: int, rows: list[tuple[str, str]]) -> Canvas:
    """A sheet with tree, plot, diameter and flag across the top, and from ``below`` down its numbers (rows: label and
    value, left out where that is empty) and reasons; high: at least so much below."""
    taken = int(reasons(Canvas(8, 8), 0, 0, tree)) + 8
    canvas = Canvas(WIDTH, max(below + high, below + 24 + taken))
    colour = FLAG_COLOURS[tree.qc_flag]
    canvas.box(0, 0, WIDTH, 6, colour, filled=True)
    plot = f", plot {shortened(tree.plot_id, _LONGEST_ID)}" if tree.plot_id else ""
    name = f"Tree {tree.tree_id}{plot}"
    canvas.text(MARGIN, 16, name, 22, INK, True)
    words = FLAGS[tree.qc_flag][1]
    width = font(15, True).getlength(words) + 24
    canvas.box(WIDTH - MARGIN - width, 15, width, 28, colour, filled=True)
    canvas.text(WIDTH - MARGIN - width / 2, 29, words, 15, PAPER, True, "mm")
    canvas.text(WIDTH - 2 * MARGIN - width, 16, dbh_words(tree), 22, INK, True, "ra")
    interval = ""
    if tree.dbh_lo_cm is not None and tree.dbh_hi_cm is not None:
        interval = f"90 % interval {shown_cm(tree.dbh_lo_cm)} – {shown_cm(tree.dbh_hi_cm)} cm; "
    how = f"{interval}{METHODS.get(tree.method, tree.method)}; E {tree.x:.2f}, N {tree.y:.2f} m"
    canvas.text(MARGIN, 47, how, 13, FAINT)
    x, y = MARGIN + 582, below
    canvas.text(x, y, "In numbers", 13, INK, True)
    y += 22
    for label, value in rows:
        if value:
            canvas.text(x, y, label, 12, FAINT)
            canvas.text(x + 264, y, value, 12, INK, False, "ra")
            canvas.line([(x, y + 16.5), (x + 264, y + 16.5)], LINE)
            y += 19
    reasons(canvas, WIDTH - MARGIN - _REASONS, below, tree)
    return canvas


def amount(value: float | None, form: str) -> str:
    """``form`` with a value in it; empty where there is none, or no finite one."""
    return "" if value is None or not np.isfinite(value) else form.format(value)


def dbh_words(tree: Tree) -> str:
    """``DBH 37.5 ± 0.3 cm``, or that there is none."""
    if tree.dbh_cm is None:
        return "no DBH"
    error = "" if tree.dbh_se_cm is None else f" ± {shown_cm(tree.dbh_se_cm)}"
    return f"DBH {shown_cm(tree.dbh_cm)}{error} cm"


def reasons(canvas: Canvas, x: float, y: float, tree: Tree) -> float:
    """Why it is not simply ``ok``, in words, with what to do; returns the y below."""
    title = "Why there is no DBH" if tree.qc_flag == "reject" else "What to look at"
    if not tree.reasons:
        return canvas.paragraph(x, y, _REASONS, "Nothing speaks against this diameter.", 13, FLAG_COLOURS["ok"], True)
    canvas.text(x, y, title, 13, FLAG_COLOURS[tree.qc_flag], True)
    y += 20
    for reason in tree.reasons:
        meaning, action = REASONS[reason]
        y = canvas.paragraph(x, y, _REASONS, f"{meaning[:1].upper()}{meaning[1:]}.", 12, INK, True)
        y = canvas.paragraph(x, y, _REASONS, f"What to do: {action}.", 12) + 5
    return y


class DiameterChart:
    """Diameter against height above the ground, in a box of the canvas, with the 90 % interval of the DBH."""

    def __init__(
        self, canvas: Canvas, box: Box, tree: Tree, seen: np.ndarray, stem: np.ndarray, high_m: float, more_cm: float
    ) -> None:
        """seen: (N, 4) height (m) and diameter, and from where to where it may be (cm). stem: (2, K) heights and
        diameters as fitted, dashed where they are no result. more_cm: to be shown too, or NaN."""
        self.canvas, self.tree = canvas, tree
        left, top, width, height = box
        self.left, self.top, self.width, self.height = left + 30, top + 44, width - 42, height - 82
        known = [tree.dbh_lo_cm, tree.dbh_hi_cm, *stem[1], *seen[:, 1], more_cm]
        shown_cm = [value for value in known if value is not None and np.isfinite(value)]
        low, high = (min(shown_cm), max(shown_cm)) if shown_cm else (0.0, 10.0)
        step = next(s for s in (1, 2, 5, 10, 20, 50, 100) if max(high - low, 4.0) / s <= 5 or s == 100)
        self.low_cm = max(step * np.floor(low / step - 0.2), 0.0)
        self.most_cm, self.high_m = step * np.ceil(high / step + 0.2), high_m
        canvas.text(left, top, "Diameter against height", 13, INK, True)
        canvas.text(left, top + 20, "height above the ground, m", 10, FAINT)
        for height_m in np.arange(0, high_m + 0.01, 1.0):
            y = self.y(height_m)
            canvas.line([(self.left, y), (self.left + self.width, y)], LINE)
            canvas.text(self.left - 5, y, f"{height_m:g}", 11, FAINT, at="rm")
        for d in np.arange(self.low_cm, self.most_cm + 0.01, step):
            canvas.line([(self.x(d), self.top + self.height), (self.x(d), self.top + self.height + 4)], FAINT)
            canvas.text(self.x(d), self.top + self.height + 6, f"{d:g}", 11, FAINT, at="ma")
        canvas.line([(self.left, self.y(0)), (self.left + self.width, self.y(0))], FAINT)
        canvas.text(self.left + self.width, self.top + self.height + 21, "diameter, cm", 11, FAINT, at="ra")
        for height_m, d_cm, *spread in seen:
            if self.low_cm <= d_cm <= self.most_cm:
                ends = [(self.x(end), self.y(height_m)) for end in np.clip(spread, self.low_cm, self.most_cm)]
                canvas.line(ends, (150, 150, 150))
                canvas.circle(self.x(d_cm), self.y(height_m), 3, INK, -1)
        if np.isfinite(stem).all():
            points = [(self.x(d_cm), self.y(height_m)) for height_m, d_cm in stem.T]
            (canvas.dashed if tree.dbh_cm is None else canvas.line)(points, BLUE, 2)
        self._breast_height()

    def x(self, d_cm: float) -> float:
        """Column of a diameter."""
        return self.left + self.width * (d_cm - self.low_cm) / (self.most_cm - self.low_cm)

    def y(self, height_m: float) -> float:
        """Row of a height."""
        return self.top + self.height * (1 - height_m / self.high_m)

    def _breast_height(self) -> None:
        tree, y = self.tree, self.y(self.tree.bh_m)
        self.canvas.dashed([(self.left, y), (self.left + self.width, y)], FAINT)
        left = tree.dbh_cm is not None and self.x(tree.dbh_cm) > self.left + 0.5 * self.width
        place = self.left + 2 if left else self.left + self.width - 2
        self.canvas.text(place, y - 3, f"breast height {tree.bh_m:g} m", 10, FAINT, at="ls" if left else "rs")
        if tree.dbh_cm is None:
            return
        colour = FLAG_COLOURS[tree.qc_flag]
        if tree.dbh_lo_cm is not None and tree.dbh_hi_cm is not None:
            self.canvas.line([(self.x(tree.dbh_lo_cm), y), (self.x(tree.dbh_hi_cm), y)], colour, 4)
        self.canvas.circle(self.x(tree.dbh_cm), y, 5, colour, -1)
