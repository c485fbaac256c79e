"""Plug-in point for learned matchers (TopicFM, LoFTR, LightGlue ...): the user's code and weights, our database.

A plug-in is a Python file with one function ``load(weights: str) -> match``; ``match(first, second)`` takes two photos,
(H, W, 3) uint8 RGB, and returns two (K, 2) arrays of pixel coordinates (centre of the first pixel at (0.5, 0.5)) and
(K,) confidences. No weights come with TreeDGS and none are downloaded. Matches are checked geometrically and written to
a COLMAP database, beside its own or instead of them. Detector-free matchers place a point anew in each pair; points of
one photo that fall into one cell of ``cell_px`` are joined, so that tracks grow over more than two photos.
"""

from __future__ import annotations

import importlib.util
import os
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.files import fingerprint

#: Matches beside those of a pair that is known already are this close (px, Sampson) to its epipolar lines.
AGREE_PX = 2.0
#: A pair that only the plug-in connects needs so many matches, and this share of them on one geometry.
ALONE_INLIERS, ALONE_SHARE = 30, 0.5
Matcher = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class ImportReport:
    """pairs: tried; verified: pairs with a geometry; matches: inlier matches in all; keypoints: in all photos; added:
    matches that the matcher gave."""

    pairs: int
    verified: int
    matches: int
    keypoints: int
    added: int


@dataclass(frozen=True)
class Plugin:
    """code: the Python file. weights: what its ``load`` gets."""

    code: Path
    weights: Path

    def digest(self) -> str:
        """Of both files' contents."""
        return fingerprint([self.code, self.weights])


def plugin_of(code: Path | None, weights: Path | None) -> Plugin | None:
    """The learned matcher asked for, ``None`` without; it is loaded once, so that a mistake is found before any work.

    Raises:
        InputError: one of both is missing, or the plug-in cannot be loaded.
    """
    if code is None and weights is None:
        return None
    if code is None or weights is None:
        given, missing = ("--matcher", "--matcher-weights") if code else ("--matcher-weights", "--matcher")
        raise InputError(f"{given} is given without {missing}: a learned matcher is a Python file and its weights.")
    plugin = Plugin(code, weights)
    load_matcher(plugin)
    return plugin


def load_matcher(files: Plugin) -> Matcher:
    """The matcher of a plug-in file with the user's weights.

    Raises:
        InputError: a file is missing, or the plug-in cannot be loaded.
    """
    plugin, weights = files.code, files.weights
    for path, what in ((plugin, "a Python file that defines load(weights)"), (weights, "the matcher's weights")):
        if not path.is_file():
            raise InputError(f"{path}: not found, expected {what}; correct the path.")
    spec = importlib.util.spec_from_file_location(f"treedgs_matcher_{plugin.stem}", plugin)
    if spec is None or spec.loader is None:
        raise InputError(f"{plugin}: is not a Python file, expected one that defines load(weights).")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
        load = module.load
    except Exception as problem:  # whatever the user's code raises
        raise InputError(f"{plugin}: cannot be loaded ({type(problem).__name__}: {problem}); test it alone.") from None
    try:
        matcher = load(str(weights))
    except Exception as problem:
        raise InputError(f"{weights}: {plugin.name} cannot load it ({type(problem).__name__}: {problem}).") from None
    if not callable(matcher):
        raise InputError(f"{plugin}: load() returned {type(matcher).__name__}, expected a function of two photos.")
    return matcher


