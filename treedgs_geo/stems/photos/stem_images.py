"""What the photos show of a stem: straightened pictures along its axis, with the edges that count and those that do
not. Nothing is fitted here; it is what a person looks at to believe a diameter, or not to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .fit.edge_adjustment import EdgesFound, Sighting, edges_near
from .fit.edge_points import doubled
from .fit.null_model import ABOVE, BREAST
from .fit.photo_fit import PhotoFit
from .images.axis_patches import StemAxis
from .images.crops import PhotoStack
from .options import PhotoStemOptions
from .tuned import SEES, WINDOWS_PX


@dataclass(frozen=True)
class DrawnStem:
    """The stem that is drawn: axis, radius at breast height r0 (m) and its slope r1 (m/m), local frame. oval: what its
    section shows beside the radius, m (:class:`.fit.edge_adjustment.FineFit`)."""

    axis: StemAxis
    r0: float
    r1: float
    oval: tuple[float, float] = (0.0, 0.0)

    def beside(self, normal: np.ndarray) -> np.ndarray:
        """(N,) by how much the section is wider than its mean across directions (N, 2), half of it, metres."""
        return doubled(np.reshape(normal, (-1, 2))) @ np.array(self.oval)

    def section(self, times: float = 1.0) -> np.ndarray:
        """(73, 2) closed outline of the section at breast height, metres east and north of the axis; its oval ``times``
        as large."""
        turn = np.linspace(0.0, 2 * np.pi, 73)
        normal = np.column_stack([np.cos(turn), np.sin(turn)])
        along = np.column_stack([-normal[:, 1], normal[:, 0]])
        cosine, sine = doubled(normal).T
        grows = 2 * times * (self.oval[1] * cosine - self.oval[0] * sine)
        return (self.r0 + times * self.beside(normal))[:, None] * normal + grows[:, None] * along

    def radius(self, height_m: np.ndarray) -> np.ndarray:
        """(N,) radius at heights above the axis' ground, metres."""
        return np.maximum(self.r0 + self.r1 * (np.asarray(height_m, float) - self.axis.bh_m), 0.0)


@dataclass(frozen=True)
class StemShown:
    """A stem in its photos. seen: (V,) probability that each photo sees it. azimuth: (V,) radians from east, from the
    stem to the camera. away_m: (V,) horizontal distance of the camera. support: (V,) edges that count, of the lesser
    side. edges: all of them."""

    shape: DrawnStem
    seen: np.ndarray
    azimuth: np.ndarray
    away_m: np.ndarray
    support: np.ndarray
    edges: EdgesFound

    @property
    def sees(self) -> np.ndarray:
        """(V,) bool: counts as seeing the stem."""
        return self.seen >= SEES

    @property
    def reading_cm(self) -> np.ndarray:
        """(V,) the diameter at breast height that each photo alone reads, NaN without both edges."""
        return 200 * (self.shape.r0 + self.shape.beside(self.edges.normal) + self.edges.radius_m)

    @property
    def worst(self) -> int | None:
        """Index of the photo that counts and reads the farthest from the outline; ``None`` where none can be read."""
        off = np.where(self.sees, np.abs(self.edges.radius_m), np.nan)
        return int(np.nanargmax(off)) if np.isfinite(off).any() else None

    def diameters(self) -> np.ndarray:
        """(K, 4) height above the ground (m), median diameter there over the photos, and its quartiles (cm); less what
        the oval shows to each photo."""
        e = self.edges
        rows = []
        used = (e.used >= SEES) & self.sees[e.view]
        block = np.round(e.height_m / 0.1).astype(int)
        for k in np.unique(block[used]):
            sides = []
            for side in (0, 1):
                here = used & (block == k) & (e.side == side)
                place = np.full(len(self.seen), np.nan)
                place[e.view[here]] = e.across_m[here] - e.offset_m[e.view[here]]
                sides.append(place)
            found = 100 * (sides[1] - sides[0]) / e.widen - 200 * self.shape.beside(e.normal)
            found = found[np.isfinite(found)]
            if len(found) >= 2:
                low, middle, high = np.percentile(found, [25, 50, 75])
                rows.append((float(e.height_m[used & (block == k)].mean()), middle, low, high))
        return np.array(rows).reshape(-1, 4)


