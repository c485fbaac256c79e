"""Settings declared once, used by the library, the command line and QGIS alike.

A settings class is a frozen, keyword-only dataclass whose fields are made with :func:`param`. From it come the
``argparse`` options (:mod:`treedgs_geo.cli`), the JSON description that the QGIS plugin reads
(``treedgs describe``) and the parameter tables in ``docs/``. Standard library only: reading settings is instant.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Iterable
from dataclasses import MISSING, dataclass, field
from pathlib import Path
from typing import Any

from .errors import InputError

#: What a value is; decides the argparse type and the QGIS widget.
KINDS = (
    "file", "folder", "files", "output_file", "output_folder", "crs", "choice", "integer", "number", "flag", "text",
    "record",
)  # fmt: skip
#: Type of a field -> kind.
_KIND_OF = {"int": "integer", "float": "number", "bool": "flag", "str": "text", "Path": "file"}
#: What a flag may be written as.
_FLAGS = {**dict.fromkeys(("1", "true", "yes", "on"), True), **dict.fromkeys(("0", "false", "no", "off"), False)}

#: Endings of tables that :func:`.tables.read_table` reads.
TABLES = ("csv", "xlsx", "ods", "txt", "tsv")
#: Endings of tree layers, read and written, and of files that hold plots.
TREE_LAYERS = ("gpkg", "shp", "geojson", "csv")
PLOT_FILES = (*TABLES, "gpkg", "geojson", "shp")
#: Endings of clouds that are written.
CLOUD_OUTPUTS = ("laz", "las", "ply")


@dataclass(frozen=True)
class Param:
    """Everything that one parameter needs besides name and default.

    kind: one of :data:`KINDS` (``files`` = a folder or a file); of numbers, flags, choices, texts and input files the
    field's type says it. unit: shown in help, part of the name where one exists. suffixes: expected file endings, for
    file dialogs; outputs have to have one. minimum/maximum: inclusive limits, checked in every face. dialog: shown in
    QGIS at all; else of the command line, job files and the library only. holds: of an output folder, the files that
    may be written into it; with none the whole folder is made anew. known_by: the file by which such a folder is known
    as ours. code: what the value names is run, so that no table may give it. record: of kind ``record``, the settings
    class whose fields are given together, as ``KEY=VALUE,KEY=VALUE``; a key alone is a flag that is on.
    """

    kind: str
    help: str
    unit: str = ""
    choices: tuple[str, ...] = ()
    minimum: float | None = None
    maximum: float | None = None
    suffixes: tuple[str, ...] = ()
    dialog: bool = True
    holds: tuple[str, ...] = ()
    known_by: str = ""
    code: bool = False
    record: type | None = None


def param(default: Any = MISSING, *, help: str, kind: str = "", **more: Any) -> Any:
    """A dataclass field with a :class:`Param`. No default = required; ``None`` = optional."""
    if kind and kind not in KINDS:
        raise ValueError(f"unknown parameter kind {kind!r}")
    return field(default=default, metadata={"param": Param(kind=kind, help=help, **more)})


def params_of(settings_class: type) -> list[tuple[str, Param, Any]]:
    """``(name, Param, default)`` per field; default is ``dataclasses.MISSING`` where the value is required."""
    found = []
    for item in dataclasses.fields(settings_class):
        if "param" in item.metadata:
            spec = item.metadata["param"]
            kind = spec.kind or ("choice" if spec.choices else _KIND_OF[str(item.type).removesuffix(" | None")])
            found.append((item.name, dataclasses.replace(spec, kind=kind), item.default))
    return found


def parse_value(name: str, spec: Param, value: Any, of: str = "") -> Any:
    """Turn text (or an already typed value) into the field's type and check its limits. of: the option that the field
    is a key of.

    Raises:
        InputError: naming the parameter, the value found and what was expected.
    """
    if value is None:
        return None
    option = f"{of}: {name}" if of else f"--{name.replace('_', '-')}"
    if spec.record:
        return _parse_record(option, spec.record, value)
    if spec.kind in ("file", "folder", "files", "output_file", "output_folder"):
        if not isinstance(value, (str, Path)) or "\0" in str(value):
            found = repr(value) if isinstance(value, str) else f"a {type(value).__name__}"
            raise InputError(f"{option}: found {found}, expected a path.")
        if str(value) == "":
            return None
        # os.path.expanduser leaves an unknown ~user as it is; Path.expanduser raises.
        return Path(os.path.expanduser(value))
    if spec.kind in ("text", "crs"):
        return str(value)
    if spec.kind == "flag":
        if (said := str(value).lower()) not in _FLAGS:
            raise InputError(f"{option}: found {value!r}, expected true or false.")
        return _FLAGS[said]
    if spec.kind == "choice":
        if str(value) not in spec.choices:
            raise InputError(f"{option}: found {value!r}, expected one of {', '.join(spec.choices)}.")
        return str(value)
    whole = spec.kind == "integer"
    try:
        if isinstance(value, bool) or whole and isinstance(value, float) and value != int(value):
            raise ValueError
        number: float = int(value) if whole else float(value)
    except (TypeError, ValueError, OverflowError):
        wanted = "a whole number" if whole else "a number"
        raise InputError(
            f"{option}: found {value!r}, expected {wanted}{f' in {spec.unit}' if spec.unit else ''}."
        ) from None
    if number != number or abs(number) == math.inf:
        raise InputError(f"{option}: found {value!r}, expected a finite number.")
    low = -math.inf if spec.minimum is None else spec.minimum
    high = math.inf if spec.maximum is None else spec.maximum
    if not low <= number <= high:
        unit = f" {spec.unit}" if spec.unit else ""
        raise InputError(f"{option}: found {number:g}, expected {low:g} to {high:g}{unit}.")
    return number


def _parse_record(option: str, record: type, value: Any) -> Any:
    """A settings object of ``KEY=VALUE,KEY=VALUE``, several such texts, or values by key."""
    if isinstance(value, record):
        return value
    pairs: dict[str, Any] = dict(value) if isinstance(value, dict) else {}
    text = "" if isinstance(value, dict) else ",".join(value) if isinstance(value, list) else str(value)
    for word in filter(None, map(str.strip, text.split(","))):
        name, given, said = word.partition("=")
        if name in pairs:
            raise InputError(f"{option}: found {name} twice; give each key once.")
        pairs[name] = said if given else "true"
    return build(record, pairs, option)


def nearest(name: str, known: Iterable[str], otherwise: str = "") -> str:
    """``did you mean 'plots'?``: the nearest known name, else what is known, or ``otherwise``."""
    import difflib

    near = difflib.get_close_matches(name, known, n=1)
    return f"did you mean {near[0]!r}?" if near else otherwise or f"known: {', '.join(known)}."


def build(settings_class: type, values: dict[str, Any], of: str = "") -> Any:
    """Make a settings object from raw values (text or typed); unknown and missing names are refused. of: the option
    that the values are keys of.

    Raises:
        InputError: unknown parameter (with the nearest known one), missing required one, or a bad value.
    """
    specs = {name: (spec, default) for name, spec, default in params_of(settings_class)}
    for name in values:
        if name not in specs and of:
            raise InputError(f"{of}: found {name!r}, expected one of {', '.join(specs)}.")
        if name not in specs:
            raise InputError(f"Parameter {name!r} is unknown; {nearest(name, specs)}")
    chosen = {}
    for name, (spec, default) in specs.items():
        value = parse_value(name, spec, values[name], of) if name in values else None
        if value is None and default is MISSING:
            raise InputError(f"--{name.replace('_', '-')} is required: {spec.help}")
        chosen[name] = default if value is None else value
    return settings_class(**chosen)


def to_json(settings: Any) -> dict[str, Any]:
    """Settings as plain JSON values (paths as text), for ``run.json``."""
    return {
        item.name: str(value) if isinstance(value := getattr(settings, item.name), Path) else value
        for item in dataclasses.fields(settings)
    }
