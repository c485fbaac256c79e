"""A picture to draw on: lines and circles by OpenCV (smooth, fast), text by Pillow."""

from __future__ import annotations

import importlib.util
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageColor, ImageDraw, ImageFont

from ...report import charts

Colour = tuple[int, ...]
Point = tuple[float, float]

INK, FAINT, LINE, PAPER = (34, 34, 34), (105, 105, 105), (205, 205, 205), (255, 255, 255)
#: The report's colours.
GREEN, AMBER, BLUE = map(ImageColor.getrgb, (charts.GREEN, charts.ORANGE, charts.BLUE))
FLAG_COLOURS = {flag: ImageColor.getrgb(colour) for flag, (colour, _) in charts.FLAGS.items()}

#: Fractional bits of OpenCV's coordinates.
_SHIFT = 4
#: Largest files, bytes, and the JPEG qualities tried for it.
MAX_BYTES = 80_000
_QUALITIES = (62, 46, 36, 28, 21, 14, 8)


#: Ends of the dashes of a circle of radius 1.
_TURN = np.column_stack([f(np.linspace(0, 2 * np.pi, 48, endpoint=False)) for f in (np.cos, np.sin)])


class Canvas:
    """An RGB picture, (height, width, 3) uint8; coordinates in pixels, x right, y down."""

    def __init__(self, width: int, height: int) -> None:
        self.pixels = np.full((height, width, 3), 255, np.uint8)
        self._texts: list[tuple[Point, str, int, Colour, bool, str]] = []

    def line(self, points: np.ndarray | list[Point], colour: Colour, width: int = 1) -> None:
        """An open polyline through (N, 2) points; points that are not finite break it."""
        points = np.asarray(points, float).reshape(-1, 2)
        keep = np.isfinite(points).all(axis=1)
        for part in np.split(points, np.flatnonzero(~keep)):
            part = part[np.isfinite(part).all(axis=1)]
            if len(part) > 1:
                cv2.polylines(self.pixels, [_fixed(part)], False, colour, width, cv2.LINE_AA, _SHIFT)

    def dashed(self, points: np.ndarray | list[Point], colour: Colour, width: int = 1, dash: float = 6.0) -> None:
        """The same, dashed."""
        points = np.asarray(points, float).reshape(-1, 2)
        pieces = []
        for a, b in zip(points[:-1], points[1:], strict=True):
            length = float(np.hypot(*(b - a)))
            if np.isfinite(length) and length > 0:
                starts = np.arange(0.0, length, 2 * dash)
                ends = np.stack([starts, np.minimum(starts + dash, length)], axis=1) / length
                pieces += list(_fixed((a + ends[:, :, None] * (b - a)).reshape(-1, 2)).reshape(-1, 2, 2))
        if pieces:
            cv2.polylines(self.pixels, pieces, False, colour, width, cv2.LINE_AA, _SHIFT)

    def circle(self, x: float, y: float, radius: float, colour: Colour, width: int = 1) -> None:
        """A circle; ``width`` -1 fills it."""
        if np.isfinite([x, y, radius]).all():
            centre, r = _fixed(np.array([[x, y]]))[0], int(round(max(radius, 0.5) * (1 << _SHIFT)))
            cv2.circle(self.pixels, (int(centre[0]), int(centre[1])), r, colour, width, cv2.LINE_AA, _SHIFT)

    def ring(self, x: float, y: float, radius: float, colour: Colour) -> None:
        """A dashed circle."""
        ends = _fixed(_TURN * radius + [x, y]).reshape(-1, 2, 2)
        cv2.polylines(self.pixels, list(ends), False, colour, 1, cv2.LINE_AA, _SHIFT)

    def dots(self, points: np.ndarray, colour: Colour, wide: int = 2, high: int = 2) -> None:
        """(N, 2) points as small rectangles; what lies outside the picture is left out."""
        at = np.asarray(points, float).reshape(-1, 2)
        at = np.floor(at[np.isfinite(at).all(axis=1)]).astype(int)
        rows, columns = self.pixels.shape[:2]
        for dx in range(wide):
            for dy in range(high):
                x, y = at[:, 0] + dx - wide // 2, at[:, 1] + dy - high // 2
                inside = (x >= 0) & (y >= 0) & (x < columns) & (y < rows)
                self.pixels[y[inside], x[inside]] = colour

    def box(self, x: float, y: float, width: float, height: float, colour: Colour, filled: bool = False) -> None:
        """A rectangle from its upper left corner."""
        a, b = (int(round(x)), int(round(y))), (int(round(x + width)) - 1, int(round(y + height)) - 1)
        cv2.rectangle(self.pixels, a, b, colour, -1 if filled else 1)

    def picture(self, x: int, y: int, pixels: np.ndarray) -> None:
        """Paste (h, w, 3) uint8 with its upper left corner at x, y; what lies outside is cut off."""
        rows, columns = self.pixels.shape[:2]
        part = pixels[: max(rows - y, 0), : max(columns - x, 0)]
        self.pixels[y : y + part.shape[0], x : x + part.shape[1]] = part

    def text(
        self, x: float, y: float, text: str, size: int = 13, colour: Colour = INK, bold: bool = False, at: str = "la"
    ) -> None:
        """One line of text. at: Pillow's anchor (``la`` = left and top, ``ma`` = middle, ``ra`` = right, ``lm`` ...).
        Line breaks and control characters are shown as blanks."""
        self._texts.append(((x, y), one_line(text), size, colour, bold, at))

    def paragraph(
        self, x: float, y: float, width: float, text: str, size: int = 13, colour: Colour = INK, bold: bool = False
    ) -> float:
        """Text broken into lines of at most ``width`` pixels; returns the y below it."""
        for row in wrapped(one_line(text), width, size, bold):
            self.text(x, y, row, size, colour, bold)
            y += round(1.3 * size)
        return y

    def finished(self) -> np.ndarray:
        """(height, width, 3) uint8 with its texts."""
        if self._texts:
            image = Image.fromarray(self.pixels)
            pen = ImageDraw.Draw(image)
            for place, text, size, colour, bold, anchor in self._texts:
                pen.text(place, text, colour, font=font(size, bold), anchor=anchor)
            self.pixels, self._texts = np.array(image), []
        return self.pixels

    def jpeg(self) -> bytes:
        """The picture as a JPEG of at most :data:`MAX_BYTES`, in the best quality tried that fits."""
        picture = cv2.cvtColor(self.finished(), cv2.COLOR_RGB2BGR)
        data = b""
        for quality in _QUALITIES:
            data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
            if len(data) <= MAX_BYTES:
                break
        return data


