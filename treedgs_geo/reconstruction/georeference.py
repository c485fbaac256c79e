"""Free models from the mapper, each fitted to the geotags; photos that fit no model start from geotag and gimbal."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ..geotags.stations import PRECISE_GEOTAG_M, Stations
from .cameras import Camera, View
from .colmap import camera_from_colmap
from .colmap_process import run_task
from .control import fit_to_control
from .guided_matching import line_scale
from .poses import Similarity, fit_similarity_robust, nearest_rotation, rotation_angle_deg
from .prior_knowledge import Survey
from .sift import FeatureStore
from .tracks import Block

#: A mapped photo may differ this much from its gimbal angles (after the common mounting error), degrees.
GIMBAL_LIMIT_DEG = 4.0
#: Cameras are held level to this (median), degrees, and look about so much at least (second axis over the first).
LEVEL_DEG, _MIN_BREADTH = 3.0, 0.3
#: A match agrees with the poses of a model within so many pixels.
_MET_PX = 4.0
#: A photo on its head: half a turn about the camera's axis.
HALF_TURN = np.diag([-1.0, -1.0, 1.0])


class _Model(NamedTuple):
    """What a mapper found in a frame of its own. ids: numbers of its photos; their rotations and centres."""

    ids: np.ndarray
    camera: Camera
    rotations: np.ndarray
    centres: np.ndarray


@dataclass
class Placement:
    """First poses in the local frame.

    camera: intrinsics of the best model. rotations, translations: NaN where a photo could not be placed. mapped: (N,)
    bool, from the mapper (else from geotag + gimbal).
    """

    camera: Camera
    rotations: np.ndarray
    translations: np.ndarray
    mapped: np.ndarray

    @classmethod
    def nowhere(cls, camera: Camera, count: int) -> Placement:
        """None of ``count`` photos placed."""
        return cls(camera, np.full((count, 3, 3), np.nan), np.full((count, 3), np.nan), np.zeros(count, bool))


def place_photos(
    database: Path, cache: Path, stations: Stations, survey: Survey, store: FeatureStore, seed: int
) -> Placement:
    """Map the photos, fit every model to the geotags, and fill the gaps from geotag + gimbal.

    Global mapping (GLOMAP) first; photos that it leaves out are mapped again among themselves, incrementally if it
    must be. Where neither precise geotags nor gimbals tell a wrong model, that mapper goes first whose models more of
    the verified matches (``store``) meet. A photo of a model that contradicts its geotag or gimbal is not believed.
    """
    xyz, gimbal = survey.known.xyz, survey.rotations
    placement = Placement.nowhere(survey.calibration.camera, len(stations))
    rng = np.random.default_rng(seed)
    best, tried = 0, dict[str, list[_Model]]()
    tasks, free_focal = ["map_global", "map_global", "map_incremental"], "focal" in survey.free
    if survey.known.is_by_control:
        # A mapper has no prior on the lens: where nothing else is known it bends lens and model together.
        tasks, free_focal = tasks[::-1], False
    elif not (survey.known.is_precise or np.isfinite(gimbal).any()):
        # Neither geotags nor gimbals tell a model that is wrong as a whole: the matches do.
        free_focal, tasks = False, tasks[1:]
        tried = {task: _run_mapper(task, database, cache, stations.names, free_focal, seed) for task in tasks}
        tasks.sort(key=lambda task: -sum(_matches_met(store, model) for model in tried[task]))
    for task in tasks:
        left = np.flatnonzero(~placement.mapped).tolist()
        aimed = _has_gimbal(xyz, gimbal)[left].all()
        if len(left) < 3 or (task == "map_incremental" and aimed and placement.mapped.any()):
            break
        names = [stations.names[i] for i in left]
        models = tried.get(task) if len(left) == len(stations) else None
        for model in models or _run_mapper(task, database, cache, names, free_focal, seed):
            accepted = _fit_model(placement, model, survey, rng)
            if accepted > best:
                best, placement.camera = accepted, model.camera
    return _filled_from_gimbal(placement, xyz, gimbal)


def place_by_gimbal(camera: Camera, xyz: np.ndarray, gimbal: np.ndarray) -> Placement:
    """First poses from geotags and gimbal angles alone, local frame; none from the mapper."""
    return _filled_from_gimbal(Placement.nowhere(camera, len(xyz)), xyz, gimbal)


def _matches_met(store: FeatureStore, model: _Model) -> int:
    """How many verified matches lie within :data:`_MET_PX` of their epipolar lines in a model."""
    views = {
        i: View(str(i), Path(), model.camera, rotation, -rotation @ centre)
        for i, rotation, centre in zip(model.ids.tolist(), model.rotations, model.centres, strict=True)
    }
    rays = {i: view.rays(store.keypoints[i]) for i, view in views.items()}
    met = 0
    for (i, j), rows in store.matches.items():
        if i in views and j in views and len(rows):
            a, b, along = rays[i][rows[:, 0]], rays[j][rows[:, 1]], views[j].centre - views[i].centre
            along = along / max(np.linalg.norm(along), 1e-12)
            off = line_scale(a, b, along, model.camera.fx) * (np.cross(a, b) @ along)
            met += int((np.abs(off) < _MET_PX).sum())
    return met


def _run_mapper(task: str, database: Path, cache: Path, names: list[str], free_focal: bool, seed: int) -> list[_Model]:
    """Each model found, largest first. database: of :func:`.matching.match_all`."""
    import pycolmap

    output = cache / "models"
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir()
    job = {"database": str(database), "photos": str(cache), "output": str(output)}
    run_task(task, job | {"names": names, "free_focal": free_focal, "seed": seed}, cache)
    found = []
    for folder in sorted(output.iterdir()):
        if not (folder / "images.bin").exists():
            continue
        model = pycolmap.Reconstruction(str(folder))
        images = sorted((image for image in model.images.values() if image.has_pose), key=lambda each: each.image_id)
        if len(images) < 3:
            continue
        poses = np.array([image.cam_from_world().matrix() for image in images])
        ids = np.array([image.image_id - 1 for image in images])
        camera = camera_from_colmap(model.camera(images[0].camera_id))
        found.append(_Model(ids, camera, poses[:, :, :3], np.array([image.projection_center() for image in images])))
    return sorted(found, key=lambda model: -len(model.ids))


def _fit_model(placement: Placement, model: _Model, survey: Survey, rng: np.random.Generator) -> int:
    """Bring one model into the local frame; returns how many of its photos were believed."""
    ids, rotations, centres = model.ids, model.rotations, model.centres
    xyz, sd, gimbal = survey.known.xyz, survey.known.sd, survey.rotations
    placed = np.isfinite(xyz[ids]).all(axis=1)
    spread = np.where(placed, np.linalg.norm(sd[ids], axis=1), np.inf)
    # Fixed positions decide; float and navigation-grade ones only help where there are too few of them.
    usable = placed & (spread <= max(0.1, 3 * np.sort(spread)[min(3, len(spread) - 1)]))
    if usable.sum() < 3:
        usable = placed
    fitted = fit_similarity_robust(centres[usable], xyz[ids][usable], spread[usable], rng)
    if not placed.any():
        similarity = _by_control(model, survey)
    elif fitted is not None and fitted[1].sum() >= max(3, 0.3 * usable.sum()):
        similarity = fitted[0]
    else:
        similarity = None
    if similarity is None:
        return 0
    centres = similarity.apply(centres)
    rotations = rotations @ similarity.rotation.T
    if placed.any() and np.median(spread[usable]) > PRECISE_GEOTAG_M:
        rotations, centres = _turned_to_gimbals(rotations, centres, gimbal[ids], xyz[ids])
    aimed = as_stored(rotations, gimbal[ids])
    off = np.linalg.norm(centres - xyz[ids], axis=1)
    good = ~placed | (off <= 5 * spread + 0.5)
    known = np.isfinite(aimed).all(axis=(1, 2))
    if (known & good).sum() >= 3:
        error = rotations[known] @ aimed[known].transpose(0, 2, 1)
        bias = nearest_rotation(error[good[known]].sum(axis=0))
        away = rotation_angle_deg(error @ bias.T)
        good[np.flatnonzero(known)[away > GIMBAL_LIMIT_DEG + 3 * np.median(away)]] = False
    keep = good & ~placement.mapped[ids]
    if keep.sum() < 3:
        return 0
    new = ids[keep]
    placement.rotations[new] = rotations[keep]
    placement.translations[new] = -np.einsum("nij,nj->ni", rotations[keep], centres[keep])
    placement.mapped[new] = True
    return int(keep.sum())


def _by_control(model: _Model, survey: Survey) -> Similarity | None:
    """From a model none of whose photos has a geotag to the control points that it shows."""
    if survey.known.control is None:
        return None
    every, none = Placement.nowhere(model.camera, len(survey.known.xyz)), np.zeros(0, int)
    every.rotations[model.ids] = model.rotations
    every.translations[model.ids] = -np.einsum("nij,nj->ni", model.rotations, model.centres)
    sensor = replace(survey.sensor, camera=model.camera)
    block = Block(sensor, every.rotations, every.translations, [], np.zeros((0, 3)), none, none, none)
    return fit_to_control(block, survey.known.control)


def as_stored(rotations: np.ndarray, gimbal: np.ndarray) -> np.ndarray:
    """(N, 3, 3) gimbal rotations; those of photos that stand on their head, half a turn about the axis further.

    Programs turn photos and leave the gimbal's angles as they were (a whole line of ``drone_brighton_beach``).

    Args:
        rotations: (N, 3, 3) world -> camera as reconstructed, NaN unknown.
    """
    headlong = HALF_TURN @ gimbal
    near, far = (np.einsum("nij,nij->n", rotations, each) for each in (gimbal, headlong))
    return np.where((far > near)[:, None, None], headlong, gimbal)


def _turned_to_gimbals(
    rotations: np.ndarray, centres: np.ndarray, gimbal: np.ndarray, xyz: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A model turned about its middle as its gimbals say, unless those contradict each other.

    Positions metres off (xyz: (N, 3), NaN unknown) do not level a model, and a single line of photos may lie on its
    back; they say whether all its photos are stored on their head.
    """
    known = np.isfinite(gimbal).all(axis=(1, 2))
    if known.sum() < 3:
        return _levelled(rotations, centres)
    middle, found = centres.mean(axis=0), []
    for aimed in (gimbal[known], HALF_TURN @ gimbal[known]):
        turn = nearest_rotation((aimed.transpose(0, 2, 1) @ rotations[known]).sum(axis=0))
        moved = middle + (centres - middle) @ turn.T
        away = rotation_angle_deg(rotations[known] @ turn.T @ aimed.transpose(0, 2, 1))
        found.append((float(np.nanmedian(np.linalg.norm(moved - xyz, axis=1))), np.median(away), turn, moved))
    _, spread_deg, turn, moved = min(found, key=lambda each: each[0])
    return (rotations, centres) if spread_deg > 2 * GIMBAL_LIMIT_DEG else (rotations @ turn.T, moved)


