"""The trees of a stand table: from a tree layer (with what the field crew knows of them), or from a field tally; what
the crew knows of measured trees, by the pairs layer: species, status, heights, and who is no tree."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd
import pyproj
from scipy.spatial import cKDTree
from shapely.geometry.base import BaseGeometry

from ...core.columns import columns, numbers
from ...core.crs import check_projected
from ...core.errors import CRSError, InputError
from ...core.map_scale import check_place
from ...core.shown import count_of, some
from ...core.tables import read_table
from ...stems.quality.priors import HIGHEST_BREAST_HEIGHT_M, LOWEST_BREAST_HEIGHT_M
from ...stems.quality.repeated import find_repeated
from ..field_trees import read_field_trees
from ..measured import edited, read_measured
from ..options import FieldProtocol
from ..pairs_layer import FIELD, LOCKED, MEASURED, PAIRS, PLOTS, STATUSES, read_layer, refuse_moved
from ..reviewed import TAPE_SE_CM, Reviewed, reviewed
from ..searched import searched_area
from ..side_layers import with_readings
from ..statuses import DEAD, GONE, LIVE
from ..tree_reading import text_of, texts_of
from .sample import SamplePlot, as_searched
from .species import species_of

#: Trees per area that differ by less are of plots of one size.
_SAME_SIZE = 0.02
#: Stems whose axes are nearer than this share of their radii together are one.
_INSIDE = 0.6
#: A crew writes one place for all stems of a fork or a stool: of its tally only stems with the same DBH, within so many
#: cm or this share, are one; not where fewer than so many of those in one another have it.
_SAME_CM, _SAME_SHARE, _MOSTLY = 1.0, 0.04, 0.8
#: Columns of a tree list.
COLUMNS = (
    "tree_id", "plot_id", "x", "y", "dbh_cm", "dbh_se_cm", "height_m", "height_se_m", "species", "dead", "qc_flag",
    "qc_reason", "bh_m", "n_pts", "paired", "note", "meas_cm", "meas_lo_cm", "meas_hi_cm",
)  # fmt: skip
_NUMBERS = (
    "x", "y", "dbh_cm", "dbh_se_cm", "height_m", "height_se_m", "bh_m", "n_pts", "meas_cm", "meas_lo_cm", "meas_hi_cm",
)  # fmt: skip


@dataclass
class TreeList:
    """trees: :data:`COLUMNS` (plot_id as written; x, y may be NaN in a tally; ``paired``: a tally tree is this stem;
    ``meas_cm, meas_lo_cm, meas_hi_cm``: DBH and interval as measured). from_field: DBHs are the crew's.

    centres: plot_id -> co-registered centre, from a pairs layer. tallied: plot_id -> chance that a tree of the plot
    would be found among the pairs. review: what a person decided. searched: where stems were searched for, in
    ``crs`` (None: the layer does not say). plots: those that the trees were taken from (empty: everywhere). notes,
    warnings: sentences.
    """

    trees: pd.DataFrame
    crs: pyproj.CRS | None
    from_field: bool
    centres: dict[str, tuple[float, float]] = field(default_factory=dict)
    tallied: dict[str, float] = field(default_factory=dict)
    review: Reviewed = field(default_factory=Reviewed)
    searched: BaseGeometry | None = None
    plots: list[SamplePlot] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def plots_searched(self, plots: list[SamplePlot], name: str) -> list[SamplePlot]:
        """Plots as far as they were searched (:func:`.sample.as_searched`), with the sentences about it."""
        kept, warnings, notes = as_searched(plots, self.searched, self.trees[["x", "y"]].to_numpy(float), name)
        self.warnings += warnings
        self.notes += notes
        return kept


def _listed(table: pd.DataFrame) -> pd.DataFrame:
    """The columns of a tree list, empty where the table has none."""
    trees = pd.DataFrame({name: table.get(name) for name in COLUMNS})
    return trees.assign(**{name: pd.to_numeric(trees[name]).astype(float) for name in _NUMBERS})


def from_layer(path: Path, crs: pyproj.CRS | None) -> TreeList:
    """Measured trees, with ``status`` as written beside :data:`COLUMNS` (:func:`settle_status` reads it).

    Raises:
        InputError: not readable, or a DBH that no tree has.
    """
    measured = read_measured(path, crs)
    moved_m, typed = float(measured.attrs.get("moved_m", 0.0)), edited(measured)
    if "rev_flag" in measured:
        typed &= measured["rev_flag"].isna().to_numpy()
    named = some(measured["tree_id"][typed], 8)
    # A tape's interval is that of the tape.
    measured = measured.assign(**{f"meas_{end}_cm": measured[f"dbh_{end}_cm"] for end in ("lo", "hi")})
    measured, review = reviewed(measured, path)
    trees = _listed(measured).assign(status=measured.get("status"))
    heights = trees["bh_m"].dropna()
    if len(heights) and not LOWEST_BREAST_HEIGHT_M <= heights.median() <= HIGHEST_BREAST_HEIGHT_M:
        raise InputError(
            f"{path}: bh_m is {heights.median():g} m, expected {LOWEST_BREAST_HEIGHT_M:g} to "
            f"{HIGHEST_BREAST_HEIGHT_M:g}; correct the column (4.5 feet are 1.37 m)."
        )
    # A negative standard error is a mark for "not known" somewhere, never an error.
    trees["dbh_se_cm"] = trees["dbh_se_cm"].where(trees["dbh_se_cm"] >= 0)
    trees["height_m"] = trees["height_m"].where(trees["height_m"] > 0)
    for name in ("plot_id", "species", "status", "note"):
        # An empty cell and a cleared one say the same.
        trees[name] = texts_of(trees[name])
    trees["dead"] = False
    # A person who says that a tree stands there knows it as well as a crew that taped it.
    trees["paired"] = measured["sure"]
    refused = trees["qc_flag"] == "reject"
    by_hand = int((refused & trees["dbh_cm"].notna()).sum())
    trees.loc[refused, "dbh_cm"] = np.nan
    _note(trees, measured["taped"].to_numpy(bool), "DBH by tape")
    trees["qc_flag"] = trees["qc_flag"].where(trees["dbh_cm"].notna(), "reject")
    bad = trees["dbh_cm"].notna() & ~((trees["dbh_cm"] > 0) & (trees["dbh_cm"] < 1000))
    if bad.any():
        raise InputError(
            f"{path}: tree {trees['tree_id'][bad.idxmax()]} has a DBH of {trees['dbh_cm'][bad.idxmax()]:g} cm, "
            "expected above 0 and below 1000; correct the layer."
        )
    trees = with_readings(trees, path)
    searched = searched_area(path, measured.crs)
    found = TreeList(
        trees, measured.crs, False, review=review, searched=searched, notes=review.sentences(Path(path).name)
    )
    found.warnings += measured.attrs.get("said", [])
    if by_hand:
        found.warnings.append(
            f"{count_of(by_hand, 'tree')} of {Path(path).name} with a DBH {'has' if by_hand == 1 else 'have'} qc_flag "
            "reject and count as stems without one; where no tree stands write 'no tree', or reject it by the verb "
            "review."
        )
    if typed.any():
        found.warnings.append(
            f"The DBH of {count_of(int(typed.sum()), 'tree')} of {Path(path).name} (tree {named}) is not that of the "
            "basal area: typed over the measured one, and counted with its error; give taped DBHs by the verb review, "
            "which keeps both."
        )
    if moved_m:
        found.warnings.append(
            f"The points of {Path(path).name} lie {moved_m:.1f} m from their rows' x, y: the layer was moved, or given "
            "another CRS; they count where their points are."
        )
    found.warnings += _doubles(path, trees)
    for name in ("species", "status"):
        if n := int(trees[name].notna().sum()):
            found.notes.append(f"{name.capitalize()} of {count_of(n, 'tree')} as written in the tree layer.")
    return found


def _note(trees: pd.DataFrame, rows: np.ndarray | pd.Series, text: str) -> None:
    """Put a remark before what is noted of some trees."""
    said = trees.loc[rows, "note"].map(lambda note: "" if note is None else f"; {note}")
    trees.loc[rows, "note"] = text + said


def on_the_map(found: TreeList, path: Path, crs: pyproj.CRS | None) -> TreeList:
    """The same in a CRS that distances can be measured in; crs: where the file holds none.

    Raises:
        CRSError: none, or no projected one in metres. InputError: places that cannot be.
    """
    found.crs = found.crs or crs
    if found.crs is None:
        raise CRSError(f"{path}: holds no CRS; give it with --crs.")
    check_projected(found.crs, str(path))
    check_place(found.crs, found.trees[["x", "y"]].to_numpy(float), str(path))
    return found


def _doubles(path: Path, trees: pd.DataFrame, tally: bool = False) -> list[str]:
    """Stems that stand inside one another are one stem, measured twice; so are all of two scans not registered. In a
    crew's tally the DBHs have to be the same, too.

    Returns:
        a sentence about a few of them.

    Raises:
        InputError: there are more.
    """
    stems = trees[trees[["x", "y", "dbh_cm"]].notna().all(axis=1)]
    xy, radius = stems[["x", "y"]].to_numpy(float), stems["dbh_cm"].to_numpy(float) / 200
    if len(stems) < 2:
        return []
    if repeated := find_repeated(xy, stems["dbh_cm"].to_numpy(float)):
        raise InputError(
            f"{path}: {repeated.text(len(xy))}; each would count double: register the scans and measure again, or keep "
            "one stem of each pair."
        )
    i, j = cKDTree(xy).query_pairs(2 * float(radius.max()), output_type="ndarray").T
    twice = np.hypot(*(xy[i] - xy[j]).T) < _INSIDE * (radius[i] + radius[j])
    if tally:
        off_cm, mean_cm = 200 * np.abs(radius[i] - radius[j]), 100 * (radius[i] + radius[j])
        alike = twice & (off_cm <= np.maximum(_SAME_CM, _SAME_SHARE * mean_cm) + 1e-9)
        twice = alike & (alike.sum() >= _MOSTLY * twice.sum())
    if not twice.any():
        return []
    ids = stems["tree_id"].to_numpy()
    named = some((f"{a} and {b}" for a, b in zip(ids[i[twice]], ids[j[twice]], strict=True)), 5)
    remedy = "correct their places" if tally else "merge them by the verb review"
    text = (
        f"{path}: {count_of(int(twice.sum()), 'pair')} of trees stand in one another ({named}): one stem "
        f"measured twice counts twice; delete one of each pair, or {remedy}."
    )
    if twice.sum() >= (5 if tally else 3) and twice.sum() > 0.05 * len(stems):
        raise InputError(text)
    return [text]


def from_tally(path: Path, protocol: FieldProtocol) -> TreeList:
    """The crew's own tally as the tree list.

    Raises:
        InputError: as :func:`read_tally`; trees of plots of several sizes.
    """
    table = read_tally(path, protocol)
    _refuse_several_sizes(path)
    trees = _listed(table)
    # The crew walked up to each of them: a tree without a DBH is a tree.
    trees["paired"] = True
    trees["tree_id"] = table["field_id"].astype(str)
    trees["qc_flag"] = np.where(trees["dbh_cm"].notna(), "ok", "reject")
    trees["qc_reason"] = ""
    found = TreeList(trees, None, True)
    found.warnings += table.attrs["said"]
    if unread := table.attrs["unread"]:
        found.notes.append(f"Columns of {Path(path).name} that nothing was taken from: {some(unread, 20)}.")
    for name in ("status", "azimuth_deg", "distance_m", "line"):
        found.trees[name] = table.get(name)
    settle_status(found)
    found.warnings += _doubles(path, _plot_by_plot(found.trees), tally=True)
    return found


def _plot_by_plot(trees: pd.DataFrame) -> pd.DataFrame:
    """A tally's trees with x and y as if its plots lay a kilometre from one another, where it has bearings."""
    bearing, distance = (pd.to_numeric(trees[name]).astype(float) for name in ("azimuth_deg", "distance_m"))
    if bearing.isna().all():
        return trees
    east = 1000.0 * pd.factorize(trees["plot_id"])[0] + distance * np.sin(np.radians(bearing))
    return trees.assign(x=east, y=distance * np.cos(np.radians(bearing)))