def import_matches(
    database: Path,
    pairs: Sequence[tuple[str, str]],
    load_photo: Callable[[str], np.ndarray],
    matcher: Matcher,
    least_confidence: float = 0.2,
    cell_px: float = 2.0,
    least_inliers: int = 15,
    keep: bool = False,
    progress: Callable[[float], None] = lambda _: None,
) -> ImportReport:
    """Match pairs of photos and write keypoints, matches and verified geometries.

    database: with cameras and images (``extract`` makes it). keep: its keypoints and verified matches stay, those of
    ours that agree with its geometry are added (:data:`AGREE_PX`), and pairs that it does not connect have to be
    clearer (:data:`ALONE_SHARE`); otherwise they are replaced. pairs: image names. load_photo: name -> (H, W, 3) uint8
    RGB. progress: called with the share done (0..1). Points of a matcher get random descriptors, which match nothing.

    Raises:
        InputError: a name that the database does not know, or a matcher that returns something else than promised.
    """
    import pycolmap

    store = pycolmap.Database.open(str(database))
    try:
        images = {image.name: image for image in store.read_all_images()}
        cameras = {camera.camera_id: camera for camera in store.read_all_cameras()}
        unknown = sorted({name for pair in pairs for name in pair} - set(images))
        if unknown:
            raise InputError(f"{database}: does not hold the photo {unknown[0]!r}; extract features of it first.")
        kept, found = _kept(store, images) if keep else ({name: _nothing() for name in images}, {})
        trusted = {pair for pair, rows in found.items() if len(rows) >= least_inliers}
        points = {name: list(own) for name, (own, _) in kept.items()}
        index: dict[str, dict[tuple[int, int], int]] = {name: {} for name in images}
        added = 0
        for done, (first, second) in enumerate(pairs):
            progress(done / len(pairs))
            ends = _matched(matcher, load_photo(first), load_photo(second), least_confidence, f"{first} and {second}")
            rows = (
                np.column_stack(
                    [
                        [_place(xy, index[name], points[name], cell_px) for xy in own]
                        for name, own in zip((first, second), ends, strict=True)
                    ]
                )
                if len(ends[0])
                else np.empty((0, 2), int)
            )
            added += len(rows)
            if (second, first) in found:
                first, second, rows = second, first, rows[:, ::-1]
            known = found.get((first, second), np.empty((0, 2), int))
            if (first, second) in trusted:
                rows = rows[
                    _agree(
                        rows,
                        known,
                        *((cameras[images[name].camera_id], np.array(points[name])) for name in (first, second)),
                    )
                ]
            found[first, second] = np.unique(np.concatenate([known, rows]), axis=0).astype(np.uint32)
        store.clear_two_view_geometries()
        store.clear_matches()
        store.clear_keypoints()
        store.clear_descriptors()
        keypoints = {name: np.array(own, np.float32).reshape(-1, 2) for name, own in points.items()}
        rng = np.random.default_rng(0)
        for name, own in keypoints.items():
            described = kept[name][1]
            made = rng.integers(0, 256, (len(own) - len(described), 128), dtype=np.uint8)
            store.write_keypoints(images[name].image_id, own)
            if keep:
                data = pycolmap.FeatureDescriptors(
                    pycolmap.FeatureExtractorType.SIFT, np.concatenate([described, made])
                )
                store.write_descriptors(images[name].image_id, data)
        verified = total = 0
        for (first, second), rows in found.items():
            one, two = images[first], images[second]
            store.write_matches(one.image_id, two.image_id, rows)
            if len(rows) < least_inliers:
                continue
            geometry = pycolmap.estimate_calibrated_two_view_geometry(
                cameras[one.camera_id],
                keypoints[first].astype(float),
                cameras[two.camera_id],
                keypoints[second].astype(float),
                rows,
            )
            least = float(least_inliers)
            if keep and (first, second) not in trusted:
                least = max(ALONE_INLIERS, ALONE_SHARE * len(rows))
            if len(geometry.inlier_matches) >= least:
                store.write_two_view_geometry(one.image_id, two.image_id, geometry)
                verified, total = verified + 1, total + len(geometry.inlier_matches)
    finally:
        store.close()
    return ImportReport(len(pairs), verified, total, sum(map(len, keypoints.values())), added)


def match_photos(
    database: Path,
    target: Path,
    pairs: Sequence[tuple[str, str]],
    load_photo: Callable[[str], np.ndarray],
    matcher: Matcher,
    plugin: Plugin,
    progress: Callable[[float], None] = lambda _: None,
) -> ImportReport:
    """The matches of a plug-in beside those in ``database``, in a copy of it, ``target``.

    The copy appears under its name only when it is whole, so that a stopped run begins it anew.

    Raises:
        InputError: the matcher fails, or finds nothing in any pair.
    """
    unfinished = target.with_suffix(".part")
    shutil.copyfile(database, unfinished)
    report = import_matches(unfinished, pairs, load_photo, matcher, keep=True, progress=progress)
    if report.added == 0:
        raise InputError(
            f"{plugin.code}: found no match in any of {report.pairs} pairs of photos, expected hundreds in each; test "
            "it alone on two overlapping photos."
        )
    os.replace(unfinished, target)
    return report


