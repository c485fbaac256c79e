"""Words for the user, in modules that work without QGIS: the translation (English until the plugin says otherwise), and
the engine's options under the names that QGIS gives them."""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Callable, Container
from pathlib import Path
from typing import Any

DECLARATIONS = Path(__file__).with_name("parameters.json")

#: The plugin puts QGIS' translation here.
translate: Callable[[str], str] = str


def tr(text: str) -> str:
    """The text in the user's language."""
    return translate(text)


@functools.lru_cache(maxsize=1)
def declarations() -> dict[str, dict[str, Any]]:
    """Verb -> its declaration; suffixes with their dot; ``known``: the names of its parameters."""
    commands = json.loads(DECLARATIONS.read_text(encoding="utf-8"))["commands"]
    for command in commands:
        for entry in command["parameters"]:
            entry["suffixes"] = ["." + suffix.lstrip(".").lower() for suffix in entry.get("suffixes", [])]
        command["known"] = {entry["name"] for entry in command["parameters"]}
        for entry in command["parameters"]:
            entry["known"] = command["known"]
    return {command["name"]: command for command in commands}


def qgis_name(name: str) -> str:
    """``workspace`` -> ``WORKSPACE``."""
    return name.upper()


def in_qgis_words(text: str, known: Container[str]) -> str:
    """The engine's sentence with ``--some-option`` as QGIS names it: ``SOME_OPTION``, with the algorithm where only
    another one has it; and with a verb, such as ``tape-check``, by its title in the toolbox."""

    def named(found: re.Match) -> str:
        name, value = found.group(1).replace("-", "_"), found.group(2)
        owner = next((each for each in declarations().values() if name in each["known"]), None)
        if owner is None:
            return found.group(0)
        elsewhere = "" if name in known else f" ({tr(owner['title'])})"
        return qgis_name(name) + (f"={value}" if value else "") + elsewhere

    # With a value that can only be one: --crs EPSG:6344, --crs local, --dbh-unit cm is left as two words.
    text = re.sub(r"--([a-z](?:[a-z0-9-]*[a-z0-9])?)(?: (EPSG:\w+|local)\b)?", named, text)
    # Verbs of one word are words of sentences too; a command line and a file's name stay.
    verbs = "|".join(name for name in declarations() if "-" in name)
    return re.sub(
        rf"(?<![\w/.-])(?<!treedgs )(?:{verbs})(?![\w/-]|\.\w)",
        lambda found: f"'{tr(declarations()[found[0]]['title'])}'",
        text,
    )


def in_labels(text: str, labels: dict[str, str]) -> str:
    """A sentence for a window, which shows labels: ``PLOTS`` becomes 'Plots'. labels: of the parameters, by name."""
    shown = {name: f"'{words}'" for name, words in labels.items() if words != name}
    # Not in a path, nor a value.
    names = r"(?<![\w/.='-])[A-Z][A-Z0-9_]+(?![\w/.-]\w)"
    return re.sub(names, lambda found: shown.get(found[0], found[0]), text)