def read_tally(path: Path, protocol: FieldProtocol) -> pd.DataFrame:
    """The field table as :func:`~treedgs_geo.inventory.field_trees.read_field_trees` reads it, with ``height_m``.

    A table without positions (no bearing and distance, no coordinates) is read too: it needs a DBH column.

    Raises:
        InputError: file, line, what was found and what was expected.
    """
    placed = bool(columns(read_table(path), "azimuth", "distance", "easting"))
    return read_field_trees(path, protocol, heights=True, placed=placed)


def _refuse_several_sizes(path: Path) -> None:
    """Refuse trees that stand for areas of several sizes, as FIA's of subplots and microplots do: a plot has one."""
    cells = read_table(path)
    column = columns(cells, "expansion").get("expansion")
    sizes = [] if column is None else sorted(numbers(path, cells, column.name).replace(0, np.nan).dropna().unique())
    if column is not None and len(sizes) > 1 and sizes[-1] > (1 + _SAME_SIZE) * sizes[0]:
        raise InputError(
            f"{path}: {column.name} is {sizes[0]:g} and {sizes[-1]:g}: its trees are of plots of several sizes, "
            "expected those of one; keep the trees of one size (in FIA's table those of the subplots, 5 inches and "
            "thicker, or the saplings of the microplots) and give that size in the plots table."
        )


