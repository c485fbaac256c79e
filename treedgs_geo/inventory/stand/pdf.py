"""The report as a PDF (A4, or letter in US units), from the same blocks as the page."""

from __future__ import annotations

import io
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from ...core.files import atomic_path
from .document import Document, ReportBlock
from .tables import Column, Table

_GREEN, _PALE, _SOFT, _LINE, _AMBER = "#1f6b45", "#f2f6f3", "#5b675f", "#d9dfda", "#fff4e0"


def write_pdf(path: Path, document: Document) -> Path:
    """Write the PDF atomically."""
    from reportlab.lib.pagesizes import A4, letter
    from reportlab.platypus import SimpleDocTemplate

    report_fonts()
    size = letter if document.units == "us" else A4
    story: list[Any] = [_header(document, size[0] - 2 * _MARGIN)]
    for block in document.blocks:
        story += _flow(block, size[0] - 2 * _MARGIN)
    with atomic_path(path) as temporary:
        template = SimpleDocTemplate(
            str(temporary),
            pagesize=size,
            leftMargin=_MARGIN,
            rightMargin=_MARGIN,
            topMargin=_MARGIN,
            bottomMargin=_MARGIN + 10,
            title=document.title,
            author="TreeDGS",
            subject=document.subtitle,
        )
        number = partial(_foot, title=document.title)
        template.build(story, onFirstPage=number, onLaterPages=number)
    return Path(path)


_MARGIN = 42.0
#: Nobody reads a longer list of trees on paper.
_LONGEST = 300


def report_fonts() -> None:
    """A font with all the letters that names have; matplotlib brings one."""
    import matplotlib
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    for name, file in (("Report", "DejaVuSans.ttf"), ("Report-Bold", "DejaVuSans-Bold.ttf")):
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, str(folder / file)))
    pdfmetrics.registerFontFamily(
        "Report", normal="Report", bold="Report-Bold", italic="Report", boldItalic="Report-Bold"
    )


def text_style(size: float = 8.5, **more: Any) -> Any:
    """A paragraph style of the report's font; more: of reportlab's ParagraphStyle."""
    from reportlab.lib.styles import ParagraphStyle

    more = {"fontName": "Report", "leading": size * 1.3, **more}
    return ParagraphStyle(f"s{size}{sorted(more.items())}", fontSize=size, **more)


def _foot(canvas: Any, template: Any, title: str) -> None:
    canvas.saveState()
    canvas.setFont("Report", 7)
    canvas.setFillColor(_SOFT)
    canvas.drawString(_MARGIN, _MARGIN - 8, title)
    canvas.drawRightString(template.pagesize[0] - _MARGIN, _MARGIN - 8, str(canvas.getPageNumber()))
    canvas.restoreState()


def _header(document: Document, width: float) -> Any:
    from reportlab.platypus import Paragraph
    from reportlab.platypus import Table as Grid

    lines = [
        [Paragraph(escape(document.title), text_style(17, fontName="Report-Bold", textColor="white"))],
        [Paragraph(escape(document.subtitle), text_style(9, textColor="white"))],
    ]
    return Grid(
        lines,
        colWidths=[width],
        style=[
            ("BACKGROUND", (0, 0), (-1, -1), _GREEN),
            ("LEFTPADDING", (0, 0), (-1, -1), 12),
            ("TOPPADDING", (0, 0), (0, 0), 12),
            ("BOTTOMPADDING", (0, 1), (0, 1), 12),
        ],
    )


def _flow(block: ReportBlock, width: float) -> list[Any]:
    from reportlab.platypus import CondPageBreak, KeepTogether, Paragraph, Spacer

    if block.kind == "cards":
        return [Spacer(1, 10), _cards(block, width), Spacer(1, 8)]
    if block.kind == "heading":
        style = text_style(12, fontName="Report-Bold", textColor=_GREEN, spaceBefore=14, spaceAfter=4, keepWithNext=1)
        # A heading alone at the foot of a page helps nobody.
        return [CondPageBreak(160), Paragraph(escape(block.text), style)]
    if block.kind in ("warnings", "list"):
        return [_sentences(block, width), Spacer(1, 6)] if block.items else []
    if block.kind == "picture":
        return [_picture(block.picture, width), Spacer(1, 6)]
    assert block.table is not None
    head = Paragraph(
        escape(block.table.title), text_style(9, fontName="Report-Bold", spaceBefore=8, spaceAfter=3, keepWithNext=1)
    )
    rows, left_out = block.rows(_LONGEST)
    parts = [head, _grid(replace(block.table, rows=rows), block.shown, width)]
    notes = " ".join(filter(None, (block.table.note, left_out)))
    if notes:
        parts.append(Paragraph(escape(notes), text_style(7, textColor=_SOFT, spaceBefore=2, spaceAfter=8)))
    return [KeepTogether(parts)] if len(block.table.rows) <= 20 else parts


