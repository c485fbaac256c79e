"""Translation for the modules that work without QGIS: English until the plugin says otherwise."""

from __future__ import annotations

from collections.abc import Callable

#: The plugin puts QGIS' translation here.
translate: Callable[[str], str] = str


def tr(text: str) -> str:
    """The text in the user's language."""
    return translate(text)
