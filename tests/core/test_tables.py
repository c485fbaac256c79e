"""CSV files that spreadsheets can open safely, read back as they were; files that are no CSV are named."""

from __future__ import annotations

import ast
import csv
import io
from pathlib import Path

import geopandas as gpd
import pandas as pd
import pyogrio
import pyproj
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

import treedgs_geo
from treedgs_geo.core.column_names import QUANTITIES
from treedgs_geo.core.columns import columns
from treedgs_geo.core.errors import InputError
from treedgs_geo.core.plots import as_in_plots, read_plots
from treedgs_geo.core.tables import (
    column_name,
    plain_cell,
    read_table,
    refuse_other_formats,
    safe_cell,
    safe_frame,
)
from treedgs_geo.inventory.measured import read_measured
from treedgs_geo.inventory.stand.sample import read_sample
from treedgs_geo.inventory.tree_layer import write_trees
from treedgs_geo.inventory.tree_reading import read_trees
from treedgs_geo.stems.quality.tree import Tree
from treedgs_lab.published.sections import write_table
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


def test_names_of_columns_and_cells_are_safe():
    values = {"plot_id": ATTACK, "@name": "-x", "n": -2.5}
    assert list(csv.reader(io.StringIO(safe_frame(pd.DataFrame([values])).to_csv(index=False)))) == [
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
    write_csv(plots, ["plot_id", "easting", "northing", "radius_m"], [[ATTACK, 611300, 3718400, 10]])
    assert read_plots(plots, UTM)[0].plot_id == ATTACK


def test_no_module_writes_a_csv_on_its_own():
    """``write_csv`` and ``safe_frame(…).to_csv`` are the only ways."""
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
        ("field.xls", b"\xd0\xcf\x11\xe0rest", "an old Excel workbook"),
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
    plots = read_plots(path, UTM)
    assert [(p.plot_id, p.x, p.y, p.radius_m) for p in plots] == [
        ("A", 611337.5, 3718452.25, 12.5),
        ("B", 611400.0, 3718500.0, 10.0),
    ]
    table = read_table(path)
    assert list(table["note"])[0] == "Höhe" and list(table["easting"]) == ["611337.5", "611400"]


def _cells(path, text, name):
    path.write_text(text, encoding="utf-8")
    return read_table(path)[name].tolist()


def test_decimal_commas_are_read_where_they_can_be_nothing_else(tmp_path):
    """Column by column: the tool's own points beside typed commas; thousands are no decimals."""
    path = tmp_path / "t.csv"
    both = "tree_id;about_cm;taped_cm\n1;24.25;24,1\n2;31.5;30,8\n"
    assert _cells(path, both, "taped_cm") == ["24.1", "30.8"] and _cells(path, both, "about_cm") == ["24.25", "31.5"]
    assert _cells(path, "a;b\n1;24,1\n2;23.8\n", "b") == ["24.1", "23.8"]
    assert _cells(path, 'a,b\n1,"24,1"\n2,"1,250"\n', "b") == ["24.1", "1.250"]
    assert _cells(path, 'a,b\n1,"500,000"\n2,"511,337"\n', "b") == ["500,000", "511,337"]
    assert _cells(path, "a;b\n1;8.250\n2;23,8\n", "b") == ["8.250", "23,8"]
    assert _cells(path, "a;b\n1;8,250\n", "b") == ["8.250"]


def test_text_with_separators_inside_stays(tmp_path):
    path = tmp_path / "trees.csv"
    assert _cells(path, 'plot_id,"note; with; semicolons",dbh_cm\nA,"1,5; ""x""",12.5\n', "note_with_semicolons") == [
        '1,5; "x"'
    ]
    assert _cells(path, 'plot_id;note;dbh_cm\nA;"fork, leaning";12,5\n', "note") == ["fork, leaning"]
    path.write_bytes(bytes(range(256)))
    with pytest.raises(InputError, match="cannot be read as a CSV"):
        read_table(path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a,b\n1,2\n3,4,\n", "line 3: has more cells .3. than the heading has columns .2.*delete the comma"),
        ("a,b\n1,11,3\n", "line 2: has more cells.*in quotes"),
        ("a;b\n1;2;\n", "line 2: has more cells.*delete the semicolon"),
        ("tree_id,dbh_cm,height_m\n1,17.2\n", "line 2: has fewer cells .2.*comma for each empty cell too .height_m"),
        ("tree_id,dbh_cm,height_m,note\n1,17.2\n", "line 2: has fewer cells"),
        ("a,,b\n1,7,2\n", "line 2: holds '7' in column 2, which has no name"),
        ("a,b,A\n1,2,3\n", "a column appears twice .a"),
        ("", "is empty"),
        ("a,b\n", "holds no row"),
    ],
)
def test_a_cell_too_many_or_too_few_is_a_sentence(tmp_path, text, says):
    """Else values stand in the columns beside theirs: heights are read as diameters."""
    path = tmp_path / "t.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=says):
        read_table(path)


