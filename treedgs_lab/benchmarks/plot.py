"""A simulated or rendered plot with everything that is true of it, and how trees are scored against that. Only this
room and the tests look at ``truth/``."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.distance import cdist

from treedgs_geo.core.crs import LocalFrame, lonlat_to_project, project_crs
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.plots import read_plots
from treedgs_geo.core.progress import Reporter
from treedgs_geo.geotags.gpstime import parse_datetime_unix, utc_to_gps
from treedgs_geo.geotags.rtklib import read_pos
from treedgs_geo.inventory.accuracy.scores import MATCH_M, Accuracy, pair_by_position, score
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import Camera, View
from treedgs_geo.reconstruction.model import load_views
from treedgs_geo.run.context import Site
from treedgs_geo.stems.quality.tree import Tree
from treedgs_geo.terrain.dtm import Dtm, read_dtm

#: A view of a breast height counts as clear with this share seen, and not too steep (``truth/visibility.csv``).
CLEAR_SHARE, CLEAR_FORESHORTENING = 0.7, 0.35
#: A stem counts as visible with so many clear photos of its breast height.
CLEAR_VIEWS = 3
#: Stems this far outside the plot's circle are measured too (``PhotoStemOptions.margin_m`` is 1 m) and count.
RIM_M = 0.7
#: Options of ``simulate-plot`` for a plot whose cloud is used: as few and small photos as it allows.
FEW_PHOTOS: dict = {"photos": 10, "image_width": 320, "image_height": 240, "gsd_cm": 2.5, "samples": 1}
#: Pulses per square metre, one after the other: plots of different sizes.
DENSITIES = (400.0, 700.0, 1000.0, 1400.0)


@dataclass(frozen=True)
class TruePlot:
    """folder: of the plot. frame: local frame of the renderer. radius_m: of each plot. centres: (n, 2) of the plots of
    the flight, in the local frame; a single one lies at the origin."""

    folder: Path
    frame: LocalFrame
    radius_m: float
    centres: np.ndarray = field(default_factory=lambda: np.zeros((1, 2)))

    @classmethod
    def load(cls, folder: Path) -> TruePlot:
        """Read ``truth/config.json``.

        Raises:
            InputError: the folder is no simulated plot.
        """
        path = Path(folder) / "truth" / "config.json"
        try:
            record = json.loads(path.read_text(encoding="utf-8"))
            frame = LocalFrame(project_crs(f"EPSG:{record['epsg']}"), np.array(record["origin_E_N_h"], float))
        except (OSError, ValueError, KeyError) as problem:
            raise InputError(
                f"{path}: is not the truth of a simulated plot ({problem}); give a folder that simulate-plot wrote."
            ) from None
        centres = np.array(record.get("plot_centres_local_m", [[0.0, 0.0]]), float)
        return cls(Path(folder), frame, float(record["config"]["radius_m"]), centres)

    def near(self, xy: np.ndarray) -> np.ndarray:
        """(N, 2) local -> (N,) bool: within a circle that is scored."""
        return cdist(xy, self.centres).min(axis=1) <= self.radius_m + RIM_M

    @cached_property
    def trees(self) -> pd.DataFrame:
        """``truth/trees.csv`` with local ``x_bh, y_bh``; ``in_plot`` (bool); ``near``: in a circle that is scored."""
        table = pd.read_csv(self.folder / "truth" / "trees.csv")
        table["in_plot"] = table["in_plot"].astype(str).str.lower() == "true"
        table["x_bh"], table["y_bh"] = table["E_bh"] - self.frame.origin[0], table["N_bh"] - self.frame.origin[1]
        table["near"] = self.near(table[["x_bh", "y_bh"]].to_numpy(float))
        return table

    @cached_property
    def visibility(self) -> pd.DataFrame:
        """``truth/visibility.csv`` with ``clear`` (bool)."""
        table = pd.read_csv(self.folder / "truth" / "visibility.csv")
        table["clear"] = (
            (table["visible_fraction"] >= CLEAR_SHARE)
            & (table["in_frame"] == 1)
            & (table["foreshortening"] > CLEAR_FORESHORTENING)
        )
        return table

    @cached_property
    def dtm(self) -> Dtm:
        """The true ground."""
        return read_dtm(self.folder / "dtm.tif", self.frame.crs)

    def views(self) -> list[View]:
        """The renderer's own cameras, in the local frame, with the travel of each while it is read out.

        Decentring, k3 and travel are columns of ``truth/cameras.csv``. Where those are missing (another renderer), the
        lens is completed from ``truth/config.json``, and the travel is its ``readout_s`` times the velocity of the
        ``.pos`` track at the photo's time.
        """
        with open(self.folder / "truth" / "cameras.csv", encoding="utf-8") as stream:
            rows = list(csv.DictReader(stream))
        if rows and "travel_e_m" in rows[0]:
            travel = np.array([[float(row[f"travel_{axis}_m"]) for axis in "enu"] for row in rows])
        else:
            travel = self._travel_by_track([row["utc"] for row in rows])
        return [self._view(row, moved) for row, moved in zip(rows, travel, strict=True)]

    @cached_property
    def _config(self) -> dict:
        """What the renderer was set to."""
        record = json.loads((self.folder / "truth" / "config.json").read_text(encoding="utf-8"))
        return dict(record["config"])

    def _view(self, row: dict[str, str], travel: np.ndarray) -> View:
        number = {key: float(row[key]) for key in row if key not in ("image", "kind", "utc")}
        rotation = np.array([[number[f"r{i}{j}"] for j in range(3)] for i in range(3)])
        lens = [number[name] for name in ("fx", "fy", "cx", "cy", "k1", "k2")]
        rest = [number[name] if name in number else float(self._config.get(name, 0)) for name in ("p1", "p2", "k3")]
        camera = Camera(int(number["width"]), int(number["height"]), *lens, *rest)
        place = np.array([number[k] for k in ("tx", "ty", "tz")])
        path = self.folder / "images" / row["image"]
        return View(row["image"], path, camera, rotation, place, int(number["flight"]), travel)

    def _travel_by_track(self, utc: list[str]) -> np.ndarray:
        """(P, 3) metres that the camera moves over the readout, by the velocity of the ``.pos`` track."""
        readout_s = float(self._config.get("readout_s", 0))
        found = sorted(self.folder.glob("*.pos"))
        if not readout_s or not found:
            return np.zeros((len(utc), 3))
        track = read_pos(found[0])
        xyz = self.frame.to_local(lonlat_to_project(self.frame.crs, track.lon_deg, track.lat_deg, track.height_m))
        gps_s = utc_to_gps(np.array([parse_datetime_unix(text.replace("T", " ")) for text in utc]))
        return readout_s * np.array([_velocity(track.gps_s, xyz, track.quality, t) for t in gps_s])

    def cloud(self) -> PointCloud:
        """The simulated LiDAR.

        Raises:
            InputError: the plot has none.
        """
        from treedgs_geo.pointcloud.files import read_cloud

        found = sorted((self.folder / "lidar").glob("*.laz")) if (self.folder / "lidar").exists() else []
        if not found:
            raise InputError(f"{self.folder}: has no lidar/*.laz; simulate it with --lidar-density-m2 above 0.")
        return read_cloud(found[0], attributes=("intensity",))

    def clear_views(self, images: set[str]) -> dict[str, int]:
        """Clear views of each tree's breast height in these photos."""
        seen = self.visibility[self.visibility["clear"] & self.visibility["image"].isin(images)]
        counts = seen.groupby("tree_id").size().to_dict()
        return {str(tree): int(counts.get(tree, 0)) for tree in self.trees["tree_id"]}

    @cached_property
    def anything(self) -> np.ndarray:
        """(K, 2) local places of stems and saplings, foot and breast height: a DBH there is no invention."""
        record = json.loads((self.folder / "truth" / "stems.json").read_text(encoding="utf-8"))
        saplings = np.array([row[:2] for row in record.get("saplings_xy_dbhcm", [])], float).reshape(-1, 2)
        feet = self.trees[["E_base", "N_base"]].to_numpy(float) - self.frame.origin[:2]
        return np.vstack([self.trees[["x_bh", "y_bh"]].to_numpy(float), feet, saplings])


