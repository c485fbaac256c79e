"""Ground control: checkered plates on open ground, surveyed, and marked in the photos that see them."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from treedgs_geo.reconstruction.cameras import View

from . import files
from .foliage import Faces
from .layout import Layout
from .light import SkyField
from .scene import PlantedStem
from .terrain import Ground
from .textures import GroundTexture, encode
from .world import World

#: Side of a plate, m, and the albedo of its light and dark quarters.
PLATE_M = 0.4
LIGHT_ALBEDO, DARK_ALBEDO = 0.6, 0.03
#: What grows nearer to a plate's middle is cleared away, m.
CLEARED_M = 0.6
#: Distance of a plate from the nearest stem, m.
STEM_GAP_M = 1.0
#: Standard deviations of the survey (E, N, h), m, and of a mark, px.
SURVEY_SD_M = (0.01, 0.01, 0.02)
MARK_SD_PX = 0.4
#: A plate is marked where it is at least this many pixels across and this far inside the photo.
MIN_PLATE_PX, MARGIN_PX = 8.0, 6.0
#: Of nine spots on the middle half of a plate so many must be seen, the very middle among them.
MIN_FREE = 7


@dataclass(frozen=True)
class Plates:
    """places: (n, 3) true middles, local m. heading_rad: (n,) how they are turned."""

    places: np.ndarray
    heading_rad: np.ndarray

    @property
    def labels(self) -> list[str]:
        """Names, GCP01 ..."""
        return [f"GCP{k:02d}" for k in range(1, len(self.places) + 1)]


def lay_out(
    rng: np.random.Generator, count: int, layout: Layout, radius_m: float, ground: Ground, stems: list[PlantedStem],
    sky: SkyField,
) -> Plates:  # fmt: skip
    """Plates about the plots (0.7 radius to 4 m outside), where the crowns are open, far from one another."""
    tries = 200 * count
    centre = layout.centres[rng.integers(len(layout.centres), size=tries)]
    reach, turn = rng.uniform(0.7 * radius_m, radius_m + 4, tries), rng.uniform(0, 2 * np.pi, tries)
    xy = centre + reach[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    gap = cKDTree(np.array([stem.axis[0, :2] for stem in stems])).query(xy)[0] if stems else np.full(tries, np.inf)
    xy = xy[np.argsort(-np.minimum(gap, STEM_GAP_M), kind="stable")[: tries // 2]]
    open_sky = sky(np.column_stack([xy, ground.height(xy)]))
    xy = xy[np.argsort(-open_sky, kind="stable")[: tries // 8]]
    chosen = [0]
    while len(chosen) < count:
        chosen.append(int(cdist(xy, xy[chosen]).min(axis=1).argmax()))
    xy = xy[chosen]
    return Plates(np.column_stack([xy, ground.height(xy)]), rng.uniform(0, np.pi / 2, count))


def cleared(faces: Faces, plates: Plates) -> Faces:
    """The faces without shrubs, grass, sticks and logs on and beside the plates."""
    away = cKDTree(plates.places[:, :2]).query(faces.corners.mean(axis=1)[:, :2])[0]
    keep = (faces.owner >= 0) | (away > CLEARED_M)
    return replace(faces, **{item.name: getattr(faces, item.name)[keep] for item in fields(faces)})


def painted(texture: GroundTexture, plates: Plates, sub: int = 5) -> GroundTexture:
    """The litter with the plates on it; ``sub``: samples a texel each way."""
    colour = texture.colour.copy()
    half = int(np.ceil(PLATE_M / np.sqrt(2) / texture.step)) + 1
    fine = (np.arange(2 * half * sub) + 0.5) / sub
    for (x, y, _), heading in zip(plates.places, plates.heading_rad, strict=True):
        j, i = (int(np.floor((value - texture.low) / texture.step)) - half for value in (x, y))
        px, py = np.meshgrid(texture.low + (j + fine) * texture.step - x, texture.low + (i + fine) * texture.step - y)
        u = np.cos(heading) * px + np.sin(heading) * py
        v = np.cos(heading) * py - np.sin(heading) * px
        inside = np.maximum(np.abs(u), np.abs(v)) <= PLATE_M / 2
        albedo = np.where(u * v > 0, LIGHT_ALBEDO, DARK_ALBEDO)
        share, light = (_shrink(part, sub)[..., None] for part in (inside, np.where(inside, albedo, 0)))
        window = (slice(i, i + 2 * half), slice(j, j + 2 * half))
        below = (colour[window] / 255.0) ** 2
        colour[window] = encode(below * (1 - share) + light)
    return replace(texture, colour=colour)


def _shrink(image: np.ndarray, times: int) -> np.ndarray:
    """Means over squares of ``times`` by ``times``."""
    n = len(image) // times
    return image.reshape(n, times, n, times).mean(axis=(1, 3))


def sees(world: World, view: View, plate: np.ndarray) -> bool:
    """Whether the photo shows the middle of a plate (3,): large enough, inside, and little in the way."""
    pixel, depth = view.project(plate[None])
    if not (depth[0] > 0 and view.contains(pixel, MARGIN_PX)[0]):
        return False
    if view.camera.fx * PLATE_M / depth[0] < MIN_PLATE_PX:
        return False
    quarter = PLATE_M / 4
    offsets = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [1, -1], [-1, 1], [-1, -1]]) * quarter
    xy = plate[:2] + offsets
    spots = np.column_stack([xy, world.ground.height(xy)])
    centre = view.at_point(plate).centre
    distance, primitive = world.first_hits(centre, spots - centre)
    on_ground = (primitive >= 0) & (primitive < world.ground_faces)
    free = on_ground & (np.abs(distance - 1) * depth[0] < 0.1)
    return bool(free[0] and free.sum() >= MIN_FREE)


def write_control(
    folder: Path, rng: np.random.Generator, plates: Plates, world: World, geo: files.Georeference, views: list[View]
) -> int:
    """``gcp_list.txt`` as a crew would bring it and ``truth/control_points.csv``; returns the number of marks.

    Layout of OpenDroneMap: the CRS, then ``x y z px py image label``; the middle of the first pixel is (0.5, 0.5).
    """
    surveyed = geo.project(plates.places) + rng.normal(0, SURVEY_SD_M, plates.places.shape)
    lines, table = [f"EPSG:{files.EPSG}"], []
    for label, plate, (east, north, height) in zip(plates.labels, plates.places, surveyed, strict=True):
        seen = 0
        for view in views:
            if sees(world, view, plate):
                u, v = view.project(plate[None])[0][0] + rng.normal(0, MARK_SD_PX, 2)
                lines.append(f"{east:.3f} {north:.3f} {height:.3f} {u:.2f} {v:.2f} {view.name} {label}")
                seen += 1
        table.append([label, *(f"{value:.4f}" for value in (*geo.project(plate)[0], *plate)), seen])
    (folder / "gcp_list.txt").write_text("\n".join(lines) + "\n", encoding="ascii")
    columns = ["label", "E", "N", "h", "x", "y", "z", "n_photos"]
    files.write_csv(folder / "truth" / "control_points.csv", columns, table)
    return len(lines) - 1
