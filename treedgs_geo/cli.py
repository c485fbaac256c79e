"""The ``treedgs`` command: every verb of :mod:`treedgs_geo.verbs`, with the options its settings declare."""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import sys
import traceback
import warnings
from collections.abc import Collection
from dataclasses import MISSING
from pathlib import Path
from typing import Any, NoReturn

from . import __version__
from .core.command import Command, describe, ordered_params, with_verbs
from .core.errors import Cancelled, Incomplete, InputError, OutputError, TreeDGSError
from .core.extras import lacks
from .core.files import no_empty_folders
from .core.machine import ensure_code_cache
from .core.outputs import checked_paths
from .core.progress import PROTOCOL, Reporter, make_reporter
from .core.resource_errors import shortage_of
from .core.settings import Param, build, nearest, params_of
from .core.startup import (
    explained,
    keep_streams,
    own_libraries_first,
    own_signals,
    plain_names,
    safe_environment,
)


def main(arguments: list[str] | None = None) -> int:
    """Entry point; returns the exit code (0 done, 2 input, 3 missing component, 4 memory, 5 a part is missing,
    130 cancelled, 1 defect)."""
    from .verbs import MODULES, all_commands, get_command

    # Numba warns every user of a threading library that it does not use.
    warnings.filterwarnings("ignore", message="The TBB threading layer")
    if arguments is None:
        keep_streams()
        own_libraries_first()
    safe_environment()
    ensure_code_cache()
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments[:1] == ["--job"]:
        return _run_job(arguments)
    if arguments[:1] == ["describe"]:
        print(json.dumps({"protocol": PROTOCOL, "commands": [describe(c) for c in all_commands()]}, indent=1))
        return 0
    if arguments[:1] == ["completion"]:
        return _completion(arguments[1:])
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_overview(all_commands()))
        return 0
    if arguments[0] in ("-V", "--version"):
        print(f"treedgs {__version__}")
        return 0
    if arguments[0] not in MODULES:
        hint = nearest(arguments[0], MODULES, "run 'treedgs --help' for the list.")
        print(f"error: {arguments[0]!r} is not a treedgs command; {hint}", file=sys.stderr)
        return 2
    command = get_command(arguments[0])
    if "--example" in arguments:
        print(command.example)
        return 0
    parsed, extra = _parser(command).parse_known_args(arguments[1:])
    known = vars(parsed)
    style, overwrite = known.pop("log_format"), known.pop("overwrite")
    values = {name: value for name, value in known.items() if value is not None}
    # Unknown options go to the settings, which refuse them and name the nearest known one.
    values.update({word.lstrip("-").split("=")[0].replace("-", "_"): True for word in extra if word.startswith("-")})
    if extra and not any(word.startswith("-") for word in extra):
        print(f"error: {extra[0]!r} is not an option; options start with --, see --help.", file=sys.stderr)
        return 2
    reporter = make_reporter(style)
    reporter.words = lambda text: with_verbs(text, command, all_commands())
    return run_command(command, values, reporter, style != "json", overwrite)


def run_command(
    command: Command,
    values: dict[str, Any],
    reporter: Reporter,
    show_result: bool = False,
    overwrite: bool | Collection[str] = False,
    outcome: dict[str, Any] | None = None,
) -> int:
    """Run one verb with raw values, report its result or the one sentence that says what is wrong.

    overwrite: see :func:`~treedgs_geo.core.outputs.checked_paths`. outcome: gets ``result``, where there is one.
    """
    from .verbs.doctor import NEEDS

    def stop(*_: object) -> None:
        # Once is enough: a second signal must not break the cleaning up that the first one started.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        raise Cancelled("cancelled by the user")

    own_signals(NEEDS.get(command.name, ()))
    plain_names()
    previous = signal.signal(signal.SIGINT, stop), signal.signal(signal.SIGTERM, stop)
    try:
        settings = build(command.settings, values)
        named = [name for name, spec, _ in params_of(command.settings) if spec.kind.startswith("output_")]
        for name, spec, _ in params_of(command.settings):
            if spec.code and getattr(settings, name) is not None:
                reporter.warn(f"--{name.replace('_', '-')}: runs the code of {getattr(settings, name)}.")
        targets = filter(None, (getattr(settings, name) for name in named))
        with checked_paths(settings, overwrite), no_empty_folders(targets):
            result = command.run(settings, reporter)
        _report_result(result, reporter, show_result, outcome)
        return 0
    except Incomplete as problem:
        _report_result(problem.result, reporter, show_result, outcome)
        reporter.error(str(problem))
        return problem.exit_code
    except Cancelled as problem:
        reporter.error(f"Stopped: {problem}; what was finished is kept, run again to resume.")
        return problem.exit_code
    except TreeDGSError as problem:
        reporter.error(explained(str(problem)))
        return problem.exit_code
    except ModuleNotFoundError as problem:
        reporter.error(lacks(problem.name, command.name))
        return 3
    except Exception as problem:
        if (shortage := shortage_of(problem)) is not None:
            reporter.error(str(shortage))
            return shortage.exit_code
        traceback.print_exc(file=sys.stderr)
        reporter.error(f"{type(problem).__name__}: {problem} (a defect in TreeDGS; please report it with the log).")
        return 1
    finally:
        reporter.close()
        signal.signal(signal.SIGINT, previous[0])
        signal.signal(signal.SIGTERM, previous[1])