def site_of(plot: Path, workspace: Path | None = None) -> Site:
    """Photos, ground and area of the plots: the renderer's own, or of a workspace of the chain (its ground where it has
    one)."""
    truth = TruePlot.load(plot)
    frame, views = (truth.frame, truth.views()) if workspace is None else load_views(workspace / "sfm", plot / "images")
    own = workspace and workspace / "dtm.tif"
    dtm = read_dtm(own, frame.crs) if own and own.exists() else truth.dtm
    plots = read_plots(plot / "plots.csv", frame.crs)
    centres = frame.to_local(np.array([[p.x, p.y, frame.origin[2]] for p in plots]))[:, :2]
    return Site(frame, views, dtm, Area.circles(centres, np.array([p.radius_m for p in plots])))


def _velocity(times: np.ndarray, xyz: np.ndarray, quality: np.ndarray, at: float, half_s: float = 1.0) -> np.ndarray:
    """(3,) slope at ``at`` of a cubic through the epochs within ``half_s`` seconds that have the nearest one's quality
    (a float burst is shifted as a whole); zero where there are fewer than six."""
    nearest = int(np.argmin(np.abs(times - at)))
    near = (np.abs(times - at) <= half_s) & (quality == quality[nearest])
    if near.sum() < 6:
        return np.zeros(3)
    return np.polyfit(times[near] - at, xyz[near], 3)[2]


