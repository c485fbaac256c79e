"""From first poses to one block: all photos of all flights, in the frame of the geotags."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..core.errors import ReconstructionError
from ..core.progress import Reporter
from ..geotags.photos import shorten
from ..geotags.stations import Stations
from .adjustment import Adjusted, Known, adjust, geotags_are_precise, prune, typical_px
from .control import align_to_control
from .features import FeatureStore
from .georeference import GIMBAL_GATE_DEG, Placement, as_stored
from .guided import find_points, turn_to_points
from .poses import nearest_rotation, rotation_angle_deg
from .posterior import posterior_of
from .sensor import Sensor
from .shutter import settle_lens, settle_shutter
from .ties import GreyPhotos, Ties, ground_surface, tie_photo
from .tracks import Block, build_tracks, triangulate

#: A photo with fewer observations than this after the adjustment counts as not registered.
MIN_OBSERVATIONS = 12
#: Where the mapper places a smaller share of the photos, geotags and gimbal angles are tried.
MAPPED_SHARE = 0.35
#: The gimbal's angles are believed to this, degrees (half a degree stated; three times that and the yaw's compass).
GIMBAL_REACH_DEG = 1.5
#: A photo may be turned this much against its gimbal angles (its vertical: :data:`.georeference.GIMBAL_GATE_DEG`).
COMPASS_GATE_DEG = 15.0
#: A photo farther from a good geotag than this many standard deviations, and this many metres, is placed again.
STRAY_SD, STRAY_M, MOST_STRAYS = 5.0, 0.15, 1 / 3
#: A geotag is good with a standard error (three axes) below this, metres: PPK fixes, not float solutions.
GOOD_GEOTAG_M = 0.15


class Joined(NamedTuple):
    """A finished block, its last adjustment, what held it and was free in that, and whether a rolling shutter was
    looked for.
    """

    block: Block
    adjusted: Adjusted
    known: Known
    free: frozenset[str]
    tested_shutter: bool


def join_photos(
    placement: Placement,
    store: FeatureStore,
    stations: Stations,
    known: Known,
    sensor: Sensor,
    free: frozenset[str],
    reporter: Reporter,
) -> Joined:
    """Adjust the mapped photos, tie in the others through predicted geometry, look for every point in every photo,
    adjust.

    Where shadows moved between two flights SIFT finds no match across them; the texture of the ground, looked for
    where the geotags and the gimbal predict it, does, and one adjustment makes them agree.

    Args:
        known: what holds the block. sensor: lens and shutter to begin with. free: parts of them that are adjusted.

    Raises:
        ReconstructionError: no three photos match each other.
    """
    rng = np.random.default_rng(1)
    tested = bool(free & {"readout", "travel"})
    placement = _enough(placement, store, known, sensor, reporter)
    if known.gimbal is not None:
        mapped = placement.mapped[:, None, None]
        known = replace(known, gimbal=as_stored(np.where(mapped, placement.rotations, np.nan), known.gimbal))
    block = _first_block(placement, store, known, replace(sensor, camera=placement.camera), free, reporter)
    reporter.progress(0.3)
    guess = placement.rotations.copy()
    greys = GreyPhotos(stations.paths)
    loose = np.isfinite(placement.translations).all(axis=1) & ~placement.mapped
    loose |= _set_loose(block, known, guess)
    _join_loose(block, store, loose, guess, known, free, greys, rng)
    reporter.progress(0.6)
    for radius in (4.0, 1.5):
        # Noisier photos (wind, rolling shutter) need a wider search: six times the usual residual.
        reach = max(radius, 6 * typical_px(block))
        extend(block, store, reach)
        triangulate(block, reach)
        _refine(block, known, free, reach)
        reporter.progress(0.75 if radius > 2 else 0.85)
    loose = _set_loose(block, known, guess)
    _join_loose(block, store, loose, guess, known, free, greys, rng)
    if _strengthen(block, store, greys, rng):
        _refine(block, known, free, 3.0)
    # Two rays always meet somewhere along an epipolar line: a point needs three to prove itself, where that leaves
    # every photo tied.
    _keep_proven(block)
    known, free = _settle(block, known, free)
    adjusted = _refine(block, known, free, 2.0, strict=True)
    if _leave_out(block, known, stations.names, reporter):
        adjusted = adjust(block, known, free, final=True)
    return Joined(block, adjusted, known, free, tested)


def _first_block(
    placement: Placement,
    store: FeatureStore,
    known: Known,
    sensor: Sensor,
    free: frozenset[str],
    reporter: Reporter,
) -> Block:
    """The mapped photos, moved onto control points where they are far off, and adjusted."""
    mapped = placement.mapped
    rotations = np.where(mapped[:, None, None], placement.rotations, np.nan)
    translations = np.where(mapped[:, None], placement.translations, np.nan)
    block = from_matches(store, mapped, rotations, translations, sensor)
    triangulate(block, 15.0)
    if known.control is not None:
        moved = align_to_control(block, known.control)
        if moved is not None:
            reporter.info(f"Control points moved the block by {np.linalg.norm(moved.apply(np.zeros((1, 3)))):.1f} m.")
    # Mappers know neither geotags nor a shutter that rolls: the geotags pull first.
    adjust(block, known, free, tag_loss=np.inf)
    _refine(block, known, free, 4.0)
    return block


def _leave_out(block: Block, known: Known, names: list[str], reporter: Reporter) -> bool:
    """Take out photos that few points tie and those that contradict what is known of them; whether there were any.

    Raises:
        ReconstructionError: so many contradict good geotags that block or geotags are wrong.
    """
    far, posed = _far(block, known), int(block.is_posed.sum())
    if far.sum() > MOST_STRAYS * posed:
        stated = np.median(np.linalg.norm(known.sd[far], axis=1))
        raise ReconstructionError(
            f"{far.sum()} of {posed} photos stand more than {STRAY_M * 100:.0f} cm and {STRAY_SD:.0f} standard "
            f"deviations from geotags that claim {stated * 100:.0f} cm; the block is bent or the geotags are wrong: "
            "check lever arm, datum, and that the geotags belong to these photos."
        )
    weak = block.is_posed & (np.bincount(block.image, minlength=len(names)) < MIN_OBSERVATIONS)
    stray = strays(block, known)
    lost = ~block.is_posed | (weak & ~stray)
    for chosen, why in (
        (stray, "contradict their geotag or gimbal angles and are left out"),
        (lost, "could not be tied to the others"),
    ):
        if chosen.any():
            reporter.warn(f"{chosen.sum()} photos {why}: {shorten([names[i] for i in np.flatnonzero(chosen)])}.")
    block.unpose(weak | stray)
    return bool((weak | stray).any())


def _settle(block: Block, known: Known, free: frozenset[str]) -> tuple[Known, frozenset[str]]:
    """Which parts of lens and shutter stay free for the last adjustment."""
    adjusted = adjust(block, known, free, final=True)
    known, free = settle_shutter(block, known, free, posterior_of(adjusted))
    return known, settle_lens(block, known, free)


def _enough(placement: Placement, store: FeatureStore, known: Known, sensor: Sensor, reporter: Reporter) -> Placement:
    """The placement, or one from geotags and gimbal angles where the mapper placed too few photos and that places more.

    Mappers know no rolling shutter: 8 cm between the first row and the last bend their models until few photos agree
    with their geotags.
    """
    # Geotags that are metres off would tear such a start apart.
    if placement.mapped.sum() < max(3, MAPPED_SHARE * len(placement.mapped) if geotags_are_precise(known) else 3):
        other = from_gimbal(placement, store, known, sensor)
        if other.mapped.sum() > placement.mapped.sum():
            reporter.info(
                f"The mapper placed {placement.mapped.sum()} photos; {other.mapped.sum()} start from their geotags and "
                "gimbal angles."
            )
            placement = other
    if placement.mapped.sum() < 3:
        raise ReconstructionError(
            f"No three of the {len(placement.mapped)} photos could be matched with each other and their geotags; they "
            "overlap too little, are blurred, or the geotags are wrong: look at the photos, fly with 80 % overlap."
        )
    return placement


def _set_loose(block: Block, known: Known, guess: np.ndarray) -> np.ndarray:
    """Take out the photos that contradict what is known of them, to be placed again from there; (N,) bool which.

    Their gimbal is believed where it contradicts them, else their direction.
    """
    stray = strays(block, known)
    kept = stray & ~_turned(block, known)
    guess[kept] = block.rotations[kept]
    block.unpose(stray)
    return stray


def strays(block: Block, known: Known) -> np.ndarray:
    """(N,) bool: posed photos that contradict a good geotag (:data:`STRAY_SD`, :data:`STRAY_M`) or their gimbal; none
    where a third would: then geotags or angles are not as good as they state, or the block is far from done.
    """
    found = _far(block, known) | _turned(block, known)
    return found if found.sum() <= MOST_STRAYS * block.is_posed.sum() else np.zeros(len(found), bool)


def _far(block: Block, known: Known) -> np.ndarray:
    """(N,) bool: posed photos that stand too far from a good geotag."""
    off = np.where(block.is_posed[:, None], block.centres, np.nan) - known.xyz
    with np.errstate(invalid="ignore"):
        far = np.linalg.norm(off / known.sd, axis=1) > STRAY_SD * np.sqrt(3)
        far &= np.linalg.norm(known.sd, axis=1) < GOOD_GEOTAG_M
        return far & (np.linalg.norm(off, axis=1) > STRAY_M)


def _turned(block: Block, known: Known) -> np.ndarray:
    """(N,) bool: posed photos that look elsewhere than their gimbal says, the mounting error that all share taken out.

    Such a photo stands on its geotag and hangs on wrong matches alone: its centre does not show it. A gimbal knows the
    vertical, but north only by a compass: on a real flight (``drone_brighton_beach``) the two directions of the lines
    differ by 5 degrees.
    """
    found = np.zeros(len(block.translations), bool)
    if known.gimbal is None:
        return found
    both = np.flatnonzero(block.is_posed & np.isfinite(known.gimbal).all(axis=(1, 2)))
    if len(both) < 3:
        return found
    rotations, gimbal = block.rotations[both], known.gimbal[both]
    error = rotations @ gimbal.transpose(0, 2, 1)
    # Twice: the first mean still holds the turned ones.
    near = np.ones(len(both), bool)
    for _ in range(2):
        mounting = nearest_rotation(error[near].sum(axis=0))
        away = rotation_angle_deg(error @ mounting.T)
        cosine = np.einsum("nk,nk->n", rotations[:, :, 2], gimbal[:, :, 2] @ mounting.T)
        tilted = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        near = away <= max(COMPASS_GATE_DEG, 3 * float(np.median(away)))
        near &= tilted <= max(GIMBAL_GATE_DEG, 3 * float(np.median(tilted)))
    found[both[~near]] = True
    return found


def _join_loose(
    block: Block,
    store: FeatureStore,
    loose: np.ndarray,
    guess: np.ndarray,
    known: Known,
    free: frozenset[str],
    greys: GreyPhotos,
    rng: np.random.Generator,
) -> None:
    """Tie the loose photos in, as many as can be, those that features tie first."""
    loose = loose.copy()
    for _ in range(6):
        if not loose.any():
            break
        joined = _resect(block, store, loose, guess, known, rng)
        if not joined.any():
            joined = _tie(block, store, loose, guess, known, greys, rng)
        if not joined.any():
            break
        loose &= ~joined
        _retriangulate(block, store)
        adjust(block, known, free)
        _refine(block, known, free, 4.0)


def from_gimbal(placement: Placement, store: FeatureStore, known: Known, sensor: Sensor) -> Placement:
    """First poses from geotags and gimbal angles alone, brought together by their matches, intrinsics held.

    For photos with a narrow field of view: there the relative pose of two photos is nearly ambiguous (depth may be
    turned inside out), and mappers that start from pairs reject each other's rotations. Half a degree of gimbal error
    is tens of pixels, so the limit starts wide and closes.
    """
    placed = np.isfinite(placement.translations).all(axis=1) & np.isfinite(known.xyz).all(axis=1)
    if placed.sum() < 3:
        return placement
    sensor = replace(sensor, camera=placement.camera)
    reach_px = 2 * np.tan(np.radians(GIMBAL_REACH_DEG)) * placement.camera.fx
    rotations, translations = placement.rotations.copy(), placement.translations.copy()
    rotations[~placed], translations[~placed] = np.nan, np.nan
    block = from_matches(store, placed, rotations, translations, sensor)
    for share in (1.0, 0.3, 0.1):
        # Every match again: what was too far off before may fit now.
        block = from_matches(store, block.is_posed, block.rotations, block.translations, sensor)
        triangulate(block, share * reach_px)
        adjust(block, known, frozenset(), least_sigma_px=max(0.05 * share * reach_px, 1.0))
    triangulate(block, 0.05 * reach_px)
    tied = block.is_posed & (np.bincount(block.image, minlength=len(placed)) >= MIN_OBSERVATIONS)
    rotations = np.where(tied[:, None, None], block.rotations, placement.rotations)
    translations = np.where(tied[:, None], block.translations, placement.translations)
    return replace(placement, rotations=rotations, translations=translations, mapped=tied)


def _refine(block: Block, known: Known, free: frozenset[str], limit_px: float, strict: bool = False) -> Adjusted:
    """Prune by the residuals at hand, then adjust, twice: a few wrong matches otherwise bend the focal length.

    strict: for the last adjustment, when every pose is good: residuals beyond three times the median are wrong
    matches. On ``plot_a`` it took the scatter of breast-height points from 0.10 to 0.03 px.
    """
    gate, least = (3.0, 0.4) if strict else (6.0, 0.5)
    typical = typical_px(block)
    for _ in range(2):
        limit = max(gate * typical, least)
        prune(block, limit if strict else min(limit_px, limit))
        adjusted = adjust(block, known, free, final=strict, iterations=30 if strict else 12)
        typical = typical if strict else typical_px(block)
    return adjusted


def _keep_proven(block: Block, enough: int = 40) -> None:
    """Drop two-view points, except those of photos that would keep fewer than ``enough`` others."""
    views = np.bincount(block.point, minlength=len(block.points))
    proven = views[block.point] >= 3
    count = np.bincount(block.image[proven], minlength=len(block.keypoints))
    needed = np.zeros(len(block.points), bool)
    needed[block.point[~proven & (count[block.image] < enough)]] = True
    block.keep(proven | needed[block.point])


def from_matches(
    store: FeatureStore, photos: np.ndarray, rotations: np.ndarray, translations: np.ndarray, sensor: Sensor
) -> Block:
    """Block of the verified matches between these photos; points not placed yet."""
    image, key, track = build_tracks(store.keypoints, store.matches, photos)
    return Block(
        sensor,
        rotations.copy(),
        translations.copy(),
        store.keypoints,
        np.zeros((int(track.max(initial=-1)) + 1, 3)),
        image,
        key,
        track,
    )


def _resect(
    block: Block,
    store: FeatureStore,
    loose: np.ndarray,
    guess: np.ndarray,
    known: Known,
    rng: np.random.Generator,
) -> np.ndarray:
    """Turn each loose photo, standing at its geotag, until known points fall on its features; returns who succeeded."""
    joined = np.zeros(len(loose), bool)
    focal = block.camera.fx
    for i in np.flatnonzero(loose).tolist():
        rotation, translation, inliers = guess[i], -guess[i] @ known.xyz[i], np.zeros(0, bool)
        # A strict ratio in the wide circle (few, mostly right), then a lax one in a narrow circle.
        for radius, ratio, tolerance_px, share in (
            (np.tan(np.radians(GIMBAL_REACH_DEG)) * focal, 0.75, 6.0, 0.3),
            (12.0, 0.75, 4.0, 0.2),
            (6.0, 0.75, 3.0, 0.4),
        ):
            found = find_points(block, store.descriptors, i, rotation, translation, radius, ratio)
            pixels = store.keypoints[i][found.key]
            rays = block.sensor.directions(pixels, i)
            tolerance = (tolerance_px + _slack_px(block, known, i)) / focal
            turned = turn_to_points(
                block.moved(i, block.points[found.point], pixels),
                rays,
                known.xyz[i],
                tolerance,
                rng,
                near=guess[i],
                max_turn_deg=2 * GIMBAL_REACH_DEG,
            )
            inliers = np.zeros(0, bool) if turned is None else turned[1]
            if turned is None or inliers.sum() < 6 or inliers.mean() < share:
                break
            rotation, translation = turned[0], -turned[0] @ known.xyz[i]
        else:
            if inliers.sum() >= MIN_OBSERVATIONS:
                joined[i] = True
                block.rotations[i], block.translations[i] = rotation, translation
                _add(block, i, found.point[inliers], found.key[inliers])
    return joined


def _strengthen(
    block: Block, store: FeatureStore, greys: GreyPhotos, rng: np.random.Generator, enough: int = 120
) -> bool:
    """More texture ties for posed photos with fewer than ``enough`` observations; True if any was found.

    A photo that hangs on forty features may tip by half a pixel; the ground shows dozens of windows to hold it.
    """
    counts = np.bincount(block.image, minlength=len(block.keypoints))
    posed = np.flatnonzero(block.is_posed)
    weak = posed[counts[posed] < enough]
    if not len(weak):
        return False
    ground = ground_surface(block.points)
    before = len(block.image)
    for i in weak.tolist():
        references = posed[posed != i]
        centre = -block.rotations[i].T @ block.translations[i]
        tied = tie_photo(block, greys, i, block.rotations[i], centre, references, ground, 0.15, 0.0, rng)
        if tied is not None:
            _add_ties(block, store, i, tied[1], rng)
    return len(block.image) > before


def _tie(
    block: Block,
    store: FeatureStore,
    loose: np.ndarray,
    guess: np.ndarray,
    known: Known,
    greys: GreyPhotos,
    rng: np.random.Generator,
) -> np.ndarray:
    """Tie loose photos through the texture of the ground (moved shadows leave no feature in common); returns who
    succeeded.
    """
    joined = np.zeros(len(loose), bool)
    ground = ground_surface(block.points)
    posed = np.flatnonzero(block.is_posed)
    for i in np.flatnonzero(loose).tolist():
        tied = tie_photo(
            block, greys, i, guess[i], known.xyz[i], posed, ground, GIMBAL_REACH_DEG, _slack_px(block, known, i), rng
        )
        if tied is None:
            continue
        rotation, ties = tied
        joined[i] = True
        block.rotations[i], block.translations[i] = rotation, -rotation @ known.xyz[i]
        _add_ties(block, store, i, ties, rng)
    return joined


def _add_ties(block: Block, store: FeatureStore, i: int, ties: Ties, rng: np.random.Generator) -> None:
    """Ties as observations of new points."""
    # One point a window, seen in this photo and in every reference that showed it.
    spots, window = np.unique(ties.points.round(6), axis=0, return_inverse=True)
    window = window.ravel()
    pixels = np.column_stack([np.bincount(window, ties.pixels[:, k]) for k in range(2)]) / np.bincount(window)[:, None]
    numbers = len(block.points) + np.arange(len(spots))
    block.points = np.concatenate([block.points, spots])
    _add(block, i, numbers, _new_keypoints(store, i, pixels, rng))
    for r in np.unique(ties.reference):
        own = np.flatnonzero(ties.reference == r)
        _, first = np.unique(window[own], return_index=True)
        own = own[first]
        _add(block, int(r), numbers[window[own]], _new_keypoints(store, int(r), ties.reference_pixels[own], rng))


def _new_keypoints(store: FeatureStore, i: int, pixels: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Append keypoints that are not SIFT features; their random descriptors match nothing."""
    first = len(store.keypoints[i])
    store.keypoints[i] = np.vstack([store.keypoints[i], pixels])
    store.descriptors[i] = np.vstack([store.descriptors[i], rng.integers(0, 256, (len(pixels), 128), dtype=np.uint8)])
    return first + np.arange(len(pixels))


