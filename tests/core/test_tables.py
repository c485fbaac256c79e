"""CSV files that spreadsheets can open safely, read back as they were; files that are no CSV are named."""

from __future__ import annotations

import ast
import csv
import io
from pathlib import Path

import pandas as pd
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st

import treedgs_geo
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.plots import read_plots
from treedgs_geo.core.tables import SafeWriter, csv_text, plain_cell, refuse_other_formats, safe_cell, safe_frame
from treedgs_geo.inventory.accuracy.sections import write_table
from treedgs_geo.inventory.field_trees import read_table
from treedgs_geo.inventory.match import read_measured
from treedgs_geo.inventory.stand.sample import read_sample
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_lab.simulate.files import write_csv

UTM = pyproj.CRS.from_epsg(6344)
ATTACK = "=cmd|' /C calc'!A0"
#: What spreadsheet programs run: a cell that starts like this and is no number.
RUN = ("=", "+", "-", "@", "\t", "\r", "\n")


@pytest.mark.parametrize("text", [ATTACK, "+1+1", "-A3", "@SUM(A1)", "\t=1", "\r=1", "--1", "-inf"])
def test_what_would_run_is_text(text):
    assert safe_cell(text) == "'" + text and plain_cell(safe_cell(text)) == text


@pytest.mark.parametrize("value", ["-3", "+5", "-1.5e-3", -3.2, 7, None, "", "T001", "a=b", "Pinus taeda", True])
def test_numbers_and_plain_text_stay(value):
    assert safe_cell(value) is value


@given(st.text(max_size=30))
def test_every_text_comes_back(text):
    safe = safe_cell(text)
    assert plain_cell(safe) == text
    assert not safe.startswith(RUN) or pd.notna(pd.to_numeric(safe, errors="coerce"))


def test_writer_and_frame_agree():
    columns, values = ["plot_id", "@name", "n"], {"plot_id": ATTACK, "@name": "-x", "n": -2.5}
    stream = io.StringIO()
    writer = SafeWriter(stream, columns)
    writer.header()
    writer.record({**values, "other": "=left out"})
    assert stream.getvalue() == safe_frame(pd.DataFrame([values])).to_csv(index=False, lineterminator="\n")
    assert list(csv.reader(io.StringIO(stream.getvalue()))) == [
        ["plot_id", "'@name", "n"],
        ["'" + ATTACK, "'-x", "-2.5"],
    ]


