"""Blocks as HTML, PDF, Markdown and LaTeX: what a reader sees, and that a user's text stays text."""

from __future__ import annotations

import re
import subprocess
from html.parser import HTMLParser

import pandas as pd
import pytest

from treedgs_geo.report.blocks import (
    Cards,
    Column,
    Document,
    Fragment,
    Heading,
    Paragraph,
    Picture,
    Sentences,
    Table,
    booktabs,
    facts_table,
    known,
)
from treedgs_geo.report.charts import chart_png, chart_svg, new_chart
from treedgs_geo.report.html import write_html
from treedgs_geo.report.pdf import write_pdf
from treedgs_lab.benchmarks.records import markdown

HOSTILE = "<script>alert('x')</script>\"&|_%{{ 7 * 7 }} </td>"
COLUMNS = [
    Column("plot", HOSTILE),
    Column("dbh", "DBH, cm", 1),
    Column("share", "%", 0, 100),
    Column("g", "±", 2, 1, True),
]
ROWS = [
    {"plot": HOSTILE, "dbh": 1234.56, "share": 0.255, "g": 0.5, "mark": "failed"},
    {"plot": "B", "dbh": float("nan"), "share": None, "g": -0.001},
    {"plot": "all", "dbh": 30.0, "share": "few", "g": 1.0},
]
TABLE = Table("trees", HOSTILE, COLUMNS, ROWS, HOSTILE, n_totals=1)


def picture() -> bytes:
    figure, axes = new_chart(2, 1)
    axes.plot([0, 1], [0, 1], label=HOSTILE)
    axes.legend()
    return chart_png(figure)


def every_block() -> list:
    return [
        Heading(HOSTILE),
        Paragraph(HOSTILE, strong=True),
        Cards([(HOSTILE, HOSTILE, HOSTILE)] * 8),
        Sentences([HOSTILE], HOSTILE),
        Sentences([]),
        Picture(HOSTILE, picture()),
        TABLE,
        facts_table("facts", HOSTILE, {HOSTILE: HOSTILE}),
    ]


class Seen(HTMLParser):
    """Tags, and the texts between them."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags, self.texts, self.attributes = [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [name for name, _ in attrs]

    def handle_data(self, data):
        self.texts.append(data)


def test_a_users_text_is_text_in_every_block_of_a_page(tmp_path):
    page = write_html(tmp_path / "p.html", Document(HOSTILE, HOSTILE, every_block()))
    seen = Seen(page.read_text(encoding="utf-8"))
    assert "script" not in seen.tags and not any(name.startswith("on") for name in seen.attributes)
    assert sum(HOSTILE in text for text in seen.texts) >= 20, "shown as it was written, no template run"
    assert seen.tags.count("table") == 2 and seen.tags.count("img") == 1


def test_options_have_no_dashes_on_a_page():
    said = Sentences(["--years: not given (see --max-growth-cm); 3--4 m, well-known"]).items
    assert said == ["years: not given (see max-growth-cm); 3--4 m, well-known"]


def test_a_fragment_escapes_its_values_too(tmp_path):
    block = Fragment(
        "<b>{{ name }}</b><script>var x = {{ data|tojson }};</script>", {"name": HOSTILE, "data": [HOSTILE]}
    )
    page = write_html(tmp_path / "p.html", Document("t", "s", [block])).read_text(encoding="utf-8")
    assert page.count("<script>") == 1 and "<b>&lt;script&gt;" in page


def test_numbers_are_shown_with_their_decimals_and_what_is_unknown_with_a_dash(tmp_path):
    assert [TABLE.text(ROWS[0], column) for column in COLUMNS[1:]] == ["1\u202f234.6", "26", "+0.50"]
    assert [TABLE.text(ROWS[1], column) for column in COLUMNS[1:]] == ["–", "–", "+0.00"]
    assert TABLE.text(ROWS[2], COLUMNS[2]) == "few"
    page = write_html(tmp_path / "p.html", Document("t", "s", [TABLE])).read_text(encoding="utf-8")
    assert [re.sub("<.*?>", "", row) for row in re.findall("<tr class='total'>.*?</tr>", page)] == ["all30.0few+1.00"]
    assert page.count("<tr class='failed'>") == 1 and known(float("inf")) is known(None) is known(pd.NA) is None
    assert known(3) == 3.0 and known(3, 2.0) == 6.0


def test_a_long_folded_table_is_cut_and_says_where_the_rest_is(tmp_path):
    rows = [{"plot": str(k), "dbh": 1.0} for k in range(2100)]
    table = Table("long", "Trees", COLUMNS[:2], rows, folded=True, more="stand_trees.csv")
    page = write_html(tmp_path / "p.html", Document("t", "s", [table])).read_text(encoding="utf-8")
    assert page.count("<tr>") == 2001 and "100 more in stand_trees.csv." in page and "Trees (2100)" in page


def test_columns_in_which_nothing_stands_are_left_out():
    table = Table("t", "", COLUMNS, [{"plot": "A", "dbh": None}])
    assert [column.key for column in table.shown] == ["plot"]


def test_the_pdf_has_every_text_and_no_card_beyond_the_page(tmp_path):
    path = write_pdf(tmp_path / "p.pdf", Document("Title & é", "林 sub", every_block()))
    text = subprocess.run(["pdftotext", "-layout", path, "-"], capture_output=True, text=True, check=True).stdout
    assert "Title & é" in text and "alert('x')" in text and "234.6" in text


def test_markdown_keeps_a_bar_and_a_line_break_inside_a_cell():
    text = markdown([Heading("One"), Table("t", "Title", COLUMNS[:1], [{"plot": "a|b\nc"}], "note"), Sentences(["x"])])
    assert "## One\n\nTitle\n\n| " in text and "| a\\|b c |" in text and text.endswith("note\n\n- x\n")


def test_latex_escapes_and_rules():
    text = booktabs(Table("t", "", COLUMNS[:2], ROWS, n_totals=1))
    assert r"\&" in text and r"\_\%\{\{ 7 * 7" in text and text.count(r"\midrule") == 2 and "& -- " in text
    grouped = booktabs(Table("t", "", COLUMNS[:2], [{"plot": "a"}, {"plot": "a"}, {"plot": "b"}]), "plot")
    assert grouped.count(r"\midrule") == 2


def test_charts_leave_the_users_pyplot_alone_and_repeat_to_the_byte():
    import matplotlib

    before = dict(matplotlib.rcParams)
    drawn = []
    for _ in range(2):
        figure, axes = new_chart(3, 2)
        axes.plot([0, 1], [1, 0], label="a")
        axes.legend()
        drawn.append(chart_svg(figure))
        assert not axes.get_legend().get_frame_on() and not axes.spines["top"].get_visible()
    assert drawn[0] == drawn[1] and dict(matplotlib.rcParams) == before


def test_a_page_that_cannot_be_made_leaves_nothing(tmp_path):
    with pytest.raises(Exception, match="undefined"):
        write_html(tmp_path / "p.html", Document("t", "s", [Fragment("{{ missing }}", {})]))
    assert list(tmp_path.iterdir()) == []
