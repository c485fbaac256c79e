"""The manifest: one row a plot, every row checked before anything starts."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import field as item
from pathlib import Path
from typing import Any

from ..core.columns import columns
from ..core.errors import InputError, TreeDGSError
from ..core.settings import Param, build, nearest, params_of
from ..core.tables import read_rows
from .inputs import PlotInputs, look_at

#: Column of the input -> verb that a row with it runs.
ROUTES = {"photos": "photos-to-dbh", "cloud": "pointcloud-to-dbh"}
#: Settings that the campaign gives itself.
_OWN = {"workspace", "output", "input", "trees", "dry_run"}
_PATHS = ("file", "folder", "files")
#: How many rows are explained in one error.
_MAX_REPORTED = 8


@dataclass(frozen=True)
class PlotRow:
    """One plot. line: in the manifest. route: ``photos`` or ``cloud``. values: the verb's settings by name, paths
    absolute. plots, field: tables of centres and field trees, or "". pairing: settings of ``match-plots``."""

    line: int
    plot_id: str
    route: str
    values: dict[str, Any]
    plots: str = ""
    field: str = ""
    pairing: dict[str, Any] = item(default_factory=dict)


def table_rows(path: Path) -> Iterator[tuple[int, dict[str, str]]]:
    """``(line, cells by column name)`` of a table (:func:`~treedgs_geo.core.tables.read_rows`) without empty cells."""
    heads, rows = read_rows(Path(path))
    for line, cells in rows:
        yield line, {head: cell for head, cell in zip(heads, cells, strict=True) if head and cell}


class Checker:
    """Checks rows one after the other; keeps ids and marks only, so that memory stays small."""

    def __init__(self, manifest: Path, crs: str | None) -> None:
        from ..verbs import get_command

        self.manifest, self.crs = Path(manifest), crs
        self.base = self.manifest.resolve().parent
        self.commands = {route: get_command(verb) for route, verb in ROUTES.items()}
        self.verbs = {route: _specs(command.settings) for route, command in self.commands.items()}
        self.match = get_command("match-plots").settings
        self.pairing = {k: v for k, v in _specs(self.match).items() if k not in ("field", "plots", "crs")}
        self.problems: list[str] = []
        self.n_bad = 0
        self._ids: dict[str, int] = {}
        self._marks: dict[int, int] = {}
        self._inner: dict[str, int] = {}
        self._table: tuple[str, set[str], str] = ("", set(), "")

    def rows(self) -> Iterator[tuple[PlotRow, PlotInputs]]:
        """Rows that can be run, with what is known of their inputs; the others are sentences (:meth:`conclude`)."""
        for line, cells in table_rows(self.manifest):
            name = cells.get("plot_id")
            try:
                yield self._check(line, cells)
            except TreeDGSError as problem:
                self.n_bad += 1
                if len(self.problems) < _MAX_REPORTED:
                    self.problems.append(f"line {line}{f' ({name})' if name else ''}: {problem}")

    def conclude(self) -> None:
        """Refuse the manifest when any row cannot be run.

        Raises:
            InputError: every problem (the first ``_MAX_REPORTED`` in full), or no plot at all.
        """
        if self.problems:
            more = f"; and {self.n_bad - _MAX_REPORTED} more" if self.n_bad > _MAX_REPORTED else ""
            listed = "; ".join(problem.rstrip(".;") for problem in self.problems)
            rows = "1 row" if self.n_bad == 1 else f"{self.n_bad} rows"
            raise InputError(f"{self.manifest}: {rows} cannot be used, nothing was started: {listed}{more}.")
        if not self._ids:
            raise InputError(f"{self.manifest}: holds no plot, expected one row a plot below the heading.")

    def _check(self, line: int, cells: dict[str, str]) -> tuple[PlotRow, PlotInputs]:
        plot_id = cells.pop("plot_id", "")
        if not plot_id:
            raise InputError("has no plot_id; give every plot its own id in a column plot_id.")
        if any(unicodedata.category(letter) == "Cc" for letter in plot_id) or len(plot_id) > 80:
            raise InputError(f"plot_id {plot_id[:40]!r} is no short line of text; give a shorter id.")
        before = self._ids.setdefault(plot_id.casefold(), line)
        if before != line:
            raise InputError(f"plot_id {plot_id!r} appears twice (also in line {before}); give every plot its own id.")
        named = [column for column in ROUTES if column in cells]
        if len(named) != 1:
            found = "both photos and cloud" if named else "neither photos nor cloud"
            raise InputError(f"names {found}; give a folder of photos or one point cloud.")
        row = self._row(line, plot_id, named[0], cells)
        inputs = look_at(row.route, row.values, row.plots, row.field, self.crs)
        if row.route == "cloud" and inputs.use_crs:
            row.values["crs"] = inputs.use_crs
        self._twice(row)
        return row, inputs

    def _row(self, line: int, plot_id: str, route: str, cells: dict[str, str]) -> PlotRow:
        specs = self.verbs[route]
        values: dict[str, Any] = {}
        pairing: dict[str, Any] = {}
        plots, tally = self._path("plots", cells.pop("plots", "")), self._path("field", cells.pop("field", ""))
        if tally and not plots:
            raise InputError("has a field table but no plots table; give the plot's centre in a column plots.")
        for name, text in cells.items():
            if name in ROUTES:
                values["photos" if name == "photos" else "input"] = self._path(name, text)
            elif name in specs:
                values[name] = self._value(name, specs[name], text)
            elif name in self.pairing:
                if tally:
                    pairing[name] = self._value(name, self.pairing[name], text)
            elif not any(name in known for known in self.verbs.values()):
                raise InputError(self._unknown(name))
            elif name != "geotags":
                raise InputError(f"{name} is not a setting of {ROUTES[route]}; empty that cell.")
        if route == "photos" and "crs" not in values:
            if self.crs is None:
                raise InputError("has no crs; give it in a column crs, or one for all rows with --crs.")
            values["crs"] = self.crs
        if route == "photos" and plots:
            values["plots"] = plots
        self._table_of(plots, plot_id, line)
        places = {"output": "t.gpkg", "workspace": "w"} if route == "photos" else {"output": "t.gpkg"}
        build(self.commands[route].settings, {**values, **places})
        if tally:
            build(self.match, {**pairing, "trees": "t.gpkg", "field": tally, "plots": plots, "output": "p.gpkg"})
        return PlotRow(line, plot_id, route, values, plots, tally, pairing)

    def _value(self, name: str, spec: Param, text: str) -> Any:
        return self._path(name, text) if spec.kind in _PATHS else text

    def _path(self, name: str, text: str) -> str:
        """Absolute path; what is relative counts from the manifest's folder."""
        if not text:
            return ""
        path = Path(text.replace("\\", "/") if not Path(text).exists() else text).expanduser()
        path = path if path.is_absolute() else self.base / path
        if not path.exists():
            raise InputError(f"{name} {path} does not exist; correct the path (it counts from the manifest's folder).")
        return str(path)

    def _unknown(self, name: str) -> str:
        settings = (name for specs in self.verbs.values() for name in specs)
        known = sorted({"plot_id", "field", "plots", *ROUTES, *self.pairing, *settings})
        return f"column {name!r} is unknown; {nearest(name, known)}"

    def _table_of(self, plots: str, plot_id: str, line: int) -> None:
        """A plots table with the row's id gives that circle; any other gives all its plots, whose ids must be new."""
        if not plots:
            return
        if self._table[0] != plots:
            self._table = (plots, {_plot_of(cells) for _, cells in table_rows(Path(plots))}, "")
        ids = self._table[1]
        if plot_id in ids:
            return
        for name in ids:
            before = self._inner.setdefault(name, line)
            if before != line or name.casefold() in self._ids:
                raise InputError(
                    f"plot {name!r} of {Path(plots).name} is also a plot of line "
                    f"{before if before != line else self._ids[name.casefold()]}: its trees would be counted twice; "
                    "name the row's plot_id in its plots table, or give each row its own table."
                )

    def _twice(self, row: PlotRow) -> None:
        """The same data under two ids would count its trees twice."""
        own = row.plot_id if row.plots and row.plot_id in self._table[1] else row.plots
        same = hash((row.route, row.values.get("photos") or row.values.get("input"), own))
        before = self._marks.setdefault(same, row.line)
        if before != row.line:
            raise InputError(
                f"names the same {row.route} as line {before}: its trees would be counted twice; remove one row (one "
                "row measures all circles of its plots table, from one reconstruction), or name each row's plot_id in "
                "a plots table."
            )


def _plot_of(cells: dict[str, str]) -> str:
    """The plot that a row of a table of plots or trees names."""
    column = columns(cells, "plot_id").get("plot_id")
    return cells[column.name] if column is not None else ""


def own_plots(row: dict[str, Any]) -> list[dict[str, str]]:
    """The row's circle out of its plots table; every row of it when the row's id is not there."""
    if not row["plots"]:
        return []
    cells = [found for _, found in table_rows(Path(row["plots"]))]
    return [found for found in cells if _plot_of(found) == row["plot_id"]] or cells


def own_field(row: dict[str, Any]) -> list[dict[str, str]]:
    """The field trees of the row's plots, out of a table that may hold every plot's."""
    if not row["field"]:
        return []
    cells = [found for _, found in table_rows(Path(row["field"]))]
    wanted = {_plot_of(found) for found in own_plots(row)}
    named = any(_plot_of(found) for found in cells)
    return [found for found in cells if not named or _plot_of(found) in wanted]


def _specs(settings: type) -> dict[str, Param]:
    return {name: spec for name, spec, _ in params_of(settings) if name not in _OWN}
