"""What a verb is: one settings class and one function, shown on three faces."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from dataclasses import MISSING, dataclass
from typing import Any

from .progress import Reporter
from .settings import Param, params_of


@dataclass(frozen=True)
class Command:
    """A verb of the library.

    name: command-line name (``photos-to-dbh``). title, group, summary: shown in the toolbox and in ``--help``. help:
    inputs, outputs, units and limits, in full sentences. qgis_id: algorithm id without provider, where it is not the
    name without its dashes.
    run: ``(settings, reporter) -> result``; the result is JSON-serialisable. example: one command line.
    outputs: result keys that are files or scalars, with a description each. main: the parameters that most people give,
    by need; the others follow as declared, folded away in QGIS.
    """

    name: str
    title: str
    group: str
    summary: str
    help: str
    settings: type
    run: Callable[[Any, Reporter], dict[str, Any]]
    example: str
    outputs: dict[str, str]
    main: tuple[str, ...] = ()
    qgis_id: str = ""


def run_by(module: str, function: str) -> Callable[[Any, Reporter], dict[str, Any]]:
    """What runs a verb, imported only then: settings are read in an instant, and without the libraries. module: within
    the library (``inventory.change.run``)."""

    def run(settings: Any, reporter: Reporter) -> dict[str, Any]:
        return getattr(importlib.import_module(f"treedgs_geo.{module}"), function)(settings, reporter)

    return run


def ordered_params(command: Command) -> list[tuple[str, Param, Any]]:
    """``(name, Param, default)`` as they are shown: those of ``main`` first."""
    place = {name: number for number, name in enumerate(command.main)}
    return sorted(params_of(command.settings), key=lambda entry: place.get(entry[0], len(place)))


def describe(command: Command) -> dict[str, Any]:
    """The command as JSON for the QGIS plugin: what its dialog shows."""
    parameters = []
    for name, spec, default in ordered_params(command):
        if not spec.dialog:
            continue
        entry = {key: value for key, value in vars(spec).items() if value not in ("", (), None, False)}
        entry = {key: value for key, value in entry.items() if key not in ("dialog", "holds", "known_by", "code")}
        if name not in command.main:
            entry["advanced"] = True
        entry.update(name=name, required=default is MISSING, default=None if default is MISSING else default)
        parameters.append(entry)
    said = {key: getattr(command, key) for key in ("title", "group", "summary", "help", "example", "outputs")}
    own_id = command.qgis_id or command.name.replace("-", "")
    return {"name": command.name, "id": own_id, **said, "parameters": parameters}


#: An option in a sentence.
OPTION = re.compile(r"(?<![\w-])--([a-z][a-z0-9-]*[a-z0-9])")


def with_verbs(text: str, command: Command, commands: list[Command]) -> str:
    """A message of one verb: options that only another has are named with it, ``--base (treedgs geotag)``."""
    own = {name for name, _, _ in params_of(command.settings)}
    if all(name.replace("-", "_") in own for name in OPTION.findall(text)):
        return text
    verbs = tuple(f"{each.name} " for each in commands)
    owners = {name: each.name for each in reversed(commands) for name, _, _ in params_of(each.settings)}

    def named(found: re.Match) -> str:
        name = found.group(1).replace("-", "_")
        if name in own or name not in owners or text[: found.start()].endswith(verbs):
            return found.group(0)
        return f"{found.group(0)} (treedgs {owners[name]})"

    return OPTION.sub(named, text)