def test_what_stands_for_nothing_is_nothing(tmp_path):
    path = tmp_path / "t.csv"
    text = ",tree_id,dbh_cm,note,\n\n1,7,NA,,\n2,8,-,ok,\n,,,,\n3,9,24.1\n"
    assert _cells(path, text, "dbh_cm") == [None, None, "24.1"]
    table = read_table(path)
    assert table.index.tolist() == [3, 4, 6] and table["note"].tolist() == [None, "ok", None]


@pytest.mark.parametrize(
    ("heads", "keys"),
    [
        ("plot, x, y, radius_ft", {"plot_id": "", "easting": "", "northing": "", "radius": "ft"}),
        ("Plot No;Azimut [gon];Entfernung (m);BHD cm", {"plot_id": "", "azimuth": "gon", "distance": "m", "dbh": "cm"}),
        ("Baum-Nr;Höhe_m;Baumart;Bemerkung", {"field_id": "", "height": "m", "species": ""}),
        ("Parcela;Árbol;Rumbo;Distancia_m;DAP_cm;Altura_m;Especie", {"field_id": "", "dbh": "cm", "height": "m"}),
        ("e,n,dbh", {"easting": "", "northing": "", "dbh": ""}),
        ("Tag,DBHcm,Slope %", {"field_id": "", "dbh": "cm", "slope": "pct"}),
        ("Circumference (inches)", {"girth": "in"}),
        ("dbh1_cm,dbh2_cm", {"dbh1": "cm", "dbh2": "cm"}),
        (
            "Placette;N° arbre;Azimut (gr);Diamètre (cm);Hauteur (m);État",
            {"field_id": "", "azimuth": "gon", "dbh": "cm"},
        ),
        ("Nr drzewa;Odległość [m];Pierśnica [cm];Wysokość m", {"field_id": "", "distance": "m", "dbh": "cm"}),
        ("Koeala;Puu;Etäisyys m;Läpimitta cm;Ympärysmitta cm", {"plot_id": "", "distance": "m", "girth": "cm"}),
        ("PLT_CN,SUBP,TREE,AZIMUTH,DIST,DIA,HT,SPCD", {"plot_id": "", "distance": "ft", "dbh": "in", "height": "ft"}),
    ],
)
def test_columns_are_known_in_their_languages_with_their_units(heads, keys):
    names = [column_name(head) for head in heads.replace(";", ",").split(",")]
    found = columns(names, *QUANTITIES)
    assert {key: found[key].unit for key in keys} == keys
    assert len({column.name for column in found.values()}) == len(found)


def test_all_that_a_table_lacks_is_named_at_once(tmp_path):
    path = tmp_path / "plots.csv"
    path.write_text("plot,lon,radius,colour\nA,9.1,10,red\n")
    with pytest.raises(InputError, match=r"not known here: colour.*lacks the northing.*'radius' does not say its unit"):
        read_plots(path, UTM)


def test_plots_by_other_names_and_units(tmp_path):
    path = tmp_path / "plots.csv"
    path.write_text("Probekreis;x;y;Halbmesser ft\nA;611337,5;3718452,25;24,0\n")
    plots = read_plots(path, UTM)
    assert [(p.plot_id, p.x, p.y) for p in plots] == [("A", 611337.5, 3718452.25)]
    assert plots[0].radius_m == pytest.approx(7.3152)
    assert read_sample(path, UTM)[0].radius_m == pytest.approx(7.3152)