def _agree(rows: np.ndarray, known: np.ndarray, first: tuple, second: tuple) -> np.ndarray:
    """(K,) bool: matches (K, 2) near the epipolar lines of the ``known`` (M, 2) ones. first, second: a camera and its
    photo's keypoints (N, 2)."""
    import pycolmap

    (one, xy_one), (two, xy_two) = first, second
    geometry = pycolmap.estimate_calibrated_two_view_geometry(one, xy_one, two, xy_two, known.astype(np.uint32))
    essential = np.asarray(geometry.E, float)
    if len(rows) == 0 or not np.isfinite(essential).all() or not essential.any():
        return np.ones(len(rows), bool)
    rays = [
        np.column_stack([camera.cam_from_img(xy[column]), np.ones(len(rows))])
        for camera, xy, column in ((one, xy_one, rows[:, 0]), (two, xy_two, rows[:, 1]))
    ]
    there, back = rays[0] @ essential.T, rays[1] @ essential
    off = np.einsum("ij,ij->i", rays[1], there) / np.sqrt(
        (there[:, :2] ** 2).sum(axis=1) + (back[:, :2] ** 2).sum(axis=1) + 1e-24
    )
    return np.abs(off) * np.sqrt(one.mean_focal_length() * two.mean_focal_length()) < AGREE_PX


def _nothing() -> tuple[np.ndarray, np.ndarray]:
    return np.empty((0, 2)), np.empty((0, 128), np.uint8)


def _kept(store, images: dict) -> tuple[dict[str, tuple[np.ndarray, np.ndarray]], dict[tuple[str, str], np.ndarray]]:
    """(keypoints (K, 2), descriptors (K, 128)) of each photo, and verified matches of each pair, in a database."""
    import pycolmap

    kept, names = {}, {image.image_id: name for name, image in images.items()}
    for name, image in images.items():
        points = np.asarray(store.read_keypoints(image.image_id), float)
        data = store.read_descriptors(image.image_id)
        data = np.asarray(getattr(data, "data", data), np.uint8).reshape(-1, 128)
        kept[name] = points.reshape(len(points), -1 if len(points) else 2)[:, :2], data
    found = {}
    pair_ids, geometries = store.read_two_view_geometries()
    for pair_id, geometry in zip(pair_ids, geometries, strict=True):
        first, second = pycolmap.pair_id_to_image_pair(pair_id)
        if len(geometry.inlier_matches):
            found[names[first], names[second]] = np.asarray(geometry.inlier_matches, np.int64)
    return kept, found


def _place(xy: np.ndarray, index: dict[tuple[int, int], int], points: list[np.ndarray], cell_px: float) -> int:
    """Number of the keypoint in this cell, made if there is none."""
    cell = (int(xy[0] // cell_px), int(xy[1] // cell_px))
    if cell not in index:
        index[cell] = len(points)
        points.append(xy)
    return index[cell]


def _matched(
    matcher: Matcher, first: np.ndarray, second: np.ndarray, least_confidence: float, which: str
) -> tuple[np.ndarray, np.ndarray]:
    try:
        one, two, confidence = matcher(first, second)
    except Exception as problem:  # whatever the user's code raises
        raise InputError(f"The matcher failed on {which} ({type(problem).__name__}: {problem}).") from None
    one, two = np.asarray(one, float).reshape(-1, 2), np.asarray(two, float).reshape(-1, 2)
    confidence = np.asarray(confidence, float).ravel()
    if not len(one) == len(two) == len(confidence):
        raise InputError(
            f"The matcher returned {len(one)}, {len(two)} points and {len(confidence)} confidences for {which}, "
            "expected as many of each."
        )
    keep = (confidence >= least_confidence) & np.isfinite(one).all(axis=1) & np.isfinite(two).all(axis=1)
    for points, image in ((one, first), (two, second)):
        keep &= (points >= 0).all(axis=1) & (points[:, 0] <= image.shape[1]) & (points[:, 1] <= image.shape[0])
    return one[keep], two[keep]