def _slack_px(block: Block, known: Known, i: int) -> float:
    """Pixels by which an uncertain position moves the picture, beyond what a rotation takes up."""
    distance = max(float(np.median(np.linalg.norm(block.points - known.xyz[i], axis=1))), 1.0)
    return min(0.5 * block.camera.fx * float(np.linalg.norm(known.sd[i])) / distance, 30.0)


def _append(block: Block, other: Block) -> None:
    """Add another block's points and observations; keypoints that are taken are left alone."""
    other.keep(~np.isin(_codes(other), _codes(block)))
    block.image = np.concatenate([block.image, other.image])
    block.key = np.concatenate([block.key, other.key])
    block.point = np.concatenate([block.point, other.point + len(block.points)])
    block.points = np.concatenate([block.points, other.points])


def _add(block: Block, i: int, point: np.ndarray, key: np.ndarray) -> None:
    block.image = np.concatenate([block.image, np.full(len(point), i)])
    block.key = np.concatenate([block.key, key])
    block.point = np.concatenate([block.point, point])


def _retriangulate(block: Block, store: FeatureStore) -> None:
    """Add the points that verified matches between posed photos give and the block does not have yet."""
    fresh = from_matches(store, block.is_posed, block.rotations, block.translations, block.sensor)
    used = _codes(block)
    taken = np.isin(_codes(fresh), used)
    # A track of which any keypoint is already known would only double it.
    known = np.zeros(len(fresh.points), bool)
    known[fresh.point[taken]] = True
    fresh.keep(~known[fresh.point])
    triangulate(fresh, 15.0)
    _append(block, fresh)