def test_one_plot_under_two_ids_is_refused(tmp_path):
    path = tmp_path / "plots.csv"
    path.write_text(
        "plot_id,easting,northing,radius_m\nA,611337,3718452,10\nB,611500,3718452,10\nC,611337.04,3718452,10\n"
    )
    for read in (read_plots, read_sample):
        with pytest.raises(InputError, match="plots A and C are one circle"):
            read(path, UTM)
    path.write_text("plot_id,easting,northing,radius_m\nA,611337,3718452,10\nB,611337,3718452,4\nC,611352,3718452,10\n")
    for read in (read_plots, read_sample):
        assert len(read(path, UTM)) == 3


AS_PEOPLE_SAVE_THEM = {
    "title.csv": "Inventur Mai 2025;;;\nplot;x;y;radius_m\nA;611300;3718400;10\nB;611400;3718400;10\n",
    "title_alone.csv": "Inventur Mai 2025\n\nplot,x,y,radius_m\nA,611300,3718400,10\nB,611400,3718400,10\n",
    "units_below.csv": "plot,x,y,radius\n,m,m,[m]\nA,611300,3718400,10\nB,611400,3718400,10\n",
    "units_behind.csv": "plot,x,y,radius\nA,611300,3718400,10 m\nB,611400,3718400,10 m\n",
    "unit_behind_one.csv": "plot,x,y,radius_m\nA,611300,3718400,10 m\nB,611400,3718400,10\n",
    "german.csv": "plot;x;y;radius_m\nA;611.300;3.718.400;10,0\nB;611.400,00;3.718.400,00;10\n",
    "swiss.csv": "plot;x;y;radius_m\nA;611'300;3’718’400.0;10\nB;611'400;3'718'400;10\n",
    "french.csv": "plot;x;y;radius_m\nA;611\u00a0300;3\u202f718\u202f400,0;10\nB;611\u00a0400;3\u00a0718\u00a0400;10\n",
    "american.csv": 'plot,x,y,radius_m\nA,"611,300.00","3,718,400",10.0\nB,"611,400","3,718,400",10\n',
    "bars.txt": "plot|x|y|radius_m\nA|611300|3718400|10\nB|611400|3718400|10\n",
    "tabs.txt": "plot\tx\ty\tradius_m\nA\t611300\t3718400\t10\nB\t611400\t3718400\t10\n",
    "tabs.tsv": "plot\tx\ty\tradius_m\nA\t611300\t3718400\t10\nB\t611400\t3718400\t10\n",
}


@pytest.mark.parametrize("name", AS_PEOPLE_SAVE_THEM)
def test_tables_as_people_save_them(tmp_path, name):
    path = tmp_path / name
    path.write_text(AS_PEOPLE_SAVE_THEM[name], encoding="utf-8")
    assert [(p.plot_id, p.x, p.y, p.radius_m) for p in read_sample(path, UTM)] == [
        ("A", 611300, 3718400, 10),
        ("B", 611400, 3718400, 10),
    ]


@pytest.mark.parametrize("ending", [".xlsx", ".ods"])
def test_a_workbook_s_one_sheet_is_a_table(tmp_path, ending):
    table = pd.DataFrame(
        {"Probekreis": ["01", "B"], "x": [611300.5, 611400], "y": [3718400, 3718400], "Radius [m]": 10}
    )
    path = tmp_path / f"plots{ending}"
    pyogrio.write_dataframe(table, path, layer="Tabelle1")
    assert [(p.plot_id, p.x, p.radius_m) for p in read_plots(path, UTM)] == [("01", 611300.5, 10), ("B", 611400, 10)]
    pyogrio.write_dataframe(table, path, layer="Tabelle2", append=True)
    with pytest.raises(InputError, match=r"2 sheets \(Tabelle1, Tabelle2\), expected one"):
        read_plots(path, UTM)


@pytest.mark.parametrize("before", [[], [["Aufnahme 2026"], ["Kode", "Art"], ["10", "Fichte"]]])
def test_lists_beside_the_table_and_empty_sheets_are_passed_over(tmp_path, before):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    after = book.create_sheet("Tabelle2")
    for sheet, rows in ((book.active, before), (after, [["Plot", "x", "y", "radius_m"], ["A", 611300, 3718400, 10]])):
        for row in rows:
            sheet.append(row)
    book.save(tmp_path / "plots.xlsx")
    assert [(p.plot_id, p.x, p.radius_m) for p in read_plots(tmp_path / "plots.xlsx", UTM)] == [("A", 611300, 10)]


