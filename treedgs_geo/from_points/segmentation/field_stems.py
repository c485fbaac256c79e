"""Field stems as seeds of the segmentation: where to look twice, and what the stems are called."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...core.errors import InputError
from ...core.tables import csv_text
from .segment import StemMap

#: A field stem and a found one further apart than this are two, metres, however inexact the positions.
FIELD_MATCH_M = 1.0
#: The distance allowed, in medians of the pairs' distances, but not less than this, m; pairs needed to know it.
GATE_SHARE, LEAST_GATE_M, LEAST_PAIRS = 3.0, 0.3, 3
#: From this distance on, m, a pair is unsure where another stem is less than this many times as far.
FAR_M, UNSURE_SHARE = 0.5, 1.5
#: An answer of the search is a place's own within the first; a tree of another field stem takes the place up to this
#: distance from its bark, m.
SAME_PLACE_M, TAKEN_M = 0.1, 0.35
_X, _Y = ("x", "easting", "e"), ("y", "northing", "n")


@dataclass(frozen=True)
class FieldStems:
    """(K, 2) xy in the cloud's CRS, (K,) int ids, (K,) names as written in the file; counted: ids are the order in the
    file, because the names are no whole numbers."""

    xy: np.ndarray
    ids: np.ndarray
    names: tuple[str, ...]
    counted: bool = False


def read_field_stems(path: Path, crs: object | None = None) -> FieldStems:
    """Field stems of a point layer (GeoPackage, shapefile, GeoJSON) or a CSV with x, y (or easting, northing).

    crs: of the cloud; a layer in another one is brought to it, a CSV is taken to be in it. ``tree_id`` is optional:
    whole numbers are kept as ids, other names are numbered in the order of the file.

    Raises:
        InputError: not readable, no positions, a tree_id twice.
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        table = _read_csv(path)
        columns = {name.strip().lower(): name for name in table.columns}
        x, y = (next((columns[name] for name in names if name in columns), None) for names in (_X, _Y))
        if x is None or y is None:
            raise InputError(
                f"{path}: found columns {', '.join(map(str, table.columns))}; expected x and y (or "
                "easting and northing) of each stem."
            )
        xy = _numbers(path, table, (x, y))
    else:
        import geopandas as gpd

        try:
            table = gpd.read_file(path)
        except Exception as problem:
            raise InputError(f"{path}: cannot be read as a layer ({problem}); expected points, one a stem.") from None
        if table.geometry is None or not (table.geometry.geom_type == "Point").all():
            raise InputError(f"{path}: is no layer of points; expected one point a stem.")
        if crs is not None and table.crs is not None:
            table = table.to_crs(crs)
        columns = {str(name).strip().lower(): name for name in table.columns}
        xy = np.column_stack([table.geometry.x, table.geometry.y])
    if len(xy) == 0 or not np.isfinite(xy).all():
        raise InputError(
            f"{path}: {'holds no stem' if len(xy) == 0 else 'a stem has no position'}; expected x and y of each stem."
        )
    if "tree_id" not in columns:
        return FieldStems(xy, np.arange(1, len(xy) + 1), tuple(str(k) for k in range(1, len(xy) + 1)))
    names = tuple(str(value).strip() for value in table[columns["tree_id"]])
    doubled = {name for name in names if names.count(name) > 1}
    if doubled:
        raise InputError(f"{path}: tree_id {sorted(doubled)[0]!r} appears more than once; give every stem its own.")
    whole = [_whole(name) for name in names]
    if all(value > 0 for value in whole):
        return FieldStems(xy, np.array(whole, np.int64), names)
    return FieldStems(xy, np.arange(1, len(names) + 1), names, counted=True)


def _read_csv(path: Path):
    import pandas as pd

    try:
        return pd.read_csv(io.StringIO(csv_text(path)))
    except InputError:
        raise
    except Exception as problem:
        raise InputError(f"{path}: cannot be read as a table ({problem}); expected columns x, y, tree_id.") from None


def _numbers(path: Path, table: object, columns: tuple[str, str]) -> np.ndarray:
    import pandas as pd

    values = np.column_stack([pd.to_numeric(table[name], errors="coerce") for name in columns])  # type: ignore[index]
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise InputError(f"{path}: line {bad[0] + 2} has no position; expected numbers in {columns[0]}, {columns[1]}.")
    return values