def _report_result(result: dict[str, Any], reporter: Reporter, show: bool, outcome: dict[str, Any] | None) -> None:
    if outcome is not None:
        outcome["result"] = result
    reporter.progress(1.0)
    reporter.result(result)
    reporter.close()
    if show:
        for name, value in result.items():
            if isinstance(value, (str, int, float)) and not isinstance(value, bool):
                print(f"{name}: {value}")


def _run_job(arguments: list[str]) -> int:
    """``--job job.json``: what the QGIS plugin calls. JSON lines on stdout, ``result.json`` beside the job."""
    from .core.files import read_json, write_json
    from .verbs import MODULES, get_command

    reporter = make_reporter("json")
    # Native libraries print to stdout too: keep the protocol's stream to ourselves, send the rest to stderr.
    protocol = os.fdopen(os.dup(1), "w", encoding="utf-8", buffering=1)
    os.dup2(2, 1)
    reporter._stream = protocol  # type: ignore[attr-defined]
    try:
        if len(arguments) != 2:
            raise InputError("--job: expected exactly one job file.")
        job_file = Path(arguments[1])
        job = read_json(job_file)
        if job.get("protocol") != PROTOCOL:
            raise InputError(
                f"{job_file}: protocol {job.get('protocol')}, this engine speaks {PROTOCOL}; "
                "update the engine with treedgs:setupengine."
            )
        if job.get("command") not in MODULES:
            raise InputError(f"{job_file}: unknown command {job.get('command')!r}.")
        command = get_command(job["command"])
    except TreeDGSError as problem:
        reporter.error(str(problem))
        return problem.exit_code
    outcome: dict[str, Any] = {}
    given, overwrite = job.get("parameters", {}), job.get("overwrite", ())
    code = run_command(command, given, reporter, overwrite=overwrite, outcome=outcome)
    try:
        write_json(job_file.parent / "result.json", {"exit_code": code, **outcome})
    except OSError as problem:
        reporter.error(
            str(
                shortage_of(problem)
                or f"{job_file.parent}: result.json cannot be written ({problem}); "
                "free some space or choose another folder for temporary files."
            )
        )
        return code or OutputError.exit_code
    return code


def _overview(commands: list[Command]) -> str:
    lines = [
        f"treedgs {__version__}: tree diameters from drone photos or LiDAR clouds",
        "",
        "usage: treedgs COMMAND [options]      (treedgs COMMAND --help for units, defaults and an example)",
        "",
    ]
    for group in dict.fromkeys(command.group for command in commands):
        lines.append(f"{group}:")
        lines += [f"  {c.name:<18} {c.summary}" for c in commands if c.group == group]
        lines.append("")
    lines += [
        "Every command takes --example, --json, --log-format auto|bar|plain|json|quiet and --overwrite. Examples work",
        "on the sample that 'treedgs simulate-plot --example' makes. treedgs completion bash|zsh|fish prints what",
        "completes these words in a shell.",
    ]
    return "\n".join(lines)


class _Parser(argparse.ArgumentParser):
    """argparse that says what is wrong in one sentence, and takes ``-33.6,150.2`` for a value."""

    def __init__(self, **more: Any) -> None:
        super().__init__(**more)
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"error: {message}; see {self.prog} --help.\n")


