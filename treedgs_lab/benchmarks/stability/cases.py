"""Run the stability suite: every case is rendered, measured and scored once and kept, so that a stopped run resumes."""

from __future__ import annotations

import hashlib
import json
import shutil
import tempfile
import time
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from treedgs_geo import __version__
from treedgs_geo.core.errors import TreeDGSError
from treedgs_geo.core.files import write_json
from treedgs_geo.core.progress import Reporter
from treedgs_geo.core.settings import build
from treedgs_geo.pointcloud.cloud import PointCloud
from treedgs_geo.reconstruction.area import Area
from treedgs_geo.reconstruction.cameras import View
from treedgs_geo.stems.cloud.estimate.cloud import measure_cloud
from treedgs_geo.stems.photos.options import PhotoStemOptions
from treedgs_geo.stems.photos.route import search_photos
from treedgs_geo.stems.photos.trees import trees_of_photo_fits
from treedgs_geo.stems.quality.tree import Tree, with_block_errors
from treedgs_geo.terrain.dtm import Dtm

from ...simulate.settings import SimulateSettings
from ...simulate.simulate import simulate_plot
from ...simulate.trouble import TroubleSettings
from ..plot import TruePlot, score_trees
from ..records import code_digest
from . import perturb
from .factors import BASE, CLOUD, FACTORS, PHOTOS, Factor

#: Method -> what it reads.
METHODS = {"photos": PHOTOS, "lidar": CLOUD}
#: Troubles of photos that need no rendering: factor -> setting.
PHOTO_TROUBLES = {
    "shaken": ("shake_px", {"shaken_pct": 10.0}),
    "misexposed": ("misexposed_stops", {"misexposed_pct": 10.0}),
    "exposure": ("exposure_drift_stops", {}),
    "white": ("white_drift_pct", {}),
}
#: How well photos see the ground, standard deviation of the height of a whole plot (``plot_a``: 1.4 cm off), metres.
SEEN_GROUND_SD_M = 0.03


@dataclass(frozen=True)
class Case:
    """One factor at one level with one seed, by one method."""

    factor: Factor
    level: float
    seed: int
    method: str

    @property
    def name(self) -> str:
        """Of its file."""
        return f"{self.factor.key}-{self.level:g}-{self.seed}-{self.method.replace(' ', '_')}"

    @property
    def stand(self) -> int:
        """Seed of the stand: one for each factor, so that no stem's own error counts in all of them."""
        return 1000 * self.seed + zlib.crc32(self.factor.key.encode()) % 1000

    @property
    def plot_settings(self) -> dict[str, Any]:
        """What ``simulate-plot`` is given (without output)."""
        changed = {} if self.is_base else self.factor.render.get(self.level, {})
        return {**BASE, **changed, "seed": self.stand}

    @property
    def is_base(self) -> bool:
        """The first level of every factor is its untroubled plot."""
        return self.level == self.factor.levels[0]


def all_cases(seeds: list[int], factors: list[str] | None = None, methods: list[str] | None = None) -> list[Case]:
    """Every case, seed by seed, so that a stopped run has whole seeds."""
    return [
        Case(factor, level, seed, method)
        for seed in seeds
        for factor in FACTORS
        if not factors or factor.key in factors
        for level in factor.levels
        for method, reads in METHODS.items()
        if reads in factor.inputs and (not methods or method in methods)
    ]


def run_cases(
    cases: list[Case], folder: Path, reporter: Reporter | None = None, seconds: float = np.inf
) -> Iterator[dict]:
    """Records of the cases; what is kept in ``folder`` is not run again, whatever code measured it. Begins no
    case after ``seconds``, and goes on with those that are kept."""
    reporter, began, code = reporter or Reporter(), time.monotonic(), code_digest()
    same: dict[tuple, dict] = {}
    for number, case in enumerate(cases):
        kept = folder / "cases" / f"{case.name}.json"
        record = _kept(kept)
        key = (case.stand, case.method, "base" if case.is_base else case.name)
        if record is not None:
            same.setdefault(key, record)
            yield record
            continue
        if time.monotonic() - began > seconds:
            continue  # what is kept of the later ones is still said
        reporter.progress(number / len(cases), case.name)
        if key in same:
            record = {**same[key], "factor": case.factor.key, "level": case.level}
        else:
            record = same[key] = {"version": __version__, "code": code, **_run(case, folder, reporter)}
        write_json(kept, record)
        yield record


def _kept(path: Path) -> dict | None:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def plot_of(case: Case, folder: Path, reporter: Reporter) -> TruePlot:
    """The rendered plot of a case; rendered once."""
    settings = case.plot_settings
    key = hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:12]
    place = folder / "plots" / key
    if not (place / "truth" / "config.json").exists():
        with reporter.stage(f"render {case.factor.key} {case.level:g}", 0.0, 1.0):
            simulate_plot(SimulateSettings(output=place, name="p", **settings), Reporter())
    return TruePlot.load(place)


