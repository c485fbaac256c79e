"""The docs cannot rot: paths, links, names, options and words on the pages and in the code that points to them."""

from __future__ import annotations

import ast
import importlib
import json
import re
import subprocess
from pathlib import Path

import pytest

from treedgs_geo.core.errors import MissingComponentError
from treedgs_geo.core.settings import params_of
from treedgs_geo.verbs import all_commands
from treedgs_lab.benchmarks import figures

ROOT = Path(__file__).parents[2]
TRACKED = [
    name
    for name in subprocess.run(
        ["git", "-c", f"safe.directory={ROOT}", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    if (ROOT / name).is_file()
]
PAGES = sorted(name for name in TRACKED if name.startswith("docs/") and name.endswith(".md"))
KINDS = ("How-to", "Reference", "Explanation", "Evidence")
#: Words that are not used: docs/terms.md has the ones that are.
UNUSED = re.compile(
    r"\b(told|foretold|foretells?|mended|mends|bought|buys|rungs?|doubt(s|ed|ful)?|asked again|second opinions?)\b",
    re.I,
)


def text_of(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def outside_code(text: str) -> str:
    """The page without code blocks, code spans and the parts that benchmarks write."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
    text = (
        figures.INLINE.sub("", figures.BLOCK.sub("", text))
        .replace("<!-- figures -->", "")
        .replace("<!-- /figures -->", "")
    )
    text = re.sub(r"^<!-- (\S+) -->.*?^<!-- /\1 -->", "", text, flags=re.S | re.M)
    text = re.sub(r"(?<=\n\n)(?:    .*\n)+", "", text)
    return re.sub(r"`[^`]*`", "", text)


def test_pages_named_in_code_and_help_exist():
    missing = []
    for name in TRACKED:
        if Path(name).suffix in {".png", ".svg", ".qm", ".jpg", ".csv"} or name.startswith("docs/results/"):
            continue
        for page in re.findall(r"\bdocs/[\w./-]+?\.(?:md|rst)\b", text_of(name)):
            if not (ROOT / page).is_file():
                missing.append(f"{name}: {page}")
    assert missing == []


@pytest.mark.parametrize("name", [*PAGES, "README.md", "CONTRIBUTING.md"])
def test_links_lead_somewhere(name):
    text = text_of(name)
    targets = [link.split("#")[0] for link in re.findall(r"\]\(([^)\s]+)\)", text) if "://" not in link]
    targets = [target for target in targets if target]
    folder = (ROOT / name).parent
    assert [target for target in targets if not (folder / target).is_file()] == []
    # Anchors are checked by make docs.
    results = re.findall(r"`(docs/results/[\w.-]+\.\w+)`", text)
    assert [result for result in results if not (ROOT / result).is_file()] == []


def test_every_page_says_what_kind_it_is():
    plain = {"docs/index.md", "docs/technician/index.md", "docs/analyst/index.md", "docs/developer/index.md"}
    notebook = "---\nfile_format: mystnb\n---\n"
    kinds = {name: text_of(name).removeprefix(notebook).split("\n")[2] for name in PAGES if name not in plain}
    assert [name for name, line in kinds.items() if not line.startswith(tuple(f"*{kind}" for kind in KINDS))] == []


def test_prose_is_wrapped():
    long = []
    for name in [*PAGES, "README.md", "CONTRIBUTING.md"]:
        text = figures.without_age(figures.INLINE.sub(lambda found: found[4], figures.BLOCK.sub("", text_of(name))))
        text = re.sub(r"^<!-- (\S+) -->.*?^<!-- /\1 -->", "", text, flags=re.S | re.M)
        text = re.sub(r"^```.*?^```", "", text, flags=re.S | re.M)
        for line in text.split("\n"):
            if len(line) > 120 and not line.startswith(("|", "    ")):
                long.append(f"{name}: {line[:60]}")
    assert long == []


def test_words_of_the_terms_page_are_used():
    found = []
    for name in [*PAGES, "README.md", "CONTRIBUTING.md"]:
        if name != "docs/terms.md":
            found += [f"{name}: {match.group()}" for match in UNUSED.finditer(outside_code(text_of(name)))]
    assert found == []


#: Second-column words of the terms page that are right for something else: an image file, a project's CRS, a step of a
#: grid, the slope of the ground.
OTHER_MEANING = {
    "bad", "batch", "bh", "confidence", "diameter", "floor", "good", "gps", "guess", "image", "match", "mission", "not",
    "pose", "profile", "project", "result", "scene", "site", "splat", "step", "threshold", "tolerance", "unseen",
}  # fmt: skip
#: ``word: identifier …``: those that still have a word of the terms page's second column. It shrinks; none enters.
STILL_IN_CODE = Path(__file__).with_name("words_in_code.txt")


def identifiers() -> set[str]:
    """Names of the library's classes, functions, arguments, fields and constants."""
    found = set()
    for name in TRACKED:
        if name.startswith(("treedgs_geo/", "treedgs_lab/")) and name.endswith(".py"):
            tree = ast.parse(text_of(name))
            for node in ast.walk(tree):
                if isinstance(node, ast.FunctionDef | ast.ClassDef):
                    found.add(node.name)
                if isinstance(node, ast.FunctionDef):
                    found |= {one.arg for one in [*node.args.args, *node.args.kwonlyargs]}
                if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                    found.add(node.target.id)
            for node in tree.body:
                for target in node.targets if isinstance(node, ast.Assign) else ():
                    found |= {one.id for one in ast.walk(target) if isinstance(one, ast.Name)}
    return found


def words_not_used() -> set[str]:
    """The words of the terms page's last column."""
    rows = re.findall(r"^\| (?:.+?) \| (?:.+?) \| (.+?) \|$", text_of("docs/terms.md"), re.M)
    words = {word.strip().lower() for row in rows for word in re.split(r"[,;]", re.sub(r"\(.*?\)", "", row))}
    return {word for word in words if re.fullmatch(r"[a-z ]+", word)} - OTHER_MEANING


def spoken(identifier: str) -> str:
    parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", identifier.replace("_", " "))
    return f" {' '.join(parts).lower()} "


def test_identifiers_use_the_words_of_the_terms_page():
    lines = STILL_IN_CODE.read_text(encoding="utf-8").splitlines()
    kept = {word: set(names.split()) for word, names in (line.split(": ", 1) for line in lines)}
    banned = words_not_used()
    assert len(banned) > 25 and set(kept) <= banned
    found = {word: {name for name in identifiers() if f" {word} " in spoken(name)} for word in banned}
    assert {word: names - kept.get(word, set()) for word, names in found.items() if names - kept.get(word, set())} == {}
    assert [word for word in kept if not found[word]] == [], "renamed: take the line out"


def test_code_named_on_pages_exists():
    files = {Path(name).name for name in TRACKED}
    missing = []
    for name in [*PAGES, "README.md", "CONTRIBUTING.md"]:
        for path in re.findall(r"`(?:python )?([\w./]+\.(?:py|qml|csv|sh))`", text_of(name)):
            known = (
                path in TRACKED or any(end.endswith("/" + path) for end in TRACKED) if "/" in path else path in files
            )
            if not known and path != "json.py" and not (path.endswith(".csv") and "/" not in path):
                missing.append(f"{name}: {path}")
    assert missing == []


def test_dotted_names_on_pages_can_be_imported():
    missing = []
    for name in PAGES:
        for dotted in set(re.findall(r"`(treedgs_(?:geo|lab)(?:\.\w+)+)", text_of(name))):
            parts, found = dotted.split("."), None
            for cut in range(len(parts), 0, -1):
                try:
                    found = importlib.import_module(".".join(parts[:cut]))
                except ModuleNotFoundError:
                    continue
                except MissingComponentError:  # torch, which not every system has
                    found = dotted
                    break
                for part in parts[cut:]:
                    found = getattr(found, part, None)
                break
            if found is None:
                missing.append(f"{name}: {dotted}")
    assert missing == []


def test_options_on_pages_exist():
    known = {f"--{name.replace('_', '-')}" for verb in all_commands() for name, _, _ in params_of(verb.settings)}
    for name in TRACKED:
        if name.startswith(
            ("treedgs_lab/benchmarks/", "tools/", "treedgs_lab/training/", "treedgs_geo/cli")
        ) and name.endswith(".py"):
            known |= set(re.findall(r"[\"'](--[a-z][\w-]*)", text_of(name)))
    # Of other programs, and of every verb.
    known |= {
        "--help",
        "--require-hashes",
        "--no-build-isolation",
        "--job",
        "--noversioncheck",
        "--file",
        "--rm",
        "--from",
    }
    unknown = []
    for name in [*PAGES, "README.md"]:
        text = figures.BLOCK.sub("", text_of(name))  # commands as they were typed at their commit
        text = re.sub(r"^.*sbatch .*$", "", text, flags=re.M)
        for option in set(re.findall(r"(?<![\w-])(--[a-z][a-z0-9-]+)", text)):
            if option not in known:
                unknown.append(f"{name}: {option}")
    assert unknown == []


def test_verbs_on_pages_exist():
    verbs = {entry["name"] for entry in json.loads(text_of("treedgs_qgis/parameters.json"))["commands"]}
    verbs |= {"describe", "completion", "--help"}
    for name in [*PAGES, "README.md"]:
        used = set(re.findall(r"(?:^    |`|bin/)treedgs ([a-z-]{3,})", text_of(name), re.M))
        assert used <= verbs, f"{name}: {used - verbs}"


def test_every_room_has_its_page_in_the_api_reference():
    rooms = {path.name for path in (ROOT / "treedgs_geo").iterdir() if (path / "__init__.py").is_file()} - {"stems"}
    rooms |= {f"stems.{path.parent.name}" for path in (ROOT / "treedgs_geo" / "stems").glob("*/__init__.py")}
    rooms |= {f"lab.{path.parent.name}" for path in (ROOT / "treedgs_lab").glob("*/__init__.py")}
    rooms -= {"lab.verbs", "lab.benchmarks", "lab.training"}  # commands, not an interface
    pages = {name.split("/")[-1].removesuffix(".rst") for name in TRACKED if name.startswith("docs/api/")}
    assert rooms <= pages, rooms - pages
    index = text_of("docs/api/index.rst").split()
    assert [page for page in pages - {"index"} if page not in index] == []


def test_rooms_are_listed_in_the_order_of_the_contract():
    contract = re.search(r"containers = treedgs_geo\n.*?layers =\n(.*?)\n\n", text_of(".importlinter"), re.S)
    assert contract
    order = [re.split(r"[^\w]+", line.strip()) for line in contract.group(1).splitlines()]
    table = re.search(
        r"\| room \| what it does \|\n\|---\|---\|\n(.*?)\n\n", text_of("docs/developer/developing.md"), re.S
    )
    assert table
    rows = [re.findall(r"`(\w+)`", row.split("|")[1]) for row in table.group(1).splitlines()]
    assert [sorted(row) for row in rows] == [sorted(row) for row in order]