def _codes(block: Block) -> np.ndarray:
    return block.image.astype(np.int64) << 32 | block.key


def extend(block: Block, store: FeatureStore, radius_px: float, ratio: float = 0.8) -> None:
    """Look for every point in every photo; join points that turn out to be the same feature.

    A point may be joined to another only if no photo sees both.
    """
    count = len(block.points)
    owner = {}
    for image, key, point in zip(block.image.tolist(), block.key.tolist(), block.point.tolist(), strict=True):
        owner[image << 32 | key] = point
    seen = np.zeros((len(block.keypoints), count), bool)
    seen[block.image, block.point] = True
    added: list[tuple[int, int, int]] = []
    same: list[tuple[int, int]] = []
    for i in np.flatnonzero(block.is_posed).tolist():
        found = find_points(block, store.descriptors, i, block.rotations[i], block.translations[i], radius_px, ratio)
        for point, key in zip(found.point.tolist(), found.key.tolist(), strict=True):
            if seen[i, point]:
                continue
            other = owner.get(i << 32 | key)
            if other is None:
                added.append((i, key, point))
            elif other != point:
                same.append((other, point))
    if added:
        image, key, point = np.array(added).T
        block.image, block.key, block.point = (
            np.concatenate([a, b]) for a, b in ((block.image, image), (block.key, key), (block.point, point))
        )
        seen[image, point] = True
    target = np.arange(count)
    for a, b in same:
        while target[a] != a:
            a = target[a]
        while target[b] != b:
            b = target[b]
        if a != b and not (seen[:, a] & seen[:, b]).any():
            target[b] = a
            seen[:, a] |= seen[:, b]
    for p in range(count):
        root = p
        while target[root] != root:
            root = target[root]
        target[p] = root
    block.point = target[block.point]
    # The same keypoint offered to two points: neither is sure of it.
    code = _codes(block)
    _, place, repeated = np.unique(code, return_inverse=True, return_counts=True)
    block.keep(repeated[place] == 1)