def test_ids_that_look_like_sizes_stay(tmp_path):
    (tmp_path / "plots.csv").write_text("plot,x,y,radius_m\n3m,611300,3718400,10\n5m,611400,3718400,10\n")
    assert [plot.plot_id for plot in read_plots(tmp_path / "plots.csv", UTM)] == ["3m", "5m"]


def test_thousands_in_doubt_are_no_numbers(tmp_path):
    text = "plot;x;y;radius_m\nA;611.300;3.718.400;10.5\n"
    with pytest.raises(InputError, match=r"line 2: y is '3.718.400', expected a number"):
        path = tmp_path / "plots.csv"
        path.write_text(text)
        read_plots(path, UTM)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "plot,x,y,radius_m,radius_ft\nA,611300,3718400,10,50\n",
            "line 2: radius_m is 10 and radius_ft 50, expected one",
        ),
        ("plot,x,y,radius_m,area_ha\nA,611300,3718400,10,0.05\n", "line 2: its size makes 314 m², but area_ha is 0.05"),
        ("plot,x,y,radius_m\nA,1,2,10\nB,3,2,10\nC,5,9,10\nMittel,3,4,10\n", "line 5: 'Mittel' sums up the rows above"),
        ("plot,x,y,radius_m\nA,1,2,10\nMean A,3,4,10\nC,5,9,10\nD,9,9,10\nE,8,1,10\nF,7,2,10\n", "line 3: 'Mean A'"),
        ("x,y,plot,radius_m\n1,2,A,10\n3,4,Subtotal:,10\n5,9,C,10\n", "line 3: 'Subtotal:' sums up"),
        ("plot;x;y;radius_m\nA;1;2;10\nB;3;2;10\n1 Ergebnis;4;4;20\n", "line 4: '1 Ergebnis' sums up"),
        ("plot;x;y;radius_m\nA;1;2;10\nB;3;2;10\nMoyenne;2;2;10\n", "line 4: 'Moyenne' sums up"),
        ("plot,x,y,width_m,length_m\nA,10,20,4,9\nB,10,20.01,4,9\n", "plots A and B are the same ground"),
    ],
)
def test_what_contradicts_itself_is_refused(tmp_path, text, says):
    path = tmp_path / "plots.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=says):
        read_sample(path, UTM)


def test_tables_of_means_and_notes_on_them_are_no_sums(tmp_path):
    path = tmp_path / "plots.csv"
    path.write_text(
        "plot,x,y,radius_m,statistic,note\nA,1,2,10,mean,\nB,9,2,10,mean,total\nC,1,9,10,mean,mean of two\n"
    )
    assert [plot.plot_id for plot in read_sample(path, UTM)] == ["A", "B", "C"]


def test_fia_s_subplots_are_plots_of_their_plot(tmp_path):
    path = tmp_path / "plots.csv"
    path.write_text("PLOT,SUBP,x,y,radius_ft\n7,1,1,2,24\n7,2,50,2,24\n8,1,1,90,24\n")
    assert [plot.plot_id for plot in read_sample(path, UTM)] == ["7-1", "7-2", "8-1"]


def test_plots_of_a_layer_may_have_heights_and_be_multipoints(tmp_path):
    circle = shapely.Point(611300, 3718400).buffer(10)
    for k, shape in enumerate([shapely.force_3d(circle, 30.0), shapely.MultiPoint([(611300, 3718400)])]):
        path = tmp_path / f"plots{k}.gpkg"
        table = gpd.GeoDataFrame({"plot_id": ["A"], "radius_m": [[None, 10.0][k]]}, geometry=[shape], crs=UTM)
        table.to_file(path, layer="plots", engine="pyogrio")
        assert read_sample(path, UTM)[0].contains([611305], [3718400]).all()
    twice = gpd.GeoDataFrame({"plot_id": ["A", "B"]}, geometry=[circle, circle], crs=UTM)
    twice.to_file(tmp_path / "twice.gpkg", layer="plots", engine="pyogrio")
    with pytest.raises(InputError, match="plots A and B are the same ground"):
        read_sample(tmp_path / "twice.gpkg", UTM)


def test_ids_of_plots_in_other_spellings():
    assert as_in_plots(["01", "1.0", "p 2", "3"], ["1", "P2", "3"]) == {"01": "1", "1.0": "1", "p 2": "P2"}
    assert as_in_plots(["01", "x"], ["1", "001"]) == {}
