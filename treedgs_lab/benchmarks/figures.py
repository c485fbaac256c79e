"""Write the figures of README and docs from ``docs/results``: no number on a page is typed.

    python -m treedgs_lab.benchmarks.figures [--check | --release]

A page says where a figure is from, and this puts it there:

- ``<!--= FILE; KEY; FORMAT -->0.48<!--/-->`` in a sentence or a cell. KEY is a path: names, indices, ``column=value``
  (one of several rows) and ``*`` (all), separated by ``/``. FORMAT is Python's, after ``max``, ``min``, ``sum``,
  ``mean``, ``range`` or ``len`` where the key gives several.
- ``<!-- table -->``, a comment with ``from FILE; KEY`` (and ``; LABEL``) and ``TITLE = KEY; FORMAT`` lines, to
  ``<!-- /table -->``: one line for each row that KEY gives (none where a history is empty); ``@`` is its name or label.
- ``<!-- made -->``, ``<!-- FILE ... -->``, to ``<!-- /made -->``: command, date, commit and machine of these files.
- ``<!-- sources -->`` to ``<!-- /sources -->``: the same of every file.

A figure whose code has changed since carries a dagger; how much of the code that its command imports has changed is in
``made`` and ``sources``. ``--check`` writes nothing and fails where a page differs; ``--release`` fails where a quoted
figure is too old, too.
"""

from __future__ import annotations

import argparse
import csv
import math
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import grimp

from treedgs_geo.core.files import read_json
from treedgs_lab.benchmarks.records import RESULTS, ROOT

#: What is known of files that carry no record themselves (CSV, SVG, HTML, TeX), by name.
PUBLISHED = RESULTS / "published.json"
#: A figure is refused by a release when more of the lines that its command imports have changed since.
MAX_CHANGED = 0.33
PACKAGES = ("treedgs_geo", "treedgs_lab")
INLINE = re.compile(r"<!--= ([^;>]+); ([^;>]+); ([^>]+?) -->(.*?)<!--/-->", re.S)
BLOCK = re.compile(r"<!-- (table|made|sources) -->\n(?:<!--(.*?)-->\n)?.*?<!-- /\1 -->", re.S)
DAGGER = "†"
_SINCE = re.compile(r"; code changed since: (?:up to )?\d+ %|(?<=\| )(?:up to )?\d+ %(?= \|$)", re.M)
_SEVERAL: dict[str, Callable[[list], Any]] = {
    "max": max,
    "min": min,
    "sum": sum,
    "len": len,
    "mean": lambda values: sum(values) / len(values),
}


def pages() -> list[Path]:
    """README, the index of experiments and all pages of the docs."""
    return [ROOT / "README.md", Path(__file__).with_name("README.md"), *sorted((ROOT / "docs").rglob("*.md"))]


@cache
def content(name: str) -> Any:
    """A result file: JSON as it is, CSV as a list of rows."""
    if name.endswith(".csv"):
        with open(RESULTS / name, newline="", encoding="utf-8") as stream:
            return [{key: _number(value) for key, value in row.items()} for row in csv.DictReader(stream)]
    return read_json(RESULTS / name)


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text or None


def items(node: Any, key: str, name: str = "") -> Iterator[tuple[str, Any]]:
    """``(name, value)`` of all that a key gives.

    Raises:
        KeyError, IndexError: it gives nothing.
    """
    if not key:
        yield name, node
        return
    names = [one for one in node if key == one or key.startswith(f"{one}/")] if isinstance(node, dict) else []
    first = max(names, key=len, default=key.partition("/")[0])  # a name may hold a slash
    rest = key[len(first) + 1 :]
    if first == "*":
        pairs = node.items() if isinstance(node, dict) else ((str(row), value) for row, value in enumerate(node))
        for own, value in pairs:
            if own != "made_by":
                yield from items(value, rest, own)
    elif "=" in first and isinstance(node, list):
        wanted = [part.split("=", 1) for part in first.split(",")]
        chosen = [row for row in node if all(str(row.get(column)) == value for column, value in wanted)]
        if not chosen:
            raise KeyError(first)
        yield from items(chosen[0], rest, first)
    elif isinstance(node, list):
        yield from items(node[int(first)], rest, first)
    else:
        yield from items(node[first], rest, first)