def settle_status(found: TreeList) -> None:
    """Turn ``status`` into ``dead``; trees that are gone count nowhere, unknown words as live: both are named."""
    words = found.trees.pop("status").map(lambda status: text_of(status).lower())
    gone = words.isin(GONE)
    if gone.any():
        said = ", ".join(f"{word!r}" for word in words[gone].unique()[:5])
        found.notes.append(f"Status {said}: {count_of(int(gone.sum()), 'tree')} no longer there, counted nowhere.")
        found.trees, words = found.trees[~gone].reset_index(drop=True), words[~gone].reset_index(drop=True)
    found.trees["dead"] = words.isin(DEAD).to_numpy()
    odd = words[~words.isin(LIVE | DEAD)].value_counts()
    if len(odd):
        named = ", ".join(f"{word!r} ({count_of(int(n), 'tree')})" for word, n in odd.head(5).items())
        found.warnings.append(f"Status {named}: not known as live or dead; these trees count as live.")


def label_species(trees: pd.DataFrame, default: str | None) -> pd.DataFrame:
    """Replace the entries by symbols; ``default`` where there is none."""
    named = trees.copy()
    filled = named["species"].where(named["species"].notna(), default)
    named["species"] = [species_of(entry).symbol for entry in filled]
    return named


def measured_trees(
    path: Path, crs: pyproj.CRS | None, pairs: Path | None = None, tally: pd.DataFrame | None = None
) -> TreeList:
    """The trees of a layer; species, status and heights as written there, where nothing is written by the crew's.

    Raises:
        InputError: not readable; a pairs layer of other trees, or edited since match-plots wrote it.
    """
    found = from_layer(path, crs)
    if pairs is not None:
        _from_pairs(found, pairs, tally)
    elif tally is not None:
        found.warnings.append(
            "The field table is not used: without --pairs (from match-plots) nothing says which of its trees is which."
        )
    settle_status(found)
    return found


