"""The reconstruction on disk: a COLMAP model in the local frame, ``frame.json`` and ``report.json``."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from ..core.crs import LocalFrame
from ..core.errors import InputError
from ..core.files import atomic_folder, read_json, write_json
from ..core.machine import available_threads
from ..geotags.sharpness import MAX_READERS
from .cameras import View
from .colmap import camera_from_colmap, to_colmap
from .tracks import Block

FRAME = "frame.json"
REPORT = "report.json"
CAMERA = "camera.json"
#: COLMAP's files of a model.
MODEL_FILES = ("cameras.bin", "images.bin", "points3D.bin", "rigs.bin", "frames.bin")
#: Colours are read from photos wider than this at a quarter of their size.
LARGE_PX = 3000


#: A sparse point that so many photos show is checked; where so few are, those of two photos count too.
CHECKED_PHOTOS, MIN_CHECKED_SHARE, MIN_CHECKED = 3, 0.2, 100


def save_model(
    sfm_folder: Path,
    block: Block,
    names: list[str],
    paths: list[Path],
    flights: np.ndarray,
    frame: LocalFrame,
    report: dict,
    calibration: dict,
) -> None:
    """Write the folder as a whole: the old one is replaced only when the new one is complete.

    calibration: ``camera.json``, what :func:`.calibration.calibration_of` takes for another flight of the camera.
    """
    model = to_colmap(block, names, point_colours(block, paths))
    model.update_point_3d_errors()
    with atomic_folder(sfm_folder) as temporary:
        model.write_binary(str(temporary))
        frame.save(temporary / FRAME)
        write_json(temporary / CAMERA, calibration)
        posed = np.flatnonzero(block.is_posed)
        more: dict = {"flights": {names[i]: int(flights[i]) for i in posed}}
        travel = block.sensor.travel_m
        if travel.any():
            more["readout_travel_m"] = {names[i]: [round(float(v), 5) for v in travel[i]] for i in posed}
        write_json(temporary / REPORT, {**report, **more})


def point_colours(block: Block, paths: list[Path]) -> np.ndarray:
    """(P, 3) uint8: mean colour of each point over the photos that see it."""
    from .images import load_image

    total, count = np.zeros((len(block.points), 3)), np.zeros(len(block.points))
    observed = np.floor(block.observed()).astype(int)
    rows = [np.flatnonzero(block.image == i) for i in range(len(paths))]
    reduced = 4 if block.camera.width > LARGE_PX else 1

    def colours(i: int) -> np.ndarray:
        if not len(rows[i]):
            return np.zeros((0, 3), np.uint8)
        pixels = load_image(paths[i], reduced)
        u = np.clip(observed[rows[i], 0] // reduced, 0, pixels.shape[1] - 1)
        v = np.clip(observed[rows[i], 1] // reduced, 0, pixels.shape[0] - 1)
        return pixels[v, u]

    with ThreadPoolExecutor(min(MAX_READERS, available_threads())) as workers:
        for own, seen in zip(rows, workers.map(colours, range(len(paths))), strict=True):
            np.add.at(total, block.point[own], seen.astype(float))
            np.add.at(count, block.point[own], 1)
    return np.clip(total / np.maximum(count, 1)[:, None], 0, 255).astype(np.uint8)


def _open(sfm_folder: Path):
    import pycolmap

    folder = Path(sfm_folder)
    if not (folder / "images.bin").exists() and not (folder / "images.txt").exists():
        raise InputError(
            f"{folder}: holds no COLMAP model (cameras, images, points3D); run 'treedgs reconstruct' first."
        )
    try:
        return pycolmap.Reconstruction(str(folder))
    except (ValueError, RuntimeError, IndexError) as problem:
        raise InputError(
            f"{folder}: the COLMAP model cannot be read ({problem}); run 'treedgs reconstruct' again."
        ) from None


def load_views(
    sfm_folder: Path, photos_folder: Path, files: Mapping[str, Path] | None = None
) -> tuple[LocalFrame, list[View]]:
    """The registered photos, sorted by name, in the local frame.

    files: name -> photo where it is not called so in the folder any more.

    Raises:
        InputError: no model, no ``frame.json``, a photo that is gone, an unsupported camera model.
    """
    model = _open(sfm_folder)
    frame = LocalFrame.load(Path(sfm_folder) / FRAME)
    report = read_json(Path(sfm_folder) / REPORT) if (Path(sfm_folder) / REPORT).exists() else {}
    flights, travels = report.get("flights", {}), report.get("readout_travel_m", {})
    views = []
    for image in model.images.values():
        if not image.has_pose:
            continue
        path = (files or {}).get(image.name, Path(photos_folder) / image.name)
        if not path.is_file():
            raise InputError(
                f"{path}: is part of the reconstruction but not there; give the photo folder that was reconstructed."
            )
        try:
            camera = camera_from_colmap(model.camera(image.camera_id))
        except ValueError as problem:
            raise InputError(f"{sfm_folder}: {problem}.") from None
        pose = image.cam_from_world().matrix()
        flight, travel = int(flights.get(image.name, 0)), np.array(travels.get(image.name, np.zeros(3)), float)
        views.append(View(image.name, path, camera, pose[:, :3].copy(), pose[:, 3].copy(), flight, travel))
    return frame, sorted(views, key=lambda view: view.name)


def load_points(sfm_folder: Path) -> np.ndarray:
    """(P, 3) sparse points in the local frame that three photos show; all, where these are few. What two photos match
    wrongly along an epipolar line lies metres off, and no third one contradicts it.

    Raises:
        InputError: no model.
    """
    return load_coloured_points(sfm_folder)[0]


def load_coloured_points(sfm_folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """The points of :func:`load_points`, and (P, 3) uint8 their colours.

    Raises:
        InputError: no model.
    """
    points = list(_open(sfm_folder).points3D.values())
    checked = [p for p in points if p.track.length() >= CHECKED_PHOTOS]
    if len(checked) >= max(MIN_CHECKED_SHARE * len(points), MIN_CHECKED):
        points = checked
    xyz, colours = np.array([p.xyz for p in points], float), np.array([p.color for p in points], np.uint8)
    return xyz.reshape(-1, 3), colours.reshape(-1, 3)