def figure(node: Any, key: str, form: str) -> str:
    """A value as text; a dash for None, for the last row of a history that has none yet, and, where the form ends in
    a question mark, for what older rows do not have."""
    *several, form = form.split(" ")
    missing = (IndexError, KeyError) if form.endswith("?") else IndexError
    form = form.removesuffix("?")
    try:
        values = [value for _, value in items(node, key) if value is not None]
    except missing:
        return "–"
    if not values:
        return "–"
    if several == ["range"]:
        low, high = _text(min(values), form), _text(max(values), form)
        return low if low == high else f"{low} to {high}"
    value = _SEVERAL[several[0]](values) if several else values[0]
    return _text(len(value) if several == [] and isinstance(value, list) else value, form)


def _text(value: Any, form: str) -> str:
    if form == "s":
        return str(value)
    return format(round(value) if form.endswith("d") else value, form).replace("%", " %")


@cache
def record(name: str) -> dict[str, Any]:
    """``made_by`` of a result file.

    Raises:
        KeyError: it carries none.
    """
    found = read_json(RESULTS / name).get("made_by") if name.endswith(".json") else None
    return found or read_json(PUBLISHED)[name]


@cache
def _graph() -> grimp.ImportGraph:
    graph = grimp.build_graph(*PACKAGES, include_external_packages=False)
    graph.remove_module("treedgs_lab.benchmarks.records")  # no figure comes from what writes the record
    return graph


def today(command: str) -> str:
    """A record's command as one types it now; as it was where its script has left (its commit has it)."""
    words = command.split(" ")
    name = words[2].rpartition(".")[2] if words[:2] == ["python", "-m"] else ""
    for module in (f"treedgs_lab.{words[2]}", f"tools.{name}") if name else ():
        if ROOT.joinpath(*module.split(".")).with_suffix(".py").exists():
            return " ".join([*words[:2], module, *words[3:]])
    return command


def _command(made: dict[str, Any]) -> str:
    """As a page shows it; of a settled question, whose script has left, with the last commit that has the script."""
    left = f" (script: commit {made['script_at']})" if "script_at" in made else ""
    return f"`{today(made['command'])}`{left}"


@cache
def sources(name: str) -> frozenset[str]:
    """Files that a result depends on: what its command imports, by the import graph, and all of the library where that
    runs verbs as processes; where the script has left, all files of the ``rooms`` that its record names."""
    made, graph = record(name), _graph()
    words = today(made["command"]).split()
    module = words[2] if words[:2] == ["python", "-m"] else ""
    used = {module, *graph.find_upstream_modules(module)} if module in graph.modules else set()
    if "rooms" in made:
        rooms = tuple(room.replace("/", ".") for room in made["rooms"])
        used = {name for name in graph.modules if name.startswith(rooms)}
    elif not used or module.endswith(".evidence") or "treedgs_lab.benchmarks.processes" in used:
        used |= {name for name in graph.modules if name.startswith("treedgs_")}
    stems = [ROOT / name.replace(".", "/") for name in used]
    files = [path for stem in stems for path in (stem.with_suffix(".py"), stem / "__init__.py") if path.exists()]
    return frozenset(str(path.relative_to(ROOT)) for path in files)


def _git(*words: str) -> str:
    command = ["git", "-c", f"safe.directory={ROOT}", *words]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout


def _known(commit: str, date: str) -> str:
    """The commit, or where this history does not have it (a branch that was rebased) the last one of that day."""
    try:
        _git("merge-base", "--is-ancestor", commit or "-", "HEAD")
    except subprocess.CalledProcessError:
        return _git("rev-list", "-1", f"--before={date}T23:59:59", "HEAD").strip()
    return commit


@cache
def _changed_lines(commit: str) -> dict[str, float]:
    """Lines changed in each Python file since a commit; a file that was only moved has none."""
    parts = iter(_git("diff", "--numstat", "-z", "-M", commit, "HEAD", "--", "*.py").split("\0"))
    changed = {}
    for part in parts:
        if part:
            added, removed, path = part.split("\t")
            if not path:  # moved: the former and the present name follow
                next(parts)
                path = next(parts)
            changed[path] = (int(added) + int(removed)) / 2
    return changed


@cache
def _lines(path: str) -> int:
    return (ROOT / path).read_text(encoding="utf-8").count("\n")


@cache
def age(name: str) -> float:
    """Share of the lines that a file's command imports which has changed since; 0 where there is no history."""
    made = record(name)
    try:
        changed = _changed_lines(_known(made["commit"].partition("-")[0], made["date"]))
    except (OSError, subprocess.CalledProcessError):
        return 0.0
    used = sources(name)
    return min(sum(changed.get(path, 0.0) for path in used) / max(sum(map(_lines, used)), 1), 1.0)