def _from_pairs(found: TreeList, path: Path, tally: pd.DataFrame | None) -> None:
    """Fill in species, status, heights, DBHs of stems without one, co-registered plot centres, and what was tallied.

    What a person wrote in the tree layer stays. Refused are pairs of other trees, or edited since match-plots wrote
    them.
    """
    pairs, crew, plots = read_layer(path, PAIRS), read_layer(path, FIELD), read_layer(path, PLOTS)
    if pairs["pair_status"].isna().any() or set(pairs["pair_status"]) - set(STATUSES):
        raise InputError(f"{path}: a pair has an unknown status or none; run match-plots again onto this file.")
    used = pairs[(pairs["pair_status"] != "rejected") & pairs["tree_id"].notna()].astype({"tree_id": int})
    trees = found.trees
    if (lost := used["tree_id"][~used["tree_id"].isin(trees["tree_id"])].tolist()) and lost[0] in found.review.left_out:
        raise InputError(
            f"{path}: pairs tree {lost[0]}, which a person rejected or merged since; run match-plots again onto this "
            "file."
        )
    if lost:
        raise InputError(
            f"{path}: pairs tree {lost[0]}, which is not in the tree layer; give the layer that was paired, or run "
            "match-plots again."
        )
    place = trees.set_index("tree_id")[["x", "y"]]
    for _, pair in used[used.geometry.notna() & ~used.geometry.is_empty].iterrows():
        refuse_moved(path, pair, tuple(place.loc[pair["tree_id"]]))
    trees.loc[trees["tree_id"].isin(used["tree_id"]), "paired"] = True
    key = ["plot_id", "field_id"]
    texts = dict.fromkeys(key, str)
    crew_knows = pd.DataFrame(crew).astype(texts).reindex(columns=[*key, "species", "status", "dbh_cm"])
    if tally is not None:
        only = plots["plot_id"].iloc[0] if len(plots) == 1 else None
        heights = tally.assign(plot_id=tally["plot_id"].where(tally["plot_id"].notna(), only)).astype(texts)
        crew_knows = crew_knows.merge(heights[[*key, "height_m"]], how="left", on=key)
    paired = pd.DataFrame(used[[*key, "tree_id"]]).astype(texts)
    theirs = paired.merge(crew_knows, on=key).drop_duplicates("tree_id").set_index("tree_id")
    theirs = theirs.reindex(columns=["species", "status", "dbh_cm", "height_m"], index=trees["tree_id"])
    theirs = theirs.set_axis(trees.index)
    differ = _take(trees, theirs)
    taped = trees["dbh_cm"].isna() & (theirs["dbh_cm"] > 0)
    trees.loc[taped, "dbh_cm"], trees.loc[taped, "dbh_se_cm"] = theirs["dbh_cm"][taped], TAPE_SE_CM
    _note(trees, taped, "DBH by the field crew")
    higher = trees["height_m"].isna() & theirs["height_m"].notna()
    trees.loc[higher, "height_m"] = theirs["height_m"][higher].astype(float)
    found.notes.append(
        f"Species and status of {len(used)} trees come from the field crew, by {path.name}"
        + (f"; {int(higher.sum())} heights too." if higher.any() else ".")
    )
    if n_taped := int(taped.sum()):
        found.notes.append(
            f"{count_of(n_taped, 'stem')} without a measured DBH {'has' if n_taped == 1 else 'have'} the crew's "
            f"(standard error {TAPE_SE_CM:g} cm)."
        )
    if differ:
        found.warnings.append(
            f"The tree layer and the field crew differ on {len(differ)} entries ({some(differ, 5, '; ')}): the tree "
            "layer's count."
        )
    if n_hand := int(used["pair_status"].isin(LOCKED).sum()):
        found.notes.append(f"Checked or drawn by a person: {n_hand} of these pairs.")
    for _, plot in plots[plots["status"] != "check"].iterrows():
        found.centres[str(plot["plot_id"])] = (float(plot["x"]), float(plot["y"]))
    found.tallied = _tallied(read_layer(path, MEASURED), crew, set(found.centres))


