"""Collect the texts of the plugin into ``treedgs_qgis/i18n/*.ts`` and compile them: ``make translations``.

Run with the system's Python (PyQGIS). Texts come from ``tr("…")`` in the sources, from the tables of titles and stages,
from ``parameters.json``, from the reasons of ``treedgs_geo/stems/quality/reasons.py``, and from the layers' styles
(their map tips carry the words of every language: ``make styles`` after ``make translations``). Translations that are
there stay; texts that are gone are dropped. ``lrelease`` (Debian: qttools5-dev-tools) compiles the ``.qm`` that are
kept beside them; QGIS 4 reads the same file.
"""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "treedgs_qgis" / "i18n"
LANGUAGES = ("de", "es")
#: Functions that translate, and names whose values (text, or tables and tuples of texts) are shown translated.
CALLS = {"tr", "said"}
SHOWN = {"STAGES", "TITLES", "DECISIONS", "SHOWN", "COMPANIONS", "IN_FOLDERS", "GROUND", "LAYER_NAME", "HELP", "NEED"}


def plugin_texts() -> list[str]:
    """Every text of the plugin's sources and declarations, in order, once each."""
    found: list[str] = []
    places = ((ROOT / "treedgs_qgis", "*.py"), (ROOT / "processing", "*.py"), (ROOT / "tools" / "layer_styles", "*.py"))
    for file in sorted(file for folder, pattern in places for file in folder.rglob(pattern)):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) in CALLS:
                found += [part.value for part in node.args if isinstance(part, ast.Constant)]
            elif isinstance(node, (ast.Assign, ast.AnnAssign)):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                if any(getattr(target, "id", "") in SHOWN for target in targets) and node.value is not None:
                    found += _texts(node.value)
    return list(dict.fromkeys(text for text in found + _declared() + _reasons() + _styles() if text.strip()))


def _texts(node: ast.AST) -> list[str]:
    """Values of a table, texts of a tuple (the last of each pair), or the text itself."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return [node.value]
    if isinstance(node, ast.Dict):
        texts = [text for value in node.values for text in _texts(value)]
        # The keys of COMPANIONS are layer names themselves.
        return texts + ([key.value for key in node.keys] if any(isinstance(v, ast.Tuple) for v in node.values) else [])
    if isinstance(node, ast.Tuple):
        pairs = all(isinstance(part, ast.Constant) for part in node.elts)
        return [node.elts[-1].value] if pairs and node.elts else [t for part in node.elts for t in _texts(part)]
    return []


def _declared() -> list[str]:
    """Titles, groups, summaries, help, labels and results of every verb."""
    sys.path.insert(0, str(ROOT))
    from treedgs_qgis.parameters import label
    from treedgs_qgis.words import declarations

    texts = []
    for entry in declarations().values():
        texts += [entry["title"], entry["group"], entry["summary"], entry["help"]]
        for parameter in entry["parameters"]:
            texts += [label(parameter), parameter["help"]]
        texts += list(entry["outputs"].values())
    return texts


def _reasons() -> list[str]:
    """What each reason means, and what to do."""
    file = ROOT / "treedgs_geo" / "stems" / "quality" / "reasons.py"
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.AnnAssign) and getattr(node.target, "id", "") == "REASONS" and node.value is not None:
            return [text for pair in ast.literal_eval(node.value).values() for text in pair]
    raise RuntimeError(f"{file}: REASONS was not found")


def _styles() -> list[str]:
    """Aliases, legend entries, choices and form groups of the layers' styles."""
    texts = []
    for file in sorted((ROOT / "treedgs_geo" / "core" / "styles").glob("*.qml")):
        top = ET.parse(file).getroot()
        texts += [node.get("name", "") for node in top.findall("./aliases/alias")]
        texts += [node.get("label", "") for kind in ("category", "range") for node in top.iter(kind)]
        texts += [node.get("name", "") for node in top.iter("attributeEditorContainer")]
        for widget in top.iter("editWidget"):
            if widget.get("type") == "ValueMap":
                texts += [node.get("name", "") for node in widget.iter("Option") if node.get("type") == "QString"]
    return texts


def read_ts(file: Path) -> dict[str, str]:
    """Source -> finished translation."""
    if not file.exists():
        return {}
    found = {}
    for message in ET.parse(file).iter("message"):
        translation = message.find("translation")
        if translation is not None and translation.get("type") != "unfinished" and translation.text:
            found[message.findtext("source", "")] = translation.text
    return found


def write_ts(file: Path, language: str, texts: list[str], known: dict[str, str]) -> None:
    """A Qt Linguist file with every text; those without a translation are marked."""
    top = ET.Element("TS", version="2.1", language=language, sourcelanguage="en")
    context = ET.SubElement(top, "context")
    ET.SubElement(context, "name").text = "TreeDGS"
    for text in texts:
        message = ET.SubElement(context, "message")
        ET.SubElement(message, "source").text = text
        translation = ET.SubElement(message, "translation")
        if text in known:
            translation.text = known[text]
        else:
            translation.set("type", "unfinished")
    ET.indent(top)
    body = ET.tostring(top, encoding="unicode")
    file.write_text(f'<?xml version="1.0" encoding="utf-8"?>\n<!DOCTYPE TS>\n{body}\n', encoding="utf-8")


def main() -> int:
    """Write and compile every language; ``--check`` only says whether the files are complete and up to date."""
    check = "--check" in sys.argv
    texts = plugin_texts()
    stale = 0
    for language in LANGUAGES:
        file = FOLDER / f"treedgs_{language}.ts"
        before = file.read_bytes() if file.exists() else b""
        known = read_ts(file)
        if check:
            listed = [m.findtext("source", "") for m in ET.parse(file).iter("message")]
            stale += listed != texts
            continue
        write_ts(file, language, texts, known)
        done = sum(text in known for text in texts)
        news = "" if file.read_bytes() == before else ", written"
        print(f"{file.name}: {done} of {len(texts)} texts translated{news}")
        compiler = shutil.which("lrelease") or shutil.which("lrelease-qt5")
        if compiler is None:
            print("warning: lrelease was not found (apt install qttools5-dev-tools); the .qm stay as they are")
            continue
        subprocess.run([compiler, "-silent", str(file), "-qm", str(file.with_suffix(".qm"))], check=True)
    if stale:
        print("the catalogues are not up to date, run make translations")
    return 1 if stale else 0


if __name__ == "__main__":
    sys.exit(main())