def _parser(command: Command) -> argparse.ArgumentParser:
    keys = "".join(
        f"keys of --{name}, separated by commas:\n" + "".join(f"  {key}={line}\n" for key, line in _keys(spec)) + "\n"
        for name, spec, _ in ordered_params(command)
        if spec.record
    )
    parser = _Parser(
        prog=f"treedgs {command.name}",
        description=f"{command.summary}\n\n{command.help}",
        epilog=f"{keys}example:\n  {command.example}\n(with the sample of 'treedgs simulate-plot --example')",
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    _add_options(parser, command)
    return parser


def _completion(shells: list[str]) -> int:
    """Print what completes verbs, options and choices in a shell, from the same declaration as everything else."""
    from .verbs import all_commands

    try:
        import shtab
    except ModuleNotFoundError:
        print("error: completion needs shtab; pip install 'treedgs-geo[completion]'.", file=sys.stderr)
        return 3
    if len(shells) != 1 or shells[0] not in shtab.SUPPORTED_SHELLS:
        said = ", ".join(shtab.SUPPORTED_SHELLS)
        print(f"error: completion: {' '.join(shells) or 'no shell'} given, expected one of {said}.", file=sys.stderr)
        return 2
    whole = argparse.ArgumentParser(prog="treedgs")
    verbs = whole.add_subparsers()
    for command in all_commands():
        options = _add_options(verbs.add_parser(command.name, help=command.summary.replace("%", "%%")), command)
        for name, spec, _ in params_of(command.settings):
            if spec.kind == "choice":
                options[name].choices = spec.choices
            elif "file" in spec.kind or "folder" in spec.kind:
                options[name].complete = shtab.DIRECTORY if "folder" in spec.kind else shtab.FILE  # type: ignore[attr-defined]
    print(shtab.complete(whole, shells[0]))
    return 0


def _add_options(parser: argparse.ArgumentParser, command: Command) -> dict[str, argparse.Action]:
    options = {}
    for name, spec, default in ordered_params(command):
        more: dict[str, Any] = {"flag": {"nargs": "?", "const": "true"}, "record": {"action": "append"}}.get(
            spec.kind, {}
        )
        options[name] = parser.add_argument(
            f"--{name.replace('_', '-')}",
            dest=name,
            metavar=_metavar(spec),
            help=_help_line(spec, default).replace("%", "%%"),
            **more,
        )
    parser.add_argument(
        "--log-format",
        default="auto",
        choices=["auto", "bar", "plain", "json", "quiet"],
        help="progress as a bar, plain lines, JSON lines (as --json) or nothing (default: auto)",
    )
    parser.add_argument(
        "--json",
        dest="log_format",
        action="store_const",
        const="json",
        help="progress, warnings and the result as JSON lines on stdout",
    )
    parser.add_argument(
        "--example", action="store_true", default=argparse.SUPPRESS, help="print a command that works on the sample"
    )
    parser.add_argument(
        "--overwrite", action="store_true", help="replace files of the outputs' names that TreeDGS did not write"
    )
    return options


def _metavar(spec: Param) -> str:
    if spec.kind == "choice":
        return "|".join(spec.choices)
    return {
        "file": "FILE",
        "folder": "DIR",
        "files": "FILE|DIR",
        "output_file": "FILE",
        "output_folder": "DIR",
        "crs": "EPSG:CODE",
        "integer": "N",
        "number": "X",
        "flag": "true|false",
        "text": "TEXT",
        "record": "KEY=VALUE,...",
    }[spec.kind]


def _keys(spec: Param) -> list[tuple[str, str]]:
    """Each key of an option of kind ``record``, and what it takes and means."""
    found = []
    for name, each, default in params_of(spec.record) if spec.record else []:
        limits = "" if each.minimum is None else f" {each.minimum:g} to {each.maximum:g}"
        found.append((name, f"{_metavar(each)}{limits}: {_help_line(each, default)}"))
    return found


def _help_line(spec: Param, default: Any) -> str:
    unit = f" [{spec.unit}]" if spec.unit else ""
    if default is MISSING:
        tail = " (required)"
    elif default is None:
        tail = " (optional)"
    else:
        tail = f" (default: {default})"
    return f"{spec.help}{unit}{tail}"