def _take(trees: pd.DataFrame, theirs: pd.DataFrame) -> list[str]:
    """The crew's species and status where the layer has none; what differs, in words."""
    differ = []
    rules = {
        "species": lambda entry: species_of(entry).symbol.upper(),
        "status": lambda entry: text_of(entry).lower() in DEAD,
    }
    for name, same in rules.items():
        own, crew = trees[name], texts_of(theirs[name])
        both = own.notna() & crew.notna()
        differ += [
            f"tree {tree}: {mine}, crew {other}"
            for tree, mine, other in zip(trees["tree_id"][both], own[both], crew[both], strict=True)
            if same(mine) != same(other)
        ]
        trees[name] = own.where(own.notna(), crew)
    return differ


def _tallied(measured: pd.DataFrame, crew: pd.DataFrame, placed: set[str]) -> dict[str, float]:
    """plot_id -> chance that a tree of the plot would be among its pairs.

    It has to be in the tally (share of the measured trees inside the plot that have a partner), and to be found there
    (share of the tally that has one).
    """
    found = {}
    inside = measured[(measured["in_plot"] == "in") & measured["dbh_cm"].notna()]
    listed = crew[~crew["paired"].isin(["rejected", "unsearched"])]
    for plot in placed:
        mine, theirs = inside[inside["plot_id"] == plot], listed[listed["plot_id"] == plot]
        if len(mine) and len(theirs):
            found[plot] = float((mine["paired"] == "yes").mean() * (theirs["paired"] == "yes").mean())
    return found