def one_line(text: object) -> str:
    """A text without line breaks and other control characters."""
    return "".join(letter if letter.isprintable() else " " for letter in str(text))


def shortened(text: object, most: int, front: bool = False) -> str:
    """At most ``most`` characters on one line, with an ellipsis for what is left out: at the end, or in front."""
    line = one_line(text)
    return line if len(line) <= most else "…" + line[1 - most :] if front else line[: most - 1] + "…"


def wrapped(text: str, width: float, size: int, bold: bool = False) -> list[str]:
    """Lines of at most ``width`` pixels; a word that is longer stands alone and is cut."""
    lines, line = [], ""
    for word in text.split():
        longer = f"{line} {word}".strip()
        if line and font(size, bold).getlength(longer) > width:
            lines.append(line)
            line = word
        else:
            line = longer
    return [*lines, line] if line else lines


@lru_cache(maxsize=32)
def font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    """DejaVu Sans, which lies among matplotlib's data; matplotlib itself would take a second to import."""
    found = importlib.util.find_spec("matplotlib")
    assert found is not None and found.origin is not None
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(str(Path(found.origin).parent / "mpl-data" / "fonts" / "ttf" / name), size)


def _fixed(points: np.ndarray) -> np.ndarray:
    """(N, 2) int32 with :data:`_SHIFT` fractional bits; far places are brought to where integers still hold them."""
    return np.clip(np.round(points * (1 << _SHIFT)), -(2**24), 2**24).astype(np.int32)
