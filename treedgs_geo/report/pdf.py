"""A document as PDF (A4, or letter), from the same blocks as the page."""

from __future__ import annotations

import io
from functools import partial
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from ..core.files import atomic_path, ensure_writable
from ..core.geopackage import OwnLayers, ensure_unlocked
from .blocks import Block, Cards, Column, Document, Heading, Paragraph, Picture, Sentences, Table
from .charts import DPI
from .html import write_html

_GREEN, _PALE, _SOFT, _LINE, _AMBER = "#1f6b45", "#f2f6f3", "#5b675f", "#d9dfda", "#fff4e0"
_MARGIN = 36.0
#: Points of the largest height of a picture, and of the rows of a table to fill in.
_MAX_PICTURE, _TALL_ROW = 520.0, 20.0
#: Nobody reads a longer folded table on paper.
MAX_ROWS = 300


def write_pdf(path: Path, document: Document) -> Path:
    """Write the PDF, whole or not at all.

    Raises:
        ModuleNotFoundError: the extra ``reports`` is not installed.
    """
    from reportlab.lib.pagesizes import A4, letter
    from reportlab.platypus import HRFlowable, SimpleDocTemplate
    from reportlab.platypus import Paragraph as Text

    load_fonts()
    size = letter if document.letter else A4
    width = size[0] - 2 * _MARGIN
    story: list[Any] = [
        Text(escape(document.title), _style(17, fontName="Report-Bold", textColor=_GREEN)),
        Text(escape(document.subtitle), _style(8.5, textColor=_SOFT, spaceBefore=3, spaceAfter=4)),
        HRFlowable(width="100%", thickness=1.2, color=_GREEN, spaceAfter=6),
    ]
    for block in document.blocks:
        story += _flow(block, width)
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


def ensure_pages(folder: Path, record: str, layer: str, own: OwnLayers) -> None:
    """Prove, before the work, that a folder can take its ``record``, its GeoPackage ``layer`` and its pages.

    Raises:
        OutputError: it cannot be written, or the layer is being edited. ModuleNotFoundError: the extra ``reports`` is
            not installed.
    """
    ensure_writable(folder / record)
    load_fonts()
    ensure_unlocked(folder / layer, own)


def write_pages(base: Path, document: Document) -> list[Path]:
    """``BASE.html`` and ``BASE.pdf``."""
    return [write_html(base.with_suffix(".html"), document), write_pdf(base.with_suffix(".pdf"), document)]


def load_fonts() -> None:
    """A font with all the letters that names have; matplotlib brings one. Called first, it says that the extra is
    missing before anything is written.

    Raises:
        ModuleNotFoundError: the extra ``reports`` is not installed.
    """
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


def _style(size: float = 8.5, **more: Any) -> Any:
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


def _flow(block: Block, width: float) -> list[Any]:
    from reportlab.platypus import CondPageBreak, KeepTogether, PageBreak, Spacer
    from reportlab.platypus import Paragraph as Text

    if isinstance(block, Cards):
        return [Spacer(1, 4), _cards(block, width), Spacer(1, 8)]
    if isinstance(block, Heading):
        size = 12 if block.level == 2 else 9.5
        style = _style(size, fontName="Report-Bold", textColor=_GREEN, spaceBefore=10, spaceAfter=4, keepWithNext=1)
        # A heading alone at the foot of a page helps nobody.
        return [PageBreak() if block.new_page else CondPageBreak(160), Text(escape(block.text), style)]
    if isinstance(block, Paragraph):
        return [Text(escape(block.text), _style(8, spaceAfter=5, fontName="Report-Bold" if block.strong else "Report"))]
    if isinstance(block, Sentences):
        return [_sentences(block, width), Spacer(1, 6)] if block.items else []
    if isinstance(block, Picture):
        return [_picture(block, width), Spacer(1, 6)]
    if not isinstance(block, Table):
        return []
    rows, notes = block.cut(MAX_ROWS)
    head = _style(9, fontName="Report-Bold", spaceBefore=8, spaceAfter=3, keepWithNext=1)
    parts = [Text(escape(block.title), head)] if block.title else []
    parts.append(_grid(block, rows, width))
    if notes:
        parts.append(Text(escape(notes), _style(7, textColor=_SOFT, spaceBefore=2, spaceAfter=8)))
    return [KeepTogether(parts)] if len(block.rows) <= 20 else parts


def _cards(block: Cards, width: float) -> Any:
    from reportlab.platypus import Paragraph as Text
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
        cells.append(Text(text, _style(9, leading=13)))
    return Grid(
        [cells[first : first + across] for first in range(0, len(cells), across)],
        colWidths=[width / across] * across,
        style=[
            ("BACKGROUND", (0, 0), (-1, -1), _PALE),
            ("VALIGN", (0, 0), (-1, -1), "TOP"),
            ("LINEAFTER", (0, 0), (-2, -1), 3, "white"),
            ("LEFTPADDING", (0, 0), (-1, -1), 6),
            ("RIGHTPADDING", (0, 0), (-1, -1), 2),
        ],
    )