def score_trees(plot: TruePlot, trees: list[Tree], clear: dict[str, int] | None = None) -> list[dict]:
    """One row a true stem that counts, and one a tree with a DBH where nothing stands.

    Pairs are made by position alone, measured trees first. Rows: ``tree_id, kind, true_cm, read_cm, se_cm, lo_cm,
    hi_cm, flag`` (``absent``: not found; ``false``: no such stem, ``true_cm`` None), ``reason, clear`` and, of a flight
    over several plots, ``plot_id``.
    """
    truth = plot.trees
    places = truth[["x_bh", "y_bh"]].to_numpy(float)
    rows = []
    with_dbh = [tree for tree in trees if tree.dbh_cm is not None]
    partner: dict[int, Tree] = {}
    for group in (with_dbh, [tree for tree in trees if tree.dbh_cm is None]):
        free = [k for k in range(len(truth)) if k not in partner]
        found = np.array([[t.x, t.y] for t in group], float).reshape(-1, 2) - plot.frame.origin[:2]
        for i, j in pair_by_position(places[free], found, MATCH_M):
            partner[free[int(i)]] = group[int(j)]
    for k, stem in truth.iterrows():
        if not stem["near"]:
            continue
        tree = partner.get(int(k))
        rows.append(
            {
                "tree_id": str(stem["tree_id"]),
                "kind": stem["kind"],
                "true_cm": round(float(stem["dbh_cm"]), 3),
                **_read(tree),
                "clear": None if clear is None else clear.get(str(stem["tree_id"]), 0),
                **({"plot_id": stem["plot_id"]} if "plot_id" in truth else {}),
            }
        )
    used = {id(tree) for tree in partner.values()}
    for tree in with_dbh:
        place = np.array([[tree.x, tree.y]]) - plot.frame.origin[:2]
        # Farther out the truth table ends before the cloud does.
        if not plot.near(place)[0]:
            continue
        if id(tree) not in used and cdist(place, plot.anything).min() > MATCH_M:
            rows.append(
                {
                    "tree_id": f"#{tree.tree_id}",
                    "kind": "nothing",
                    "true_cm": None,
                    **_read(tree),
                    "clear": None,
                    "false": True,
                }
            )
    return rows


def _read(tree: Tree | None) -> dict:
    if tree is None:
        return {"read_cm": None, "se_cm": None, "lo_cm": None, "hi_cm": None, "flag": "absent", "reason": ""}
    number = {
        name: None if value is None else round(float(value), 3)
        for name, value in (
            ("read_cm", tree.dbh_cm),
            ("se_cm", tree.dbh_se_cm),
            ("lo_cm", tree.dbh_lo_cm),
            ("hi_cm", tree.dbh_hi_cm),
        )
    }
    return {**number, "flag": tree.qc_flag, "reason": tree.qc_reason or ""}


def in_plot_rows(plot: TruePlot, trees: list[Tree]) -> list[dict]:
    """Rows of :func:`score_trees` of the stems that stand in a plot, with the clear views of all photos, and of trees
    where nothing stands."""
    rows = score_trees(plot, trees, plot.clear_views({view.name for view in plot.views()}))
    inside = set(plot.trees.loc[plot.trees["in_plot"], "tree_id"].astype(str))
    return [row for row in rows if row["tree_id"] in inside or row.get("false")]


def accuracy_of(rows: list[dict], min_clear: int = 0) -> Accuracy:
    """Pooled accuracy of rows of :func:`score_trees`: of stems with so many clear views."""
    stems = [row for row in rows if not row.get("false") and (row["clear"] or 0) >= min_clear]
    read = [row for row in stems if row["read_cm"] is not None]
    true = np.array([row["true_cm"] for row in read])
    inside = np.array([row["lo_cm"] is not None and row["lo_cm"] <= row["true_cm"] <= row["hi_cm"] for row in read])
    errors = np.array([row["read_cm"] for row in read]) - true
    return score(errors, true, len(stems), sum(bool(row.get("false")) for row in rows), inside)


def plots_of(given: Path | None, folder: Path, quick: bool, reporter: Reporter) -> list[Path]:
    """The plots to run on: those given (a plot, or a folder of plots), or simulated ones.

    Raises:
        InputError: the folder holds no simulated plot.
    """
    from ..simulate.settings import SimulateSettings
    from ..simulate.simulate import simulate_plot

    if given is not None:
        found = [given] if (given / "truth").exists() else sorted(p.parent for p in given.glob("*/truth"))
        if not found:
            raise InputError(f"{given}: holds no simulated plot (a folder with truth/); make one with simulate-plot.")
        for plot in found:
            TruePlot.load(plot)
        return [plot.resolve() for plot in found]
    wanted = [41] if quick else [41, 42, 43]
    plots = []
    for seed in wanted:
        plot = folder / "plots" / f"sim{seed}"
        if not (plot / "truth" / "config.json").exists():
            with reporter.stage(f"simulate plot {seed}", 0.0, 1.0):
                size = {"preset": "plot", "radius_m": 9.0, "photos": 50, "samples": 3} if quick else {"preset": "plot"}
                simulate_plot(
                    SimulateSettings(
                        output=plot, seed=seed, touching_saplings=1, strong_leans=1, lean_max_deg=8.0, **size
                    ),
                    reporter,
                )  # type: ignore[arg-type]
        plots.append(plot.resolve())
    return plots
