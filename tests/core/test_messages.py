"""Every option that a message names exists under that name where the message is shown."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from treedgs_geo.core.command import OPTION, with_verbs
from treedgs_geo.core.settings import params_of
from treedgs_geo.verbs import all_commands
from treedgs_qgis.words import declarations, in_labels, in_qgis_words

ROOT = Path(__file__).resolve().parents[2]
#: The command's own switches, and modules that write the command lines of other programs.
OWN = {"help", "version", "job", "log-format", "json", "example", "overwrite"}
OTHER_PROGRAMS = {"core/frames.py", "propose/external_programs.py"}


def _texts() -> list[tuple[str, str]]:
    """Every text of the library that names an option, with its file; parts of an f-string joined by ``{}``."""
    found = []
    for path in sorted((ROOT / "treedgs_geo").rglob("*.py")):
        if path.as_posix().endswith(tuple(OTHER_PROGRAMS)):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
        for node in ast.walk(tree):
            if isinstance(node, ast.JoinedStr):
                text = "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
                text = node.value
            else:
                continue
            if OPTION.search(text):
                found.append((path.relative_to(ROOT).as_posix(), text))
    return found


def test_every_option_in_a_message_is_one_of_some_verb() -> None:
    known = {name.replace("_", "-") for each in all_commands() for name, _, _ in params_of(each.settings)} | OWN
    texts = _texts()
    assert len(texts) > 100
    unknown = [(file, option) for file, text in texts for option in OPTION.findall(text) if option not in known]
    assert not unknown


@pytest.mark.parametrize("command", all_commands(), ids=lambda command: command.name)
def test_what_a_verb_lacks_is_named_with_the_verb_that_has_it(command) -> None:
    commands = all_commands()
    own = {name.replace("_", "-") for name, _, _ in params_of(command.settings)} | OWN
    verbs = tuple(f"{each.name} " for each in commands)
    text = "\n".join(text.replace("\n", " ") for _, text in _texts())
    said = with_verbs(text, command, commands)
    for found in OPTION.finditer(said):
        there = found.group(1) in own or said[found.end() :].startswith(" (treedgs ")
        there = there or said[: found.start()].endswith(verbs)
        assert there, said[max(0, found.start() - 200) : found.end()]
    shown = in_qgis_words(text, declarations()[command.name]["known"])
    # What no dialog has is the command line's.
    dialogs = {name for verb in declarations().values() for name in verb["known"]}
    left = {name.replace("-", "_") for name in re.findall(r"(?<![\w-])--([a-z][a-z0-9-]*[a-z0-9])", shown)}
    assert not left & dialogs, left & dialogs


def test_in_words() -> None:
    photos = declarations()["photos-to-dbh"]["known"]
    assert in_qgis_words("give --geotags-crs EPSG:7912.", photos) == "give GEOTAGS_CRS=EPSG:7912."
    assert in_qgis_words("name it with --base.", photos) == "name it with BASE (Geotag drone photos)."
    said = "run tape-check; treedgs stand-table, docs/technician/stand-table.md and stand-table.csv stay."
    assert in_qgis_words(said, photos) == said.replace("tape-check", "'Check diameters against tapes'")
    labels = {"PLOTS": "Plots", "TAPED": "Taped trees", "CRS": "CRS"}
    said = in_labels("TAPED: /data/PLOTS/TAPED.csv; give PLOTS, or CRS=EPSG:6344.", labels)
    assert said == "'Taped trees': /data/PLOTS/TAPED.csv; give 'Plots', or CRS=EPSG:6344."
    chain = next(command for command in all_commands() if command.name == "photos-to-dbh")
    assert with_verbs("name it with --base.", chain, all_commands()) == "name it with --base (treedgs geotag)."
    assert with_verbs("run geotag --base B", chain, all_commands()) == "run geotag --base B"
