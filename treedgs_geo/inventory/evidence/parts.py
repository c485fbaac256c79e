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
#: Longest plot id on a sheet, letters.
_LONGEST_ID = 40


def headline(canvas: Canvas, tree: Tree) -> None:
    """Tree, plot, diameter and flag across the top."""
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
    below = f"{interval}{METHODS.get(tree.method, tree.method)}; E {tree.x:.2f}, N {tree.y:.2f} m"
    canvas.text(MARGIN, 47, below, 13, FAINT)


def begin_sheet(tree: Tree, below: int, high: int, rows: list[tuple[str, str]]) -> Canvas:
    """A sheet with its headline, and from ``below`` down its numbers and reasons; high: at least so much below."""
    canvas = Canvas(WIDTH, max(below + high, below + 24 + reason_lines(tree, 300)))
    headline(canvas, tree)
    canvas.text(MARGIN + 582, below, "In numbers", 13, INK, True)
    numbers(canvas, MARGIN + 582, below + 22, 264, rows)
    reasons(canvas, WIDTH - MARGIN - 300, below, 300, tree)
    return canvas


def dbh_words(tree: Tree) -> str:
    """``DBH 37.5 ± 0.3 cm``, or that there is none."""
    if tree.dbh_cm is None:
        return "no DBH"
    error = "" if tree.dbh_se_cm is None else f" ± {shown_cm(tree.dbh_se_cm)}"
    return f"DBH {shown_cm(tree.dbh_cm)}{error} cm"


def numbers(canvas: Canvas, x: float, y: float, width: float, rows: list[tuple[str, str]]) -> None:
    """A table of labels and values."""
    for label, value in rows:
        canvas.text(x, y, label, 12, FAINT)
        canvas.text(x + width, y, value, 12, INK, False, "ra")
        canvas.line([(x, y + 16.5), (x + width, y + 16.5)], LINE)
        y += 19


def reasons(canvas: Canvas, x: float, y: float, width: float, tree: Tree) -> float:
    """Why it is not simply ``ok``, in words, with what to do; returns the y below."""
    title = "Why there is no DBH" if tree.qc_flag == "reject" else "What to look at"
    if not tree.reasons:
        return canvas.paragraph(x, y, width, "Nothing speaks against this diameter.", 13, FLAG_COLOURS["ok"], True)
    canvas.text(x, y, title, 13, FLAG_COLOURS[tree.qc_flag], True)
    y += 20
    for reason in tree.reasons:
        meaning, action = REASONS[reason]
        y = canvas.paragraph(x, y, width, f"{meaning[:1].upper()}{meaning[1:]}.", 12, INK, True)
        y = canvas.paragraph(x, y, width, f"What to do: {action}.", 12) + 5
    return y


def reason_lines(tree: Tree, width: float) -> int:
    """Pixels that :func:`reasons` takes."""
    return int(reasons(Canvas(8, 8), 0, 0, width, tree)) + 8


class DiameterChart:
    """Diameter against height above the ground, in a box of the canvas."""

    def __init__(self, canvas: Canvas, box: Box, shown_cm: list[float], high_m: float = HIGH_M) -> None:
        """shown_cm: diameters that have to be in it."""
        self.canvas = canvas
        left, top, width, height = box
        self.left, self.top, self.width, self.height = left + 30, top + 44, width - 42, height - 82
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

    def x(self, d_cm: float) -> float:
        """Column of a diameter."""
        return self.left + self.width * (d_cm - self.low_cm) / (self.most_cm - self.low_cm)

    def y(self, height_m: float) -> float:
        """Row of a height."""
        return self.top + self.height * (1 - height_m / self.high_m)

    def curve(self, heights_m: np.ndarray, d_cm: np.ndarray, sure: bool = True) -> None:
        """The fitted stem; dashed where it is no result."""
        points = [(self.x(d), self.y(h)) for h, d in zip(heights_m, d_cm, strict=True)]
        (self.canvas.line if sure else self.canvas.dashed)(points, BLUE, 2)

    def points(self, heights_m: np.ndarray, d_cm: np.ndarray, spread_cm: np.ndarray | None = None) -> None:
        """Diameters seen; spread_cm: (N, 2) from and to."""
        for k, (height, d) in enumerate(zip(heights_m, d_cm, strict=True)):
            if not self.low_cm <= d <= self.most_cm:
                continue
            if spread_cm is not None:
                low, high = np.clip(spread_cm[k], self.low_cm, self.most_cm)
                self.canvas.line([(self.x(low), self.y(height)), (self.x(high), self.y(height))], (150, 150, 150))
            self.canvas.circle(self.x(d), self.y(height), 3, INK, -1)

    def breast_height(self, tree: Tree) -> None:
        """A line at breast height, and the 90 % interval of the DBH on it."""
        y = self.y(tree.bh_m)
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
