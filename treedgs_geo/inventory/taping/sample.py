"""From the settings of ``tape-sample`` to its files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...core.crs import project_crs
from ...core.errors import InputError
from ...core.files import ensure_writable
from ...core.geopackage import ensure_unlocked
from ...core.progress import Reporter
from ...core.shown import count_of
from ...core.tables import write_csv
from ...report.html import write_html
from ...report.pdf import load_fonts, write_pdf
from ...stems.quality.priors import BREAST_HEIGHT_M
from ..declination import parse_date
from ..double_sampling.designs import draw_trees
from ..double_sampling.tapes import read_cells
from ..field_trees import FieldProtocol
from .form import make_form
from .frame import Frame, read_frame
from .outputs import COLUMNS, CREW, OWN_LAYERS, tape_table, write_gpx, write_layer
from .sheets import sheets, walk


def sample_tapes(settings: Any, reporter: Reporter) -> dict[str, Any]:
    """settings: ``TapeSampleSettings``. Draw, and write everything for the field.

    Raises:
        InputError: inputs that do not fit, or a folder whose tape table is filled in already.
    """
    folder = Path(settings.output)
    ensure_writable(folder / "tapes.csv")
    load_fonts()  # says that the extra "reports" is missing before anything is written
    ensure_unlocked(folder / "tapes.gpkg", OWN_LAYERS)
    _keep_tapes(folder)
    with reporter.stage("read", 0.0, 0.3):
        frame = read_frame(settings.trees, project_crs(settings.crs) if settings.crs else None, settings.plots)
    reporter.tell(frame.warnings, frame.notes)
    with reporter.stage("draw", 0.3, 0.4):
        draw = draw_trees(
            settings.design,
            frame.trees["size"].to_numpy(float),
            frame.trees["qc_flag"].to_numpy(object),
            settings.n,
            settings.seed,
        )
    if settings.n > len(frame.trees):
        reporter.warn(f"--n: {settings.n} tapes asked for, {len(frame.trees)} trees are there: all of them are drawn.")
    protocol = FieldProtocol(north=settings.north, declination_deg=settings.declination_deg)
    day = parse_date(settings.field_date, "--field-date").isoformat() if settings.field_date else ""
    trees = walk(frame, draw, protocol, day, settings.trees)
    with reporter.stage("write", 0.4, 1.0):
        table = tape_table(trees, len(frame.trees), draw.design, frame.mark)
        _write(folder, frame, trees, table, settings)
    counts = {str(name): int((draw.stratum == name).sum()) for name in sorted(set(draw.stratum))}
    n_plots = trees["plot_id"].nunique()
    reporter.info(
        f"{count_of(len(trees), 'tree')} of {len(frame.trees)} to tape"
        + (f", in {count_of(n_plots, 'plot')}" if n_plots else "")
        + f" ({', '.join(f'{name}: {count}' for name, count in counts.items())})."
    )
    return {
        "output": str(folder),
        "layer": str(folder / "tapes.gpkg"),
        "table": str(folder / "tapes.csv"),
        "form": str(folder / "tape_form.pdf"),
        "page": str(folder / "tape_form.html"),
        "gpx": str(folder / "tapes.gpx") if (folder / "tapes.gpx").exists() else None,
        "n": len(trees),
        "n_frame": len(frame.trees),
    }


def _keep_tapes(folder: Path) -> None:
    """Refuse to write over anything that somebody typed in: a tape, a state, a note, a column or row of his own."""
    for name in ("tapes.gpkg", "tapes.csv"):
        path = folder / name
        if not path.exists() or not path.stat().st_size:
            continue
        table = read_cells(path)
        typed = table[[column for column in table if column not in COLUMNS or column in CREW]].notna().any(axis=1)
        n = int((typed | table["tree_id"].isna() if "tree_id" in table else typed).sum())
        if n:
            raise InputError(
                f"{path}: {count_of(n, 'tree')} of it {'is' if n == 1 else 'are'} filled in; give another folder."
            )


def _write(folder: Path, frame: Frame, trees: Any, table: Any, settings: Any) -> None:
    (folder / "tapes.gpx").unlink(missing_ok=True)
    write_csv(folder / "tapes.csv", table)
    write_layer(folder / "tapes.gpkg", table, frame.crs)
    title = f"Trees to tape: {settings.trees.stem}"
    write_gpx(folder / "tapes.gpx", table, title)
    heights = frame.trees["bh_m"].dropna()
    breast = float(heights.median()) if len(heights) else BREAST_HEIGHT_M
    how = {"stratified": "stratified by flag and DBH", "pps": "probability proportional to basal area"}[settings.design]
    subtitle = (
        f"{len(trees)} of {len(frame.trees)} trees, {how}, seed {settings.seed}; {frame.crs.name}. "
        "Write what you read into tapes.csv or tapes.gpkg, then run tape-check."
    )
    form = make_form(title, subtitle, frame, sheets(frame, trees), breast, settings.north)
    write_html(folder / "tape_form.html", form)
    write_pdf(folder / "tape_form.pdf", form)
    assert np.isfinite(table["prob"]).all()
