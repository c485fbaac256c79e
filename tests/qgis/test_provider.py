"""The plugin in real QGIS: what is registered, and that QGIS keeps everything of its own."""

from __future__ import annotations

import configparser
import json
import subprocess
import sys

import pytest
from qgis_driver import ROOT, load

from treedgs_geo.commands import MODULES
from treedgs_geo.measure.trees import TREE_FIELDS

DECLARED = {
    entry["id"]: entry for entry in json.loads((ROOT / "treedgs_qgis" / "parameters.json").read_text())["commands"]
}
FROZEN = {
    "photostodbh",
    "pointcloudtodbh",
    "campaign",
    "geotag",
    "reconstruct",
    "terrain",
    "fitgaussians",
    "samplesurface",
    "segmentstems",
    "measuredbh",
    "matchplots",
    "evaluate",
    "standtable",
    "benchmark",
    "simulateplot",
    "checkengine",
    "setupengine",
}
#: Ready-made models.
MODELS = {"photostostandtable", "cloudtostandtable", "photostoaccuracy"}


def ids(listing: str) -> set[str]:
    return {line.split("\t")[1] for line in listing.splitlines() if line.startswith("\t")}


def test_processing_is_no_regular_package():
    """With ``processing/__init__.py`` QGIS would lose its own package of that name, and all its algorithms."""
    assert not (ROOT / "processing" / "__init__.py").exists()


def test_all_algorithms_are_listed_and_qgis_keeps_its_own(qgis, tmp_path):
    mine = ids(qgis("list").stdout)
    without = ids(qgis("list", QGIS_CUSTOM_CONFIG_PATH=tmp_path / "bare", QGIS_PLUGINPATH=tmp_path).stdout)
    ours = {f"treedgs:{name}" for name in FROZEN | MODELS}
    assert {name for name in mine if name.startswith("treedgs:")} == ours
    assert mine - without == ours and without <= mine
    assert any(name.startswith("gdal:") for name in mine) and any(name.startswith("qgis:") for name in mine)


def test_algorithms_are_listed_without_an_engine(qgis):
    assert "treedgs:photostodbh" in qgis("list", TREEDGS_PYTHON="/nonexistent").stdout


def test_every_verb_has_its_algorithm_and_its_file():
    assert set(DECLARED) | {"setupengine"} == FROZEN
    assert {entry["name"] for entry in DECLARED.values()} == set(MODULES)
    assert {path.stem for path in (ROOT / "processing").glob("*.py")} == FROZEN


def test_declarations_are_up_to_date():
    done = subprocess.run(
        [sys.executable, str(ROOT / "tools" / "write_parameters.py"), "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def described(qgis) -> dict:
    """What QGIS itself says of each algorithm."""
    done = qgis.python("""
import json
found = {}
for alg in provider.algorithms():
    made = alg.create({})
    found[alg.name()] = {
        "parameters": {d.name(): [d.help(), bool(d.flags() & d.FlagAdvanced)]
                       for d in made.parameterDefinitions()},
        "outputs": [o.name() for o in made.outputDefinitions()],
        "help": alg.shortHelpString(), "short": alg.shortDescription(), "title": alg.displayName(),
        "group": [alg.group(), alg.groupId()], "icon": alg.icon().isNull(), "svg": alg.svgIconPath(),
        "tags": alg.tags(),
    }
found["provider"] = [provider.id(), provider.name(), provider.icon().isNull(), provider.warningMessage(),
                     provider.defaultVectorFileExtension()]
found["where"] = processing.__file__
found["path"] = sys.path
print("JSON" + json.dumps(found))
""")
    assert "JSON" in done.stdout, done.stdout + done.stderr
    return json.loads(done.stdout.partition("JSON")[2])


def test_parameters_have_the_command_lines_names(described):
    for name, entry in DECLARED.items():
        expected = {p["name"].upper() for p in entry["parameters"]}
        assert set(described[name]["parameters"]) == expected, name
        for parameter in entry["parameters"]:
            text, advanced = described[name]["parameters"][parameter["name"].upper()]
            assert text, f"{name} {parameter['name']} has no help"
            assert advanced == bool(parameter.get("advanced")), f"{name} {parameter['name']}"


def test_results_are_declared(described):
    for name, entry in DECLARED.items():
        assert {key.upper() for key in entry["outputs"]} <= set(described[name]["outputs"]), name


def test_everything_is_described(described):
    icons = {described[name]["svg"] for name in FROZEN}
    assert len(icons) == len(FROZEN), "each algorithm has an icon of its own"
    for name in FROZEN | MODELS:
        shown = described[name]
        assert shown["help"] and shown["short"] and shown["title"] and all(shown["group"]) and shown["tags"], name
        assert not shown["icon"], name
        if name in DECLARED:
            assert DECLARED[name]["example"].split()[1] in shown["help"]
    assert described["provider"][:3] == ["treedgs", "TreeDGS", False] and described["provider"][4] == "gpkg"


def test_qgis_processing_package_is_its_own(described):
    assert described["where"].startswith("/usr/share/qgis")
    assert str(ROOT) not in described["path"] and not any(".venv" in entry for entry in described["path"])


def test_metadata_satisfies_the_plugin_repository():
    metadata = configparser.ConfigParser()
    metadata.read(ROOT / "metadata.txt", encoding="utf-8")
    general = dict(metadata["general"])
    for key in (
        "name",
        "description",
        "version",
        "qgisMinimumVersion",
        "author",
        "email",
        "about",
        "tracker",
        "repository",
        "homepage",
    ):
        assert general[key.lower()]
    assert general["hasprocessingprovider"] == "yes" and "supportsqt6" not in general
    assert (ROOT / general["icon"]).exists() and (ROOT / "LICENSE").exists()
    from treedgs_geo import __version__

    assert general["version"] == __version__


def test_nothing_but_qgis_and_the_standard_library_is_imported_in_qgis():
    import ast

    for folder in ("treedgs_qgis", "processing"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = []
                if isinstance(node, ast.Import):
                    names = [alias.name for alias in node.names]
                elif isinstance(node, ast.ImportFrom) and node.level == 0:
                    names = [node.module or ""]
                for name in names:
                    top = name.split(".")[0]
                    assert top == "qgis" or top in sys.stdlib_module_names, f"{path.name} imports {name}"


def test_styles_cover_the_tree_layer():
    source = (ROOT / "tools" / "write_styles.py").read_text(encoding="utf-8")
    style = (ROOT / "treedgs_geo" / "inventory" / "styles" / "trees.qml").read_text(encoding="utf-8")
    for name in TREE_FIELDS:
        assert f'"{name}"' in source and f'field="{name}"' in style, name


def test_styles_know_every_reason():
    from treedgs_geo.measure.quality import REASONS

    style = (ROOT / "treedgs_geo" / "inventory" / "styles" / "trees.qml").read_text(encoding="utf-8")
    assert all(f"'{reason}'" in style for reason in REASONS), "run make styles"


def test_requirements_name_a_managed_environment():
    load("treedgs_shell", ROOT / "treedgs_qgis" / "__init__.py", ROOT / "treedgs_qgis")
    environment = load("treedgs_shell.environment", ROOT / "treedgs_qgis" / "environment.py")
    assert environment.requirements()[0].startswith("torch") and len(environment.lock_hash()) == 10
