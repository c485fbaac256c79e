"""The form to print: for each plot a map, the trees to tape with room for what is read, and the trees that are missing.

One description of the pages makes the HTML page and the PDF.
"""

from __future__ import annotations

import base64
import html
import io
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import pandas as pd

from ...core.files import atomic_path
from .frame import Frame
from .sheets import Sheet

#: Empty rows for trees that are not on the map.
EXTRA_ROWS = 4
_DRAWN, _OTHER = "#17753c", "#9aa39d"


def rules(breast_height_m: float, north: str, with_plots: bool) -> list[str]:
    """What a crew has to know, in sentences."""
    where = "the plot's number" if with_plots else "the number of the nearest tree of the list (near_id)"
    search = (
        "Look through the whole plot for trees that the map lacks"
        if with_plots
        else "Look around each tree of the list for trees that the map lacks and that stand nearer to it than to any "
        "other tree of the map"
    )
    bearing = {"true": "true north", "grid": "grid north", "magnetic": "magnetic north (as the compass shows)"}[north]
    return [
        f"Tape every tree of the list at {breast_height_m:g} m above the ground, on the uphill side, to the millimetre "
        "(31.4 cm). No other tree instead of one that is hard to reach: the choice is what makes the result fair.",
        "No tree there: tick “none”. Dead: tick “dead”, and tape it. Not reached: tick that; nothing is assumed of it.",
        f"{search}, tape them and write them below with {where}. None found is a result too: tick “searched”.",
        *([f"Bearings are from the plot's centre, against {bearing}; distances are horizontal."] if with_plots else []),
        "“About” is what was measured, rounded to 5 cm, to tell neighbours apart.",
    ]


def columns(with_plots: bool) -> list[tuple[str, float]]:
    """Headings of the trees' table and the share of the width that each takes."""
    where = [("Bearing °", 0.09), ("Distance m", 0.09)] if with_plots else [("East", 0.1), ("North", 0.11)]
    return [
        ("Tree", 0.09), *where, ("About cm", 0.08), ("Taped DBH, cm", 0.17),
        ("none", 0.065), ("dead", 0.065), ("not reached", 0.09), ("Note", 0.25 if with_plots else 0.23),
    ]  # fmt: skip


def cells(tree: pd.Series, with_plots: bool) -> list[str]:
    """One row of the trees' table; empty cells are for the crew, ``□`` for ticks."""
    about = "no DBH" if pd.isna(tree["about_cm"]) else f"{tree['about_cm']:.0f}"
    if with_plots:
        known = pd.notna(tree["azim_deg"])
        where = [f"{tree['azim_deg'] % 360:.0f}" if known else "–", f"{tree['dist_m']:.1f}" if known else "–"]
    else:
        where = [f"{tree['x']:.1f}", f"{tree['y']:.1f}"]
    return [str(tree["tree_id"]), *where, about, "", "□", "□", "□", ""]


