"""The docs as pages for a browser: the plugin brings them as Markdown, which browsers show as text."""

from __future__ import annotations

import re
from pathlib import Path

from qgis.PyQt.QtGui import QTextDocument

from .engine import PLUGIN_ROOT, data_dir

DOCS = PLUGIN_ROOT / "docs"
#: Algorithm -> its page in ``docs/technician``; the others have ``qgis``.
PAGES = {
    "planflight": "plan-flight",
    "photostodbh": "walkthrough",
    "pointcloudtodbh": "point-clouds",
    "campaign": "campaign",
    "geotag": "geotags",
    "reviewtrees": "review",
    "review": "review",
    "matchplots": "pairing",
    "evaluate": "pairing",
    "tapesample": "taping",
    "tapecheck": "taping",
    "trial": "trial",
    "standtable": "stand-table",
    "compare": "two-dates",
}
STYLE = (
    "<style>body{max-width:56em;margin:2em auto;padding:0 1em;line-height:1.45}img{max-width:100%}"
    "table{border-collapse:collapse;margin:1em 0}td,th{border:1px solid #ccc;padding:.25em .6em;vertical-align:top}"
    "p{margin:.5em 0}td p{margin:0}</style></head>"
)
_LINK = re.compile(r"(\]\()(?!\w+:)([^)#\s]*)\.md(#[^)\s]*)?\)")
_KEPT = re.compile(r"font-weight:\w+|font-style:\w+|font-family:[^;]*[Mm]ono[^;]*")
_PICTURE = re.compile(r"(!\[[^\]]*\]\()(?!\w+:)([^)\s]+)\)")


def address(algorithm: str) -> str:
    """The address of an algorithm's page; its Markdown where no page can be written."""
    below = Path("technician") / PAGES.get(algorithm, "qgis")
    target = data_dir() / "docs"
    try:
        for source in DOCS.rglob("*.md"):
            page = target / source.relative_to(DOCS).with_suffix(".html")
            if not page.exists() or page.stat().st_mtime < source.stat().st_mtime:
                page.parent.mkdir(parents=True, exist_ok=True)
                page.write_text(as_html(source), encoding="utf-8")
    except OSError:
        return (DOCS / below).with_suffix(".md").as_uri()
    return (target / below).with_suffix(".html").as_uri()


def as_html(source: Path) -> str:
    """A page of the docs; links lead to the other pages, pictures stay where they are."""
    text = _PICTURE.sub(
        lambda found: f"{found[1]}{(source.parent / found[2]).resolve().as_uri()})", source.read_text("utf-8")
    )
    document = QTextDocument()
    document.setMarkdown(_LINK.sub(lambda found: f"{found[1]}{found[2]}.html{found[3] or ''})", text))
    # Letters and margins of a browser, not those of QGIS.
    html = re.sub(r' style="([^"]*)"', lambda found: _style(_KEPT.findall(found[1])), document.toHtml())
    return html.replace("</head>", STYLE)


def _style(declarations: list[str]) -> str:
    return f' style="{"; ".join(declarations)}"' if declarations else ""
