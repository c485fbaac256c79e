"""A document as one HTML page without outside files. Every text is escaped (Jinja's autoescape)."""

from __future__ import annotations

import base64
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.files import atomic_path
from .blocks import Document, Fragment, Picture

if TYPE_CHECKING:
    from jinja2 import Environment

#: A longer folded table makes the page slow to open.
MAX_ROWS = 2000


def write_html(path: Path, document: Document) -> Path:
    """Write the page, whole or not at all."""
    page = _environment().get_template("page.html").render(document=document)
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")
    return Path(path)


@lru_cache(maxsize=1)
def _environment() -> Environment:
    import jinja2

    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).with_name("templates")),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.globals.update(
        kind=lambda block: type(block).__name__.lower(), image=_image, fragment=_fragment, max_rows=MAX_ROWS
    )
    return found


def _image(picture: Picture) -> str:
    """What stands in the page for a picture: an SVG element as it is, anything else as an ``<img>``."""
    from markupsafe import Markup

    if b"<svg" in picture.data[:1000]:
        return Markup(picture.data[picture.data.index(b"<svg") :].decode("utf-8"))
    mime = "jpeg" if picture.data.startswith(b"\xff\xd8") else "png"
    width = Markup(" style='width: {:.0f}%'").format(100 * picture.width) if picture.width else ""
    data = base64.b64encode(picture.data).decode()
    return Markup("<img alt='{}'{} src='data:image/{};base64,{}'>").format(picture.text, width, mime, data)


def _fragment(block: Fragment) -> str:
    from markupsafe import Markup

    return Markup(_environment().from_string(block.template).render(block.values))