def look_at(
    stack: PhotoStack, fit: PhotoFit, shape: DrawnStem, known: np.ndarray, options: PhotoStemOptions
) -> StemShown:
    """Look at a fitted stem again in ``stack``, whose photos it may name in another order or in part. shape: what to
    draw (the fit's own, or another method's). known: (K, 10) rows of the other measured stems."""
    of_name = dict(zip(fit.photos, fit.seen, strict=True))
    seen = np.array([of_name.get(view.name, 0.0) for view in stack.views])
    band = (ABOVE if fit.carried else BREAST).fine
    edges = edges_near(
        stack,
        shape.axis,
        shape.r0,
        shape.r1,
        Sighting(seen, known),
        band,
        options.offset_sd_px,
        WINDOWS_PX[-1],
        shape.oval,
    )
    mass = np.bincount(edges.view * 2 + edges.side, edges.used, 2 * len(stack)).reshape(-1, 2)
    offset = stack.centre[:, :2] - shape.axis.p
    return StemShown(shape, seen, np.arctan2(offset[:, 1], offset[:, 0]), np.hypot(*offset.T), mass.min(axis=1), edges)


def choose_photos(shown: StemShown, inside: np.ndarray, most: int) -> list[int]:
    """Indices of up to ``most`` photos to look at, clockwise from north: spread over directions, the clearer ones
    first, and the worst one that counts. inside: (V,) bool, photos whose crop holds the stem. Where hardly any photo
    sees the stem, the likeliest others come in."""
    clear = shown.seen * (0.3 + shown.support / max(float(shown.support.max(initial=0.0)), 1.0))
    chosen: list[int] = [] if shown.worst is None or not inside[shown.worst] else [shown.worst]
    for group in (inside & shown.sees, inside & ~shown.sees):
        left = [int(v) for v in np.flatnonzero(group) if v not in chosen]
        while left and len(chosen) < most:
            gap = np.array([_gap(shown.azimuth[v], shown.azimuth[chosen]) for v in left])
            best = left[int(np.argmax(gap * (clear[left] + 1e-3)))]
            chosen.append(best)
            left.remove(best)
    return sorted(chosen, key=lambda v: float((np.pi / 2 - shown.azimuth[v]) % (2 * np.pi)))


def _gap(azimuth: float, others: np.ndarray) -> float:
    """Radians to the nearest of the others, half a turn where there is none."""
    if len(others) == 0:
        return float(np.pi)
    return float(np.abs((others - azimuth + np.pi) % (2 * np.pi) - np.pi).min())


def straightened(
    stack: PhotoStack, v: int, shown: StemShown, low_m: float, high_m: float, half_m: float, px_m: float
) -> np.ndarray | None:
    """(rows, columns, 3) uint8 RGB: photo ``v`` along the stem, as if it stood upright: row 0 is ``high_m`` above the
    ground, a pixel is ``px_m`` metres, ``half_m`` to either side across the view. ``None`` where the photo does not
    hold the stem at breast height."""
    import cv2

    axis, normal = shown.shape.axis, shown.edges.normal[v]
    rows, columns = int(round((high_m - low_m) / px_m)), int(round(2 * half_m / px_m))
    size, corner = stack.shape[v], stack.corner[v]
    if not normal.any():
        return None
    heights = high_m - (np.arange(rows) + 0.5) * px_m
    middle = axis.at(heights)
    across = np.array([*normal, 0.0]) * half_m
    # The direction across the view points to the left of who looks.
    ends = [stack.views[v].project(middle + sign * across)[0] - 0.5 - corner[::-1] for sign in (1, -1)]
    at_breast = 0.5 * (ends[0] + ends[1])[int(np.argmin(np.abs(heights - axis.bh_m)))]
    if not (np.isfinite(at_breast).all() and (at_breast > 0).all() and (at_breast < size[::-1] - 1).all()):
        return None
    share = ((np.arange(columns) + 0.5) / columns)[None, :, None]
    places = (ends[0][:, None] * (1 - share) + ends[1][:, None] * share).astype(np.float32)
    first = stack.start[v]
    photo = stack.pixels[first : first + 3 * size[0] * size[1]].reshape(size[0], size[1], 3)
    picture = cv2.remap(
        photo,
        np.ascontiguousarray(places[..., 0]),
        np.ascontiguousarray(places[..., 1]),
        cv2.INTER_CUBIC,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(60, 60, 60),
    )
    return np.ascontiguousarray(picture[:, :, ::-1])