def _dagger(name: str) -> str:
    return DAGGER if age(name) >= 0.005 else ""


def _share(name: str) -> str:
    """Age in steps of a tenth, so that pages do not change with every commit."""
    return f"up to {10 * math.ceil(10 * age(name))} %"


def _inline(found: re.Match[str]) -> str:
    name, key, form = (" ".join(part.split()) for part in found.groups()[:3])  # an editor may have wrapped the line
    marker = found[0][: found.start(4) - found.start()]
    return f"{marker}{figure(content(name), key, form)}{_dagger(name)}<!--/-->"


def _table(spec: str) -> str:
    """The lines of a table."""
    lines = [line.strip() for line in spec.strip().splitlines()]
    given = [[part.strip() for part in line[5:].split(";")] for line in lines if line.startswith("from ")]
    columns = [[part.strip() for part in line.rsplit(" = ", 1)] for line in lines if not line.startswith("from ")]
    names = {name for name, *_ in given}
    head = " | ".join(title for title, _ in columns) + "".join({_dagger(name) for name in sorted(names)})
    rows = []
    for name, key, *label in given:
        try:
            found = list(items(content(name), key))
        except IndexError:
            found = []
        for own, row in found:
            cells = [
                (label[0] if label else own)
                if spec == "@"
                else figure(row, *(part.strip() for part in spec.split(";")))
                for _, spec in columns
            ]
            rows.append(f"| {' | '.join(cells)} |")
    return "\n".join([f"| {head} |", "|---" * len(columns) + "|", *rows])


def _made(names: str) -> str:
    lines = []
    for name in names.split():
        made = record(name)
        machine = made.get("machine") or {}
        where = f"; {machine['cores']} cores of {machine['processor']}" if machine else ""
        old = f"; code changed since: {_share(name)}" if _dagger(name) else ""
        lines.append(
            f"- `docs/results/{name}`: {_command(made)}; {made['date']}, commit {made['commit']}, "
            f"version {made['version']}{where}{old}"
        )
    return "\n".join(lines)


def _sources() -> str:
    rows = ["| file | command | date | commit | code changed since |", "|---|---|---|---|---|"]
    for path in sorted(RESULTS.iterdir()):
        if path != PUBLISHED:
            made = record(path.name)
            rows.append(
                f"| `{path.name}` | {_command(made)} | {made['date']} | {made['commit']} | {_share(path.name)} |"
            )
    return "\n".join(rows)


def _block(found: re.Match[str]) -> str:
    kind, spec = found.groups()
    body = {"table": _table, "made": _made, "sources": lambda _: _sources()}[kind](spec)
    given = "" if spec is None else f"<!--{spec}-->\n"
    return f"<!-- {kind} -->\n{given}\n{body}\n\n<!-- /{kind} -->"


def filled(text: str) -> str:
    """A page with its figures; in a row of a table one dagger says it for all."""
    lines = INLINE.sub(_inline, BLOCK.sub(_block, text)).split("\n")
    return "\n".join(
        line.replace(DAGGER, "", line.count(DAGGER) - 1) if line.startswith("|") and DAGGER in line else line
        for line in lines
    )


def without_age(text: str) -> str:
    """A page without its marks of age, which change with every commit."""
    return _SINCE.sub("", text.replace(DAGGER, ""))


def quoted() -> set[str]:
    """Names of all result files that pages take figures from."""
    names = set()
    for page in pages():
        text = page.read_text(encoding="utf-8")
        names |= {found[1].strip() for found in INLINE.finditer(text)}
        for kind, spec in (found.groups() for found in BLOCK.finditer(text)):
            names |= set(re.findall(r"[\w.-]+\.(?:json|csv)", spec)) if kind == "table" else set()
    return names


def too_old() -> list[str]:
    """What a release refuses: quoted figures of whose code too much has changed."""
    return [
        f"{name}: {100 * age(name):.0f} % of its code changed"
        for name in sorted(quoted())
        if age(name) > MAX_CHANGED and "script_at" not in record(name)
    ]


def main() -> int:
    """Write the pages, or check them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="write nothing; fail where a page differs")
    parser.add_argument("--release", action="store_true", help="fail where a quoted figure is too old, too")
    options = parser.parse_args()
    faults = too_old() if options.release else []
    for page in pages():
        text = page.read_text(encoding="utf-8")
        new = filled(text)
        if new != text and not options.check:
            page.write_text(new, encoding="utf-8")
        elif without_age(new) != without_age(text):
            faults.append(f"{page.relative_to(ROOT)}: figures differ from their files, run: make figures")
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
