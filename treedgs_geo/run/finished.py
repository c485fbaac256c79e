"""What a run of the photo chain left in its workspace, read when it is asked for."""

from __future__ import annotations

import os
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from ..core import workspace as names
from ..core.crs import LocalFrame
from ..core.errors import InputError
from ..core.workspace import Workspace, read_record

if TYPE_CHECKING:
    import geopandas as gpd
    import pandas as pd

    from ..reconstruction.cameras import View
    from ..terrain.dtm import Dtm


class FinishedRun:
    """A workspace, open for reading: every part is read when it is first used. Nothing is written.

    Raises (each part):
        InputError: the run did not come so far, or the file is damaged: one sentence that says what to do.

    Examples:
        >>> import treedgs_geo as tg
        >>> run = tg.open(work)
        >>> len(run.trees) == len(run.evidence), len(run.stations) >= len(run.cameras)
        (True, True)
        >>> float(run.ground.height(run.trees["x"], run.trees["y"]).std()) < 2
        True
    """

    def __init__(self, folder: Path, photos: Path | None = None) -> None:
        self.folder = folder
        self._photos, self._space = photos, Workspace(folder)

    def __repr__(self) -> str:
        done = [name for name, entry in self._space.record["stages"].items() if entry.get("status") == "done"]
        return f"<run in {self.folder}: {', '.join(done) or 'no stage'} done>"

    def _repr_html_(self) -> str:
        from ..inventory.charts import trees_html

        return trees_html(str(self.folder), self.trees, self.searched) if self._space.path(names.TREES).exists() else ""

    @cached_property
    def stages(self) -> pd.DataFrame:
        """What each stage took: ``status``, ``seconds``, ``peak_memory_mb``, by name."""
        import pandas as pd

        return pd.DataFrame.from_dict(self._space.record["stages"], "index")[["status", "seconds", "peak_memory_mb"]]

    @cached_property
    def stations(self) -> gpd.GeoDataFrame:
        """Where each photo was taken, its quality and angles: one row a photo, in the project CRS."""
        from ..geotags.stations import read_stations_table

        return read_stations_table(self._there(names.GEOTAGS))

    @cached_property
    def frame(self) -> LocalFrame:
        """The frame of the cameras: ``to_local`` and ``to_project`` change coordinates."""
        return self._views[0]

    @cached_property
    def cameras(self) -> dict[str, View]:
        """Photo -> where and how it was taken, in :attr:`frame`: ``centre``, ``project`` (points to pixels), ``path``.

        Photos that were moved since: give their folder to ``tg.open``.
        """
        return {view.name: view for view in self._views[1]}

    @cached_property
    def ground(self) -> Dtm:
        """The terrain model: ``heights`` (m) with their ``transform``, and ``height(x, y)``."""
        from ..terrain.dtm import read_dtm

        return read_dtm(self._there(names.DTM))

    @cached_property
    def trees(self) -> gpd.GeoDataFrame:
        """The tree layer as the run wrote it; what a person changed is in the layer that was edited."""
        from ..inventory.tree_reading import read_trees

        return read_trees(self._there(names.TREES))

    @cached_property
    def searched(self) -> gpd.GeoDataFrame | None:
        """Where stems were looked for, one polygon a plot; ``None`` where the run does not say."""
        from ..inventory.searched import read_searched

        return read_searched(self._there(names.TREES))

    @cached_property
    def evidence(self) -> pd.DataFrame:
        """What was found out about each stem, by ``tree_id``: the fields of
        :class:`~treedgs_geo.stems.photos.quality_control.Evidence`, and its ``se_cm``."""
        import pandas as pd

        from .given_store import fits_by_id

        self._there(names.FITS)
        fits = fits_by_id(self._space).fits
        rows = {k: vars(fit.evidence) | {"se_cm": fit.evidence.se_cm} for k, fit in fits.items()}
        return pd.DataFrame.from_dict(rows, "index").rename_axis("tree_id")

    @cached_property
    def sheets(self) -> dict[int, Path]:
        """``tree_id`` -> its evidence sheet (JPEG), of those that were written."""
        from ..inventory.evidence.files import written_sheets

        runs = self.trees["run_id"].dropna()
        return dict(sorted(written_sheets(self._space.path(names.SHEETS), runs.iloc[0] if len(runs) else "").items()))

    @cached_property
    def _views(self) -> tuple[LocalFrame, list[View]]:
        from ..reconstruction.model import load_views

        self._there(f"{names.SFM}/frame.json")
        paths = {} if self._photos else dict(zip(self.stations["name"], map(Path, self.stations["path"]), strict=True))
        return load_views(self._space.path(names.SFM), self._photos or self.folder, paths)

    def _there(self, name: str) -> Path:
        path = self._space.path(name)
        if not path.exists():
            raise InputError(f"{path}: is not there, the run did not come so far; start photos-to-dbh again to go on.")
        return path


def open(workspace: str | Path, photos: str | Path | None = None) -> FinishedRun:
    """Open the workspace of a run for reading: its stations, cameras, ground, trees, evidence and sheets.

    Args:
        workspace: the folder that was given to ``photos-to-dbh`` (or lies beside the photos, ``NAME_treedgs``).
        photos: where the photos are now, if they were moved.

    Raises:
        InputError: the folder is none, may not be read, or holds no run.

    Examples:
        >>> import treedgs_geo as tg
        >>> bool(tg.open(work).trees["dbh_cm"].notna().any())
        True
    """
    folder = Path(workspace)
    if not folder.exists():
        raise InputError(f"{folder}: not found; give the workspace of photos-to-dbh.")
    if folder.is_dir() and not os.access(folder, os.R_OK | os.X_OK):
        raise InputError(f"{folder}: may not be read; ask its owner for the right to, or copy the whole folder.")
    if read_record(folder) is None:
        raise InputError(f"{folder}: holds no run (no run.json); give the workspace of photos-to-dbh.")
    return FinishedRun(folder, None if photos is None else Path(photos))