def draw_sheet(frame: Frame, sheet: Sheet) -> bytes:
    """PNG: the map of one page; trees to tape in colour with their numbers, the others grey."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib import patheffects

    figure, axis = plt.subplots(figsize=(6.4, 6.0), layout="constrained")
    origin = np.array([sheet.x, sheet.y])
    half = 1.06 * sheet.reach_m
    place = frame.trees[["x", "y"]].to_numpy(float) - origin
    near = (np.abs(place) <= half).all(axis=1)
    drawn = frame.trees["tree_id"].isin(sheet.trees["tree_id"]).to_numpy()
    across = frame.trees["dbh_cm"].fillna(12.0).to_numpy(float)
    # Discs at 2.5 times their true size: a stem is small on a map of a plot.
    points = (across / 100 * 2.5 / (2 * half) * 6.0 * 72) ** 2
    for mine, colour in ((near & ~drawn, _OTHER), (near & drawn, _DRAWN)):
        hollow = frame.trees["dbh_cm"].isna().to_numpy()
        axis.scatter(
            place[mine & ~hollow, 0], place[mine & ~hollow, 1], s=points[mine & ~hollow], color=colour, lw=0, zorder=3
        )
        axis.scatter(
            place[mine & hollow, 0],
            place[mine & hollow, 1],
            s=60,
            facecolors="none",
            edgecolors=colour,
            lw=1.6,
            zorder=3,
        )
    white = [patheffects.withStroke(linewidth=2.5, foreground="white")]
    n_labels = int((near & ~drawn).sum())
    for k in np.flatnonzero(near):
        if not drawn[k] and n_labels > 90:
            continue
        gap = (2 + np.sqrt(points[k]) / 2, 2)
        axis.annotate(
            str(frame.trees["tree_id"].iloc[k]), place[k], xytext=gap, textcoords="offset points", path_effects=white,
            fontsize=11 if drawn[k] else 6.5, fontweight="bold" if drawn[k] else "normal",
            color="black" if drawn[k] else "0.45", zorder=5 if drawn[k] else 4,
        )  # fmt: skip
    for plot in frame.plots:
        for part in getattr(plot.outline, "geoms", [plot.outline]) if plot.outline is not None else []:
            axis.plot(*(np.asarray(part.exterior.coords)[:, :2] - origin).T, color="0.3", lw=1.1)
    if sheet.plot_id is not None:
        axis.plot(0, 0, "+", color="black", ms=11, mew=1.4, zorder=6)
    axis.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
    axis.annotate(
        "N", (0.96, 0.985), (0.96, 0.90), xycoords="axes fraction", ha="center", fontsize=11,
        arrowprops={"arrowstyle": "-|>", "color": "black"},
    )  # fmt: skip
    axis.set_xlabel("m east of the centre" if sheet.plot_id else f"m east of {sheet.x:.0f}", fontsize=8)
    axis.set_ylabel("m north of the centre" if sheet.plot_id else f"m north of {sheet.y:.0f}", fontsize=8)
    axis.tick_params(labelsize=8)
    axis.grid(alpha=0.35)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=150)
    plt.close(figure)
    return picture.getvalue()


def write_html(path: Path, title: str, subtitle: str, said: list[str], pages: list[tuple[Sheet, bytes]]) -> Path:
    """One page without outside files; printed, each plot begins a sheet of paper."""
    body = []
    for sheet, picture in pages:
        with_plots = sheet.plot_id is not None
        heads = "".join(
            f"<th style='width:{100 * share:.1f}%'>{html.escape(name)}</th>" for name, share in columns(with_plots)
        )
        rows = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells(tree, with_plots)) + "</tr>"
            for _, tree in sheet.trees.iterrows()
        )
        empty = "<tr><td></td><td></td><td></td></tr>" * EXTRA_ROWS
        search = "the whole plot was searched □" if with_plots else "searched around every tree □"
        where = "Where (bearing, distance)" if with_plots else "Beside which tree of the list (near_id)"
        body.append(
            f"<section><h2>{html.escape(sheet.title)}</h2><p class='crew'>Date ______________ Crew "
            f"______________________________</p><img alt='map of the trees' src='data:image/png;base64,"
            f"{base64.b64encode(picture).decode()}'><table class='trees'><thead><tr>{heads}</tr></thead><tbody>{rows}"
            f"</tbody></table><h3>Trees that are not on the map ({html.escape(search)})</h3><table "
            f"class='extra'><thead>"
            f"<tr><th style='width:40%'>{html.escape(where)}</th><th style='width:20%'>Taped DBH, cm</th>"
            f"<th>Note</th></tr></thead><tbody>{empty}</tbody></table></section>"
        )
    template = Template((files(__package__) / "templates" / "form.html").read_text(encoding="utf-8"))
    page = template.substitute(
        title=html.escape(title),
        subtitle=html.escape(subtitle),
        rules="".join(f"<li>{html.escape(rule)}</li>" for rule in said),
        body="\n".join(body),
    )
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return Path(path)


def write_pdf(path: Path, title: str, subtitle: str, said: list[str], pages: list[tuple[Sheet, bytes]]) -> Path:
    """The same as A4 pages."""
    from xml.sax.saxutils import escape

    from reportlab.lib.pagesizes import A4
    from reportlab.lib.utils import ImageReader
    from reportlab.platypus import Image, KeepTogether, PageBreak, Paragraph, SimpleDocTemplate, Spacer

    from ..stand.pdf import report_fonts, text_style

    report_fonts()
    margin, width = 34.0, A4[0] - 68.0
    story: list[Any] = [
        Paragraph(escape(title), text_style(15, fontName="Report-Bold")),
        Paragraph(escape(subtitle), text_style(8.5, textColor="#5b675f", spaceAfter=4)),
        *(Paragraph(escape(f"• {rule}"), text_style(7.6, leftIndent=8, bulletIndent=0)) for rule in said),
    ]
    for number, (sheet, picture) in enumerate(pages):
        with_plots = sheet.plot_id is not None
        if number:
            story.append(PageBreak())
        across, down = ImageReader(io.BytesIO(picture)).getSize()
        tall = 300.0 if number == 0 else 345.0
        heads = [name for name, _ in columns(with_plots)]
        rows = [cells(tree, with_plots) for _, tree in sheet.trees.iterrows()]
        shares = [share * width for _, share in columns(with_plots)]
        search = "the whole plot was searched □" if with_plots else "searched around every tree □"
        where = "Where (bearing, distance)" if with_plots else "Beside which tree of the list (near_id)"
        story += [
            Spacer(1, 6),
            Paragraph(
                f"{escape(sheet.title)} <font name='Report' size='8'>&nbsp;&nbsp; Date ______________ &nbsp; Crew "
                "______________________________</font>",
                text_style(12, fontName="Report-Bold", textColor="#1f6b45"),
            ),
            Image(io.BytesIO(picture), tall * across / down, tall),
            _grid(heads, rows, shares, 21.0),
            KeepTogether(
                [
                    Paragraph(
                        escape(f"Trees that are not on the map ({search})"),
                        text_style(9, fontName="Report-Bold", spaceBefore=8, spaceAfter=3),
                    ),
                    _grid(
                        [where, "Taped DBH, cm", "Note"],
                        [["", "", ""]] * EXTRA_ROWS,
                        [0.4 * width, 0.2 * width, 0.4 * width],
                        19.0,
                    ),
                ]
            ),
        ]
    with atomic_path(path) as temporary:
        SimpleDocTemplate(
            str(temporary), pagesize=A4, leftMargin=margin, rightMargin=margin, topMargin=margin, bottomMargin=margin,
            title=title, author="TreeDGS",
        ).build(story)  # fmt: skip
    return Path(path)


def _grid(heads: list[str], rows: list[list[str]], widths: list[float], tall: float) -> Any:
    from xml.sax.saxutils import escape

    from reportlab.platypus import Paragraph, Table

    from ..stand.pdf import text_style

    head = text_style(7.2, fontName="Report-Bold")
    plain, bold = text_style(9), text_style(10, fontName="Report-Bold")
    body = [
        [Paragraph(escape(cell), bold if k == 0 and len(heads) > 3 else plain) for k, cell in enumerate(row)]
        for row in rows
    ]
    return Table(
        [[Paragraph(escape(name), head) for name in heads], *body],
        colWidths=widths,
        rowHeights=[None, *([tall] * len(rows))],
        repeatRows=1,
        style=[
            ("GRID", (0, 0), (-1, -1), 0.5, "#8a958d"),
            ("BACKGROUND", (0, 0), (-1, 0), "#f2f6f3"),
            ("VALIGN", (0, 0), (-1, -1), "MIDDLE"),
            ("LEFTPADDING", (0, 0), (-1, -1), 4),
            ("TOPPADDING", (0, 0), (-1, -1), 2),
            ("BOTTOMPADDING", (0, 0), (-1, -1), 2),
        ],
    )