def _run(case: Case, folder: Path, reporter: Reporter) -> dict:
    plot = plot_of(case, folder, reporter)
    rng = np.random.default_rng([case.seed, *case.factor.key.encode()])
    began = time.perf_counter()
    clear: dict[str, int] | None = None
    refused = ""
    try:
        if METHODS[case.method] == PHOTOS:
            trees, images = photo_trees(case, plot, rng)
            clear = plot.clear_views(images)
        else:
            trees = measure_cloud(*_spoiled_cloud(case, plot, rng))[0]
    except TreeDGSError as problem:
        trees, refused = [], str(problem)
    return {
        "factor": case.factor.key,
        "level": case.level,
        "seed": case.seed,
        "stand": case.stand,
        "method": case.method,
        "seconds": round(time.perf_counter() - began, 2),
        "refused": refused,
        "rows": score_trees(plot, trees, clear),
    }


def photo_trees(case: Case, plot: TruePlot, rng: np.random.Generator) -> tuple[list[Tree], set[str]]:
    """Trees measured in the photos, spoiled as the case says, with true cameras and ground else; and the names of the
    photos used."""
    views: list[View] = plot.views()
    ground = plot.dtm.local(plot.frame).height
    what, level = case.factor.perturb, case.level
    changed = not case.is_base
    scratch = None
    try:
        if changed and what == "views":
            views = perturb.few_views(views, int(level), rng)
        elif changed and what == "sector":
            views = perturb.sector_views(views, level, rng)
        elif changed and what == "poses":
            views = perturb.noisy_poses(views, level, rng)
        elif changed and what == "dtm":
            ground = perturb.shifted_ground(ground, level)
        elif changed and what == "scale":
            factor = 1 + scale_off(case)
            views, ground = perturb.scaled_views(views, factor), perturb.scaled_ground(ground, factor)
        elif changed and what in PHOTO_TROUBLES:
            setting, more = PHOTO_TROUBLES[what]
            scratch = Path(tempfile.mkdtemp(prefix="treedgs-photos-"))
            views = perturb.troubled_photos(views, build(TroubleSettings, {setting: level, **more}), scratch, rng)
        area = Area.circle(0.0, 0.0, plot.radius_m)
        fits = search_photos(views, ground, area, PhotoStemOptions()).fits
        known = _known_errors(case, rng)
        trees = [with_block_errors(tree, *known) for tree in trees_of_photo_fits(fits, plot.frame)]
        return trees, {view.name for view in views}
    finally:
        if scratch is not None:
            shutil.rmtree(scratch, ignore_errors=True)


def scale_off(case: Case) -> float:
    """How much too large (share) the block of a ``scale`` case is: drawn from what its geotags allow."""
    drawn = np.random.default_rng([case.seed, *case.factor.key.encode(), round(100 * case.level)])
    return case.level / 100 * float(drawn.standard_normal())


def _known_errors(case: Case, rng: np.random.Generator) -> tuple[float, float]:
    """What the chain knows of the errors that a case gives its whole plot: ``scale_sd``, ``ground_m``.

    Of the scale its standard error, never its error. Of the ground how far the terrain model lies from the one that
    the photos see, which is itself off by :data:`SEEN_GROUND_SD_M`.
    """
    if case.is_base:
        return 0.0, 0.0
    if case.factor.perturb == "dtm":
        return 0.0, case.level + SEEN_GROUND_SD_M * float(rng.standard_normal())
    return (case.level / 100 if case.factor.perturb == "scale" else 0.0), 0.0


def _spoiled_cloud(case: Case, plot: TruePlot, rng: np.random.Generator) -> tuple[PointCloud, Dtm]:
    cloud, dtm, truth = plot.cloud(), plot.dtm, plot.trees
    stems = truth[["E_bh", "N_bh", "h_base"]].to_numpy(float)
    what, level = case.factor.perturb, case.level
    if case.is_base:
        return cloud, dtm
    if what == "dtm":
        dtm = replace(dtm, heights=dtm.heights + level)
    elif what == "density":
        cloud = perturb.thin_cloud(cloud, level / case.factor.levels[0], rng)
    elif what == "range_noise":
        cloud = perturb.noisy_cloud(cloud, level / 100, rng)
    elif what == "clutter":
        cloud = perturb.cluttered_cloud(cloud, stems, level, rng)
    elif what == "arc":
        cloud = perturb.one_side_of_stems(cloud, np.column_stack([stems, truth["dbh_cm"] / 200]), level, rng)
    return cloud, dtm