def _sentences(block: Sentences, width: float) -> Any:
    from reportlab.platypus import ListFlowable, ListItem
    from reportlab.platypus import Paragraph as Text
    from reportlab.platypus import Table as Grid

    items = [ListItem(Text(escape(item), _style(8)), leftIndent=10) for item in block.items]
    listed = ListFlowable(items, bulletType="bullet", start="•", bulletFontSize=8, leftIndent=10)
    if not block.title:
        return listed
    head = Text(escape(block.title), _style(8.5, fontName="Report-Bold"))
    return Grid(
        [[head], [listed]],
        colWidths=[width],
        style=[
            ("BACKGROUND", (0, 0), (-1, -1), _AMBER),
            ("LINEBEFORE", (0, 0), (0, -1), 3, "#e69f00"),
            ("LEFTPADDING", (0, 0), (-1, -1), 8),
        ],
    )


def _picture(block: Picture, width: float) -> Any:
    from reportlab.lib.utils import ImageReader
    from reportlab.platypus import Image

    across, down = ImageReader(io.BytesIO(block.data)).getSize()
    # Never wider than the page, nor taller than most of it.
    scale = min(72 / DPI, (block.width or 1.0) * width / across, _MAX_PICTURE / down)
    return Image(io.BytesIO(block.data), across * scale, down * scale)


def _grid(table: Table, rows: list[dict[str, Any]], width: float) -> Any:
    from reportlab.platypus import Paragraph as Text
    from reportlab.platypus import Table as Grid

    columns = table.shown
    size = 8.0 if table.widths else 7.5 if len(columns) <= 9 else 6.3

    def cell(text: str, column: Column, **more: Any) -> Any:
        right = column.decimals is not None and not table.widths
        look = {"alignment": 2} if right else {"splitLongWords": 1}
        return Text(escape(text), _style(size, **look, **more))

    bold = {"fontName": "Report-Bold"}
    lines = [[cell(column.heading, column, textColor=_SOFT, **bold) for column in columns]]
    for number, row in enumerate(rows):
        total = number >= len(table.rows) - table.n_totals
        heads = [total or bool(table.widths) and not k for k in range(len(columns))]
        lines.append(
            [
                cell(table.text(row, column), column, **(bold if head else {}))
                for column, head in zip(columns, heads, strict=True)
            ]
        )
    style: list[tuple] = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"), ("VALIGN", (0, 0), (-1, 0), "BOTTOM"),
        ("LEFTPADDING", (0, 0), (-1, -1), 2), ("RIGHTPADDING", (0, 0), (-1, -1), 4),
        ("TOPPADDING", (0, 0), (-1, -1), 2), ("BOTTOMPADDING", (0, 0), (-1, -1), 2),
    ]  # fmt: skip
    if table.widths:
        style += [
            ("GRID", (0, 0), (-1, -1), 0.5, "#8a958d"),
            ("BACKGROUND", (0, 0), (-1, 0), _PALE),
            ("VALIGN", (0, 1), (-1, -1), "MIDDLE"),
        ]
    else:
        style += [("LINEBELOW", (0, 0), (-1, 0), 0.9, "black"), ("LINEBELOW", (0, 1), (-1, -1), 0.4, _LINE)]
    if table.n_totals:
        first = len(lines) - table.n_totals
        style.append(("LINEABOVE", (0, first), (-1, first), 0.9, "black"))
    widths = [share * width for share in table.widths] or _widths(table, rows, columns, width, size)
    heights = [None, *([_TALL_ROW] * len(rows))] if table.widths else None
    return Grid(lines, colWidths=widths, rowHeights=heights, style=style, repeatRows=1, hAlign="LEFT")


def _widths(table: Table, rows: list[dict[str, Any]], columns: list[Column], width: float, size: float) -> list[float]:
    """Column widths from what is in them: numbers get what they need, long texts share the rest."""
    from reportlab.pdfbase.pdfmetrics import stringWidth

    wanted, least = [], []
    for column in columns:
        texts = [table.text(row, column) for row in rows]
        longest = max((stringWidth(text, "Report-Bold", size) for text in texts), default=0.0)
        words = [stringWidth(word, "Report-Bold", size) for word in column.heading.split()]
        if column.decimals is None:
            words += [stringWidth(word, "Report", size) for text in texts for word in text.split()]
            least.append(min(max(words, default=20.0), 0.2 * width) + 8)
        else:
            least.append(max([longest, *words]) + 8)
        wanted.append(max(longest, *words, 0.0) + 10)
    spare = width - sum(least)
    if spare <= 0:
        return [width * w / sum(least) for w in least]
    extra = [max(w - m, 0.0) for w, m in zip(wanted, least, strict=True)]
    total = sum(extra)
    if total <= spare:
        return [m + e for m, e in zip(least, extra, strict=True)]
    return [m + e * spare / total for m, e in zip(least, extra, strict=True)]
