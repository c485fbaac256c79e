"""The sheet of a stem measured in photos: what each direction shows, and what was made of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...stems.photos.fit.null_model import ABOVE
from ...stems.photos.fit.photo_fit import PhotoFit
from ...stems.photos.images.crops import PhotoStack
from ...stems.photos.stem_images import StemShown, choose_photos, straightened
from ...stems.photos.tuned import SEES
from ...stems.quality.tree import Tree
from .canvas import AMBER, BLUE, FAINT, FLAG_COLOURS, GREEN, INK, LINE, PAPER, Canvas, Colour, shortened
from .parts import HIGH_M, LOW_M, MARGIN, WIDTH, Box, DiameterChart, amount, begin_sheet

#: Most and fewest photos in a row, pixels between them, and the row's place and height.
MAX_PHOTOS, FEWEST_PHOTOS = 9, 6
_GAP, _LEFT, _TOP, _HIGH = 6, 44, 92, 384
#: Around a stem as much is shown: its diameters on either side, at least (m).
_BESIDE_RADII, _BESIDE_M = 2.4, 0.45
#: Radius of the section on the plan, pixels, and how many times its oval is drawn, at most.
_SECTION_PX, _OVAL_TIMES = 20.0, 5.0
#: Colours on the photos: edges that count, edges left out, the outline; on the plan: photos that do not see the stem.
_USED, _LEFT_OUT, _OUTLINE, _HIDDEN = (0, 230, 255), (255, 120, 200), (255, 235, 59), (150, 150, 150)


@dataclass(frozen=True)
class PhotoEvidence:
    """All that a sheet of a stem in photos says."""

    tree: Tree
    fit: PhotoFit
    shown: StemShown
    stack: PhotoStack


def photo_sheet(evidence: PhotoEvidence) -> Canvas:
    """Draw the sheet."""
    tree = evidence.tree
    below = _TOP + _HIGH + 52
    canvas = begin_sheet(tree, below, 308, _rows(evidence))
    photos, half_m, px_m = _layout(evidence)
    _photo_row(canvas, evidence, photos, half_m, px_m)
    _directions(canvas, evidence, photos, (MARGIN, below, 280, 300))
    _diameters(canvas, evidence, (MARGIN + 296, below, 270, 300))
    return canvas


def _top_m(fit: PhotoFit) -> float:
    """The highest place shown, m: the part of the stem that was measured is in it."""
    return ABOVE.fine[1] + 0.1 if fit.carried else HIGH_M


def _layout(evidence: PhotoEvidence) -> tuple[list[int], float, float]:
    """Photos to show, metres to either side of the stem, metres a pixel."""
    shown, stack = evidence.shown, evidence.stack
    half_m = max(_BESIDE_RADII * shown.shape.r0, _BESIDE_M)
    room = WIDTH - MARGIN - _LEFT + _GAP
    px_m = max((_top_m(evidence.fit) - LOW_M) / _HIGH, 2 * half_m / (room / FEWEST_PHOTOS - _GAP))
    most = int(np.clip(room // (2 * half_m / px_m + _GAP), FEWEST_PHOTOS, MAX_PHOTOS))
    inside = np.array([_holds(stack, v, shown) for v in range(len(stack))], bool)
    photos = choose_photos(shown, inside, most)
    # Fewer photos than there is room for: each may be wider.
    width = min((room / max(len(photos), FEWEST_PHOTOS) - _GAP) * px_m, 3.0 * half_m)
    return photos, max(half_m, 0.5 * width), px_m


def _holds(stack: PhotoStack, v: int, shown: StemShown) -> bool:
    if not shown.edges.normal[v].any():
        return False
    axis = shown.shape.axis
    pixels, _ = stack.views[v].project(axis.at(np.array([0.5, axis.bh_m, 2.5])))
    place = pixels - stack.corner[v][::-1]
    return bool(np.isfinite(place).all() and (place > 1).all() and (place < stack.shape[v][::-1] - 2).all())


def _photo_row(canvas: Canvas, evidence: PhotoEvidence, photos: list[int], half_m: float, px_m: float) -> None:
    shown, stack, tree = evidence.shown, evidence.stack, evidence.tree
    high_m, top_m = LOW_M + _HIGH * px_m, _top_m(evidence.fit)
    y_of = lambda h: _TOP + (high_m - np.asarray(h, float)) / px_m  # noqa: E731
    yellow = (
        "Yellow: the outline fitted." if tree.dbh_cm is not None else "Dashed yellow: the outline tried, no result."
    )
    words = (
        f"The stem from each direction, set upright.  {yellow}  Light blue: edges that count.  Pink: edges left out."
    )
    canvas.text(MARGIN, _TOP - 22, words, 12, FAINT)
    for height in np.arange(0, high_m + 0.01, 1.0):
        canvas.text(_LEFT - 6, float(y_of(height)), f"{height:g} m", 11, FAINT, at="rm")
    if not photos:
        canvas.paragraph(_LEFT + 10, _TOP + 20, 600, "No photo holds this stem as a whole.", 14)
    crops = {v: straightened(stack, v, shown, LOW_M, high_m, half_m, px_m) for v in photos}
    gain = _gain([crop for crop in crops.values() if crop is not None])
    x = float(_LEFT)
    for number, v in enumerate(photos, start=1):
        crop = crops[v]
        width = 2 * half_m / px_m
        if crop is not None:
            canvas.picture(int(x), _TOP, gain[crop])
        _on_photo(canvas, shown, v, int(x) + 0.5 * width, y_of, px_m, top_m, tree.dbh_cm is not None)
        canvas.box(int(x), _TOP, width, _HIGH, LINE)
        _caption(canvas, evidence, v, number, x + 0.5 * width)
        x += width + _GAP
    end = x - _GAP
    at = float(y_of(tree.bh_m))
    canvas.dashed([(_LEFT, at), (end, at)], PAPER, 1, 4)
    canvas.text(_LEFT - 6, at, "BH", 11, INK, True, "rm")
    _scale_bar(canvas, _LEFT + 8, _TOP + _HIGH - 10, px_m, half_m)


def _gain(crops: list[np.ndarray]) -> np.ndarray:
    """(256,) tones that make dark photos readable, the same for all."""
    if not crops:
        return np.arange(256, dtype=np.uint8)
    sample = np.concatenate([crop[::4, ::4].ravel() for crop in crops])
    low, high = np.percentile(sample, [1, 99])
    factor = min(235.0 / max(high - 0.6 * low, 1.0), 2.2)
    return np.clip((np.arange(256) - 0.6 * low) * factor, 0, 255).astype(np.uint8)


def _on_photo(
    canvas: Canvas, shown: StemShown, v: int, middle: float, y_of, px_m: float, top_m: float, measured: bool
) -> None:
    """Outline and edges; x grows to the right, which is against the direction across the view."""
    edges, axis = shown.edges, shown.shape.axis
    here = edges.view == v
    heights = np.arange(0.2, top_m - 0.05, 0.1)
    beside = float(shown.shape.beside(edges.normal[v])[0])
    half = edges.widen[v] * (shown.shape.radius(heights) + beside)
    for side in (-1.0, 1.0):
        outline = np.column_stack([middle - (edges.offset_m[v] + side * half) / px_m, y_of(heights)])
        (canvas.line if measured else canvas.dashed)(outline, _OUTLINE)
    counts = _counts(shown)
    for chosen, colour, wide in ((here & ~counts, _LEFT_OUT, 3), (here & counts, _USED, 7)):
        points = np.column_stack([middle - edges.across_m[chosen] / px_m, y_of(edges.height_m[chosen])])
        canvas.dots(points, colour, wide)
    for side in (-1.0, 1.0):
        x = middle - (edges.offset_m[v] + side * edges.widen[v] * (shown.shape.r0 + beside)) / px_m
        y = float(y_of(axis.bh_m))
        canvas.line([(x, y), (x - 9 * side, y)], PAPER, 2)


def _counts(shown: StemShown) -> np.ndarray:
    return (shown.edges.used >= SEES) & shown.sees[shown.edges.view]


def _caption(canvas: Canvas, evidence: PhotoEvidence, v: int, number: int, middle: float) -> None:
    shown = evidence.shown
    y = _TOP + _HIGH + 5
    reading, worst = shown.reading_cm[v], shown.worst == v
    colour: Colour
    if not shown.sees[v]:
        said, colour = "hidden or unclear", FAINT
    elif np.isfinite(reading):
        said, colour = f"{'worst: ' if worst else ''}{reading:.1f} cm", AMBER if worst else INK
    else:
        said, colour = "one edge only", FAINT
    canvas.text(middle, y, f"{number}  {compass(shown.azimuth[v])}", 12, INK, True, "ma")
    canvas.text(middle, y + 15, said, 11, colour, worst, "ma")
    canvas.text(middle, y + 29, shortened(evidence.stack.views[v].name.rpartition("/")[2], 18, True), 9, FAINT, at="ma")


def compass(azimuth: float) -> str:
    """``from NE``: azimuth in radians from east, counter-clockwise."""
    names = ("E", "NE", "N", "NW", "W", "SW", "S", "SE")
    return f"from {names[int(np.round(azimuth / (np.pi / 4))) % 8]}"


def _scale_bar(canvas: Canvas, x: float, y: float, px_m: float, half_m: float) -> None:
    length_cm = next(c for c in (100, 50, 20, 10) if c / 100 <= half_m or c == 10)
    width = length_cm / 100 / px_m
    canvas.box(x - 3, y - 18, width + 6, 24, (40, 40, 40), filled=True)
    canvas.line([(x, y), (x + width, y)], PAPER, 3)
    canvas.text(x + width / 2, y - 4, f"{length_cm} cm", 11, PAPER, at="ms")


def _directions(canvas: Canvas, evidence: PhotoEvidence, photos: list[int], box: Box) -> None:
    """Where the photos were taken, seen from above: filled = sees the stem, hollow = does not."""
    left, top, width, _ = box
    shown = evidence.shown
    sees, looked = shown.sees, len(shown.seen)
    canvas.text(left, top, "Where the photos were taken", 13, INK, True)
    middle, centre = left + 0.5 * width - 6, top + 144
    reach = 104.0
    far = float(shown.away_m.max(initial=1.0))
    step = next(s for s in (5, 10, 20, 50, 100, 1000) if far / s <= 3 or s == 1000)
    for ring in np.arange(step, far * 1.05, step):
        canvas.circle(middle, centre, reach * ring / far, LINE)
        canvas.text(middle + 2, centre + reach * ring / far + 1, f"{ring:g} m", 9, FAINT, at="ls")
    canvas.line([(middle, centre - reach - 14), (middle, centre - reach - 2)], FAINT, 2)
    canvas.text(middle + 5, centre - reach - 14, "N", 12, FAINT, True)
    _section(canvas, evidence, middle, centre, left, top)
    out = np.column_stack([np.cos(shown.azimuth), -np.sin(shown.azimuth)])
    place = np.array([middle, centre]) + (reach * shown.away_m / far)[:, None] * out
    for v in np.argsort(sees):
        x, y = place[v].tolist()
        canvas.circle(x, y, 4, BLUE if sees[v] else _HIDDEN, -1 if sees[v] else 1)
    for number, v in enumerate(photos, start=1):
        x, y = (place[v] + 11 * out[v]).tolist()
        canvas.text(x, y, str(number), 11, INK, True, "mm")
    canvas.circle(left + 6, top + 274, 4, BLUE, -1)
    canvas.text(left + 16, top + 274, f"counts ({int(sees.sum())})", 11, INK, at="lm")
    canvas.circle(left + 106, top + 274, 4, _HIDDEN)
    canvas.text(left + 116, top + 274, f"hidden or unclear ({looked - int(sees.sum())})", 11, INK, at="lm")


def _section(canvas: Canvas, evidence: PhotoEvidence, x: float, y: float, left: float, top: float) -> None:
    """The stem on the plan: a dot, or its oval section with the oval drawn larger."""
    colour, shape = FLAG_COLOURS[evidence.tree.qc_flag], evidence.shown.shape
    canvas.circle(x, y, 5, colour, -1)
    if shape.oval == (0.0, 0.0):
        return
    # So much larger that it is seen, as long as no side caves in.
    times = float(np.clip(0.25 * shape.r0 / np.hypot(*shape.oval), 1.0, _OVAL_TIMES))
    outline = shape.section(times) * (_SECTION_PX / shape.r0)
    canvas.line(np.column_stack([x + outline[:, 0], y - outline[:, 1]]), colour, 2)
    canvas.text(left, top + 292, f"round the dot: the section, its oval {times:.0f} times as large", 11, INK, at="lm")


def _diameters(canvas: Canvas, evidence: PhotoEvidence, box: Box) -> None:
    shown, tree, fit = evidence.shown, evidence.tree, evidence.fit
    top_m = _top_m(fit)
    heights = np.linspace(0.3, top_m - 0.1, 9)
    fitted, seen, outline_cm = 200 * shown.shape.radius(heights), shown.diameters(), fit.evidence.outline_cm
    chart = DiameterChart(canvas, box, tree, seen[:, :4], np.array([heights, fitted]), top_m, outline_cm)
    if np.isfinite(outline_cm):
        x, y = chart.x(outline_cm), chart.y(fit.axis.bh_m)
        canvas.line([(x, y - 9), (x, y + 9)], GREEN, 2)
        canvas.text(x, y + 11, "silhouette", 10, GREEN, at="ma")


def _rows(evidence: PhotoEvidence) -> list[tuple[str, str]]:
    tree, fit, shown = evidence.tree, evidence.fit, evidence.shown
    counts = _counts(shown)
    reading = shown.reading_cm[shown.sees & np.isfinite(shown.reading_cm)]
    several = "{:.1f} – {:.1f} cm".format(*np.percentile(reading, [10, 90])) if len(reading) > 1 else ""
    tried = tree.dbh_cm is None and np.isfinite(fit.se_cm)
    apart = tree.dbh_cm is not None and abs(tree.dbh_cm - fit.dbh_cm) > 0.05
    oval_cm = 200 * float(np.hypot(*shown.shape.oval))
    widest = ""
    if oval_cm > 0 and tree.dbh_cm is not None:
        widest = f"{tree.dbh_cm + oval_cm:.1f}, {tree.dbh_cm - oval_cm:.1f} cm"
    return [
        ("outline tried (not a result)", f"{fit.dbh_cm:.1f} cm" if tried else ""),
        ("photos that count, of all", f"{int(shown.sees.sum())} of {len(shown.seen)}"),
        ("photos that see it clearly", f"{tree.n_views or 0}"),
        ("directions they span", f"{tree.arc_deg or 0:.0f}°"),
        ("edges that count, left out", f"{int(counts.sum())}, {int((~counts).sum())}"),
        ("edges off the outline (rms)", amount(fit.evidence.rms_px, "{:.2f} px")),
        ("photos one by one (8 of 10)", several),
        ("edges alone", f"{fit.dbh_cm:.1f} cm" if apart else ""),
        ("silhouette alone", amount(fit.evidence.outline_cm, "{:.1f} cm")),
        ("widest, narrowest", widest),
        ("lean", amount(tree.lean_deg, "{:.1f}°")),
        ("taper", amount(tree.taper_cm_m, "{:+.2f} cm a metre")),
        ("run", tree.run_id or "–"),
    ]