def test_files_hold_no_formula_and_are_read_back(tmp_path):
    trees = [Tree(1, 611300.0, 3718400.0, plot_id=ATTACK, dbh_cm=20.0, species="@x", note="-no", taper_cm_m=-0.8)]
    path = write_trees(tmp_path / "trees.csv", trees, UTM)
    write_csv(tmp_path / "truth.csv", ["plot_id", "lean"], [[ATTACK, -1.5], ["b", None]])
    write_table(tmp_path / "methods.csv", [{"method": ATTACK, "me_cm": -0.25}])
    for name in ("trees.csv", "truth.csv", "methods.csv"):
        with open(tmp_path / name, newline="", encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        for cell in sum(rows, []):
            assert not cell.startswith(RUN) or float(cell) < 0, (name, cell)
    back = read_table(path).iloc[0]
    assert (back.plot_id, back.species, back.note, float(back.taper_cm_m)) == (ATTACK, "@x", "-no", -0.8)
    assert read_measured(path, UTM).dbh_cm.tolist() == [20.0]
    plots = tmp_path / "plots.csv"
    with open(plots, "w", newline="") as stream:
        writer = SafeWriter(stream, ["plot_id", "easting", "northing", "radius_m"])
        writer.header()
        writer.row([ATTACK, 611300, 3718400, 10])
    assert read_plots(plots, UTM)[0].plot_id == ATTACK


def test_no_module_writes_a_csv_on_its_own():
    """``safe_frame(…).to_csv`` and ``SafeWriter`` are the only ways."""
    root = Path(treedgs_geo.__file__).parent
    for path in root.rglob("*.py"):
        if path.name == "tables.py" and path.parent.name == "core":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
                continue
            called = node.func
            if called.attr == "to_csv":
                made = called.value
                assert isinstance(made, ast.Call) and getattr(made.func, "id", "") == "safe_frame", path
            if called.attr in ("writer", "DictWriter"):
                assert getattr(called.value, "id", "") != "csv", path


@pytest.mark.parametrize(
    ("name", "head", "says"),
    [
        ("field.accdb", b"\x00\x01\x00\x00Standard ACE DB\x00", "an Access database"),
        ("field.mdb", b"\x00\x01\x00\x00Standard Jet DB\x00", "an Access database"),
        ("renamed.csv", b"\x00\x01\x00\x00Standard ACE DB\x00", "an Access database"),
        ("field.xlsx", b"PK\x03\x04rest", "an Excel workbook"),
        ("renamed.csv", b"PK\x03\x04rest", "a spreadsheet or an archive"),
        ("field.gpkg", b"SQLite format 3\x00", "a GeoPackage"),
    ],
)
def test_other_formats_are_named(tmp_path, name, head, says):
    path = tmp_path / name
    path.write_bytes(head + bytes(range(256)))
    for read in (refuse_other_formats, read_table, lambda p: read_plots(p, UTM)):
        with pytest.raises(InputError, match=f"{says}.*export its table") as reported:
            read(path)
        assert str(path) in str(reported.value)
    if "Access" in says:
        with pytest.raises(InputError, match="or a map layer; export its table"):
            read_trees(path)
        with pytest.raises(InputError, match="an Access database.*export its table"):
            read_sample(path, UTM)


PLOTS = "plot_id,easting,northing,radius_m,note\nA,611337.5,3718452.25,12.5,Höhe\nB,611400,3718500,10,\n"


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
@pytest.mark.parametrize("country", ["us", "de", "tabs", "sep"])
def test_a_table_of_any_country_and_system_reads_the_same(tmp_path, ends, encoding, country):
    """As Excel writes it in the United States, in Germany, as text with tabs, and with its own first line."""
    text = {"us": PLOTS, "tabs": PLOTS.replace(",", "\t")}.get(country, PLOTS.replace(",", ";").replace(".", ","))
    text = ("sep=;\n" if country == "sep" else "") + text
    path = tmp_path / "plots.csv"
    path.write_bytes(text.replace("\n", ends).encode(encoding))
    assert csv_text(path) == PLOTS
    plots = read_plots(path, UTM)
    assert [(p.plot_id, p.x, p.y, p.radius_m) for p in plots] == [
        ("A", 611337.5, 3718452.25, 12.5),
        ("B", 611400.0, 3718500.0, 10.0),
    ]
    table = read_table(path)
    assert list(table["note"])[0] == "Höhe" and list(table["easting"]) == ["611337.5", "611400"]


def test_two_kinds_of_numbers_in_one_table_are_refused(tmp_path):
    """12,5 may be twelve and a half or, beside 611337.5, two columns; nothing is guessed."""
    path = tmp_path / "trees.csv"
    path.write_text("plot_id;tree_id;azimuth;distance_m\nA;1;12,5;8.25\n")
    with pytest.raises(InputError, match="found 12,5 and 8.25.*the same way"):
        read_table(path)


def test_text_with_separators_inside_stays(tmp_path):
    path = tmp_path / "trees.csv"
    path.write_text('plot_id,"note; with; semicolons",dbh_cm\nA,"1,5; ""x""",12.5\n')
    assert csv_text(path) == path.read_text()
    path.write_text('plot_id;note;dbh_cm\nA;"fork, leaning";12,5\n')
    assert csv_text(path) == 'plot_id,note,dbh_cm\nA,"fork, leaning",12.5\n'
    path.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="cannot be read as a CSV"):
        read_table(path)