def _whole(name: str) -> int:
    """The id as a whole number that fits a 32-bit field, or 0."""
    try:
        value = float(name)
    except ValueError:
        return 0
    return int(value) if value == int(value) and 0 < value < 2**31 else 0


@dataclass(frozen=True)
class Answer:
    """What was found at one field stem. answer: ``found`` (named after it), ``unsure`` (a stem stands near, but it may
    be another), ``refused`` (seen, not measurable) or ``missing``; reason: of the latter two, a key of the list of
    reasons. gap_m: to the stem meant, ``None`` where there is none. stem: its index."""

    name: str
    answer: str
    reason: str = ""
    gap_m: float | None = None
    stem: int | None = None


def answer_stems(stems: StemMap, field: FieldStems, bh_m: float = 1.3) -> list[Answer]:
    """One answer for each field stem, in their order.

    Field stems and found ones are paired one to one, the distances' sum least, within :data:`FIELD_MATCH_M`. How far a
    pair may be apart follows from how exact the positions are: :data:`GATE_SHARE` times the pairs' median. A pair half
    a metre apart or more is unsure where another stem is hardly farther."""
    feet = np.array([stem.cone.centre(bh_m) for stem in stems.stems]).reshape(-1, 2) + stems.origin
    unseen = np.array([stem.cone.centre(bh_m) for stem in stems.unseen]).reshape(-1, 2) + stems.origin
    gap = np.linalg.norm(feet[:, None] - field.xy[None], axis=2)
    # A cost above the gate lets a stem stay single instead of pushing its neighbour out of a good pair.
    pairs = [
        (i, j)
        for i, j in zip(*linear_sum_assignment(np.where(gap <= FIELD_MATCH_M, gap, 10 * FIELD_MATCH_M)), strict=True)
        if gap[i, j] <= FIELD_MATCH_M
    ]
    gate = FIELD_MATCH_M
    if len(pairs) >= LEAST_PAIRS:
        gate = float(np.clip(GATE_SHARE * np.median([gap[i, j] for i, j in pairs]), LEAST_GATE_M, FIELD_MATCH_M))
    partner = {j: i for i, j in pairs}
    answers = []
    for j, name in enumerate(field.names):
        i = partner.get(j)
        if i is None or gap[i, j] > gate:
            reason = _reason_missing(stems, field.xy[j], unseen, gap[:, j])
            answers.append(Answer(name, "missing", reason, None if i is None else float(gap[i, j])))
            continue
        found, near = stems.stems[i], float(gap[i, j])
        others = np.r_[np.delete(gap[:, j], i), np.delete(gap[i], j)]
        unsure = near >= FAR_M and len(others) > 0 and others.min() < UNSURE_SHARE * near
        answers.append(
            Answer(name, "refused" if found.refused else "unsure" if unsure else "found", found.refused, near, i)
        )
    return answers


def _reason_missing(stems: StemMap, place: np.ndarray, unseen: np.ndarray, gap: np.ndarray) -> str:
    """Why none was found at (2,) ``place``: what the search says of it; another field stem's tree stands there; or the
    cloud has no points there at all."""
    at = np.linalg.norm(unseen - place, axis=1)
    if len(at) and at.min() < SAME_PLACE_M:
        return stems.unseen[int(at.argmin())].refused
    radii = np.array([float(stem.cone.radius(1.3)) for stem in stems.stems])
    return "merged" if (gap < radii + TAKEN_M).any() else "few_points"


def name_stems(stems: StemMap, field: FieldStems, bh_m: float = 1.3) -> tuple[np.ndarray, list[str]]:
    """``(new ids (S + 1,) by old tree_id, names of field stems that were not found)``, by :func:`answer_stems`.

    A stem that is only perhaps the field's is not named. Stems without a name are numbered on from the largest field
    id."""
    return named(stems, field, answer_stems(stems, field, bh_m))


def named(stems: StemMap, field: FieldStems, answers: list[Answer]) -> tuple[np.ndarray, list[str]]:
    """:func:`name_stems` from the answers."""
    new = np.zeros(len(stems.stems) + 1, np.int32)
    for number, answer in zip(field.ids, answers, strict=True):
        if answer.stem is not None and answer.answer in ("found", "refused"):
            new[answer.stem + 1] = number
    rest = np.flatnonzero(new[1:] == 0) + 1
    new[rest] = int(field.ids.max()) + 1 + np.arange(len(rest))
    return new, [answer.name for answer in answers if answer.answer in ("missing", "unsure")]