def _levelled(rotations: np.ndarray, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A model turned about its middle until its photos are level as they were held, if they were."""
    up = _up_as_held(rotations)
    if up is None:
        return rotations, centres
    turn = Rotation.align_vectors([[0.0, 0, 1]], [up])[0].as_matrix()
    middle = centres.mean(axis=0)
    return rotations @ turn.T, middle + (centres - middle) @ turn.T


def _up_as_held(rotations: np.ndarray) -> np.ndarray | None:
    """(3,) the direction to which the rows of all photos (of upright ones: the columns) are square, as whoever carries
    a camera holds it, and drones do; ``None`` where there is none, or all look the same way."""
    found = []
    for axes in (rotations[:, 0], rotations[:, 1]):
        _, size, ways = np.linalg.svd(axes, full_matrices=False)
        tilted_deg = float(np.median(np.degrees(np.arcsin(np.clip(np.abs(axes @ ways[2]), 0, 1)))))
        if tilted_deg <= LEVEL_DEG and size[1] >= _MIN_BREADTH * size[0]:
            found.append((tilted_deg, ways[2] * np.copysign(1.0, ways[2, 2])))
    return min(found, key=lambda each: each[0])[1] if found else None


def level_as_held(placement: Placement) -> np.ndarray:
    """(N, 3, 3) directions of the placed photos for those of gimbals that are not known, NaN where they were not held
    level."""
    mapped = placement.mapped
    held = mapped.sum() >= 3 and _up_as_held(placement.rotations[mapped]) is not None
    return np.where((mapped & held)[:, None, None], placement.rotations, np.nan)


def _has_gimbal(xyz: np.ndarray, gimbal: np.ndarray) -> np.ndarray:
    """(N,) bool: photos with geotag and gimbal angles."""
    return np.isfinite(gimbal).all(axis=(1, 2)) & np.isfinite(xyz).all(axis=1)


def _filled_from_gimbal(placement: Placement, xyz: np.ndarray, gimbal: np.ndarray) -> Placement:
    """The placement with the photos that it lacks at their geotag and gimbal angles, corrected by the common mounting
    error that the mapped photos show."""
    known = _has_gimbal(xyz, gimbal)
    both = known & placement.mapped
    bias = np.eye(3)
    if both.sum() >= 5:
        aimed = as_stored(placement.rotations[both], gimbal[both])
        bias = nearest_rotation((placement.rotations[both] @ aimed.transpose(0, 2, 1)).sum(axis=0))
    for i in np.flatnonzero(known & ~placement.mapped):
        placement.rotations[i] = bias @ gimbal[i]
        placement.translations[i] = -placement.rotations[i] @ xyz[i]
    return placement