def _cards(block: ReportBlock, width: float) -> Any:
    from reportlab.platypus import Paragraph
    from reportlab.platypus import Table as Grid

    across = min(len(block.items), 6) or 1
    small = across > 4
    cells = []
    for label, value, interval in block.items:
        text = (
            f"<font size='6.5' color='{_SOFT}'>{escape(label)}</font><br/>"
            f"<font name='Report-Bold' size='{9 if small else 11}'>{escape(value)}</font><br/>"
            f"<font size='6.5' color='{_SOFT}'>{escape(interval)}</font>"
        )
        cells.append(Paragraph(text, text_style(9, leading=13)))
    return Grid(
        [cells],
        colWidths=[width / across] * across,
        style=[
            ("BACKGROUND", (0, 0), (-1, -1), _PALE),
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("LINEAFTER", (0, 0), (-2, -1), 3, "white"),
            ("LEFTPADDING", (0, 0), (-1, -1), 6),
            ("RIGHTPADDING", (0, 0), (-1, -1), 2),
        ],
    )


def _sentences(block: ReportBlock, width: float) -> Any:
    from reportlab.platypus import ListFlowable, ListItem, Paragraph
    from reportlab.platypus import Table as Grid

    items = [ListItem(Paragraph(escape(item), text_style(8)), leftIndent=10) for item in block.items]
    listed = ListFlowable(items, bulletType="bullet", start="•", bulletFontSize=8, leftIndent=10)
    if block.kind == "list":
        return listed
    head = Paragraph("Read this first", text_style(8.5, fontName="Report-Bold"))
    return Grid(
        [[head], [listed]],
        colWidths=[width],
        style=[
            ("BACKGROUND", (0, 0), (-1, -1), _AMBER),
            ("LINEBEFORE", (0, 0), (0, -1), 3, "#e69f00"),
            ("LEFTPADDING", (0, 0), (-1, -1), 8),
        ],
    )


def _picture(data: bytes, width: float) -> Any:
    from reportlab.lib.utils import ImageReader
    from reportlab.platypus import Image

    across, down = ImageReader(io.BytesIO(data)).getSize()
    # Drawn for 160 dots an inch; never wider than the page, nor taller than most of it.
    scale = min(72 / 160, width / across, 520 / down)
    return Image(io.BytesIO(data), across * scale, down * scale)


def _grid(table: Table, columns: list[Column], width: float) -> Any:
    from reportlab.platypus import Paragraph
    from reportlab.platypus import Table as Grid

    size = 7.5 if len(columns) <= 9 else 6.3
    right = {column.key: column.decimals is not None for column in columns}
    cells = {
        align: text_style(size, alignment=2 if align else 0, **({} if align else {"splitLongWords": 1}))
        for align in (True, False)
    }
    heads = {
        align: text_style(size, alignment=2 if align else 0, fontName="Report-Bold", textColor=_SOFT)
        for align in (True, False)
    }
    lines = [[Paragraph(escape(c.heading), heads[right[c.key]]) for c in columns]]
    for number, row in enumerate(table.rows):
        total = number >= len(table.rows) - table.n_totals
        line = []
        for column in columns:
            text = escape(table.text(row, column))
            line.append(Paragraph(f"<b>{text}</b>" if total else text, cells[right[column.key]]))
        lines.append(line)
    style: list[tuple] = [
        ("LINEBELOW", (0, 0), (-1, 0), 0.9, "black"),
        ("LINEBELOW", (0, 1), (-1, -1), 0.4, _LINE),
        ("VALIGN", (0, 0), (-1, -1), "TOP"),
        ("VALIGN", (0, 0), (-1, 0), "BOTTOM"),
        ("LEFTPADDING", (0, 0), (-1, -1), 2),
        ("RIGHTPADDING", (0, 0), (-1, -1), 4),
        ("TOPPADDING", (0, 0), (-1, -1), 2),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2),
    ]
    if table.n_totals:
        first = len(lines) - table.n_totals
        style.append(("LINEABOVE", (0, first), (-1, first), 0.9, "black"))
    return Grid(lines, colWidths=_widths(table, columns, width, size), style=style, repeatRows=1, hAlign="LEFT")


def _widths(table: Table, columns: list[Column], width: float, size: float) -> list[float]:
    """Column widths from what is in them: numbers get what they need, long texts share the rest."""
    from reportlab.pdfbase.pdfmetrics import stringWidth

    wanted, least = [], []
    for column in columns:
        texts = [table.text(row, column) for row in table.rows]
        longest = max((stringWidth(text, "Report-Bold", size) for text in texts), default=0.0)
        words = [stringWidth(word, "Report-Bold", size) for word in column.heading.split()]
        if column.decimals is None:
            words += [stringWidth(word, "Report", size) for text in texts for word in text.split()]
            least.append(min(max(words, default=20.0), 0.2 * width) + 8)
        else:
            least.append(max([longest, *words]) + 8)
        wanted.append(max(longest, *words) + 10)
    spare = width - sum(least)
    if spare <= 0:
        return [width * w / sum(least) for w in least]
    extra = [max(w - m, 0.0) for w, m in zip(wanted, least, strict=True)]
    total = sum(extra)
    if total <= spare:
        return [m + e for m, e in zip(least, extra, strict=True)]
    return [m + e * spare / total for m, e in zip(least, extra, strict=True)]
