"""The plugin in real QGIS: what is registered, and that QGIS keeps everything of its own."""

from __future__ import annotations

import configparser
import html
import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from qgis_driver import ROOT, load

from treedgs_geo.stems.quality.tree import TREE_FIELDS
from treedgs_geo.verbs import MODULES

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
    "review",
    "matchplots",
    "evaluate",
    "planflight",
    "tapesample",
    "tapecheck",
    "trial",
    "standtable",
    "compare",
    "benchmark",
    "simulateplot",
    "checkengine",
    "setupengine",
    "removeengine",
    "sampleflight",
}
#: Not in ``qgis_process``.
IN_WINDOWS = {"reviewtrees"}
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


def test_a_python_to_build_with_may_be_called_python3(qgis, tmp_path):
    python = tmp_path / "python3"
    python.symlink_to("/bin/false")
    done = qgis.run("setupengine", {"TREEDGS_HOME": str(tmp_path / "home")}, PYTHON=python)
    # It is tried, and the engine's sentence is told.
    assert done.returncode == 1 and "Incorrect parameter value" not in done.stdout
    assert f"{python}: is not a Python 3.10 or newer" in done.stdout


def test_every_verb_has_its_algorithm_and_its_file():
    assert set(DECLARED) | {"setupengine", "removeengine", "sampleflight"} == FROZEN
    assert {entry["name"] for entry in DECLARED.values()} == set(MODULES)
    assert {path.stem for path in (ROOT / "processing").glob("*.py")} == FROZEN | IN_WINDOWS


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
        "outputs": {o.name(): o.type() for o in made.outputDefinitions()},
        "pages": [o.description() for o in made.outputDefinitions() if o.type() == "outputHtml"],
        "help": alg.shortHelpString(), "short": alg.shortDescription(), "title": alg.displayName(),
        "group": [alg.group(), alg.groupId()], "icon": alg.icon().isNull(), "svg": alg.svgIconPath(),
        "tags": alg.tags(), "url": alg.helpUrl(),
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
        outputs = described[name]["outputs"]
        assert {key.upper() for key in entry["outputs"]} <= set(outputs), name
        pages = {key for key, text in entry["outputs"].items() if re.search("page|report", text) and key[:2] != "n_"}
        assert {key for key in outputs if outputs[key] == "outputHtml"} == {key.upper() for key in pages}, name
        assert set(described[name]["pages"]) <= {entry["title"]}, f"{name}: what the Results Viewer lists"


def test_everything_is_described(described):
    icons = {described[name]["svg"] for name in FROZEN}
    assert len(icons) == len(FROZEN), "each algorithm has an icon of its own"
    for name in FROZEN | MODELS:
        shown = described[name]
        assert shown["help"] and shown["short"] and shown["title"] and all(shown["group"]) and shown["tags"], name
        assert not re.search(r"[^>]\n", shown["help"]), f"{name}: QGIS begins a paragraph with every line"
        assert not shown["icon"], name
        if name in DECLARED:
            assert DECLARED[name]["example"].split()[1] in shown["help"]
    assert described["provider"][:3] == ["treedgs", "TreeDGS", False] and described["provider"][4] == "gpkg"


def test_help_is_a_page(described):
    for name, shown in described.items():
        if name in ("provider", "where", "path") or name in MODELS:
            continue
        page = Path(unquote(urlsplit(shown["url"]).path))
        assert page.suffix == ".html" and "<h1>" in page.read_text(encoding="utf-8"), name
        links = re.findall(r'(?:href|src)="(file:[^"]+|[^":#]+)(?:#[^"]*)?"', page.read_text(encoding="utf-8"))
        assert links and not [link for link in links if link.endswith(".md")]
        assert all((page.parent / unquote(link.removeprefix("file://"))).exists() for link in links), (name, links)


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
    source = (ROOT / "tools" / "layer_styles" / "trees.py").read_text(encoding="utf-8")
    style = (ROOT / "treedgs_geo" / "core" / "styles" / "trees.qml").read_text(encoding="utf-8")
    for name in TREE_FIELDS:
        assert f'"{name}"' in source and f'field="{name}"' in style, name


def test_styles_know_every_reason():
    from treedgs_geo.stems.quality.reasons import REASONS

    style = (ROOT / "treedgs_geo" / "core" / "styles" / "trees.qml").read_text(encoding="utf-8")
    assert all(f"'{reason}'" in style for reason in REASONS), "run make styles"
    # In German and Spanish too: the style was written after the catalogues.
    for language in ("de", "es"):
        catalogue = ET.parse(ROOT / "treedgs_qgis" / "i18n" / f"treedgs_{language}.ts")
        known = {m.findtext("source"): m.findtext("translation", "") for m in catalogue.iter("message")}
        shown = html.unescape(style)
        for meaning, action in REASONS.values():
            assert f"{known[meaning]}: {known[action]}" in shown, (language, meaning, "run make styles")


@pytest.fixture
def shell():
    """The modules of the plugin that work without QGIS."""
    load("treedgs_shell", ROOT / "treedgs_qgis" / "__init__.py", ROOT / "treedgs_qgis")
    return lambda name: load(f"treedgs_shell.{name}", ROOT / "treedgs_qgis" / f"{name}.py")


def test_every_library_is_locked_with_hashes(shell):
    """Every range of requirements.txt (torch aside, which no step needs) has its version and hashes: make lock."""
    from packaging.requirements import Requirement

    locked = shell("locked")
    pins: dict[str, list[Requirement]] = {}
    for line in locked.lines():
        text, *hashes = line.partition("  #")[0].split(" --hash=")
        assert hashes and all(re.fullmatch(r"sha256:[0-9a-f]{64}", entry) for entry in hashes), line[:80]
        pins.setdefault(Requirement(text).name, []).append(Requirement(text))
    for line in shell("environment").requirements():
        wanted = Requirement(line)
        if wanted.name == "torch":
            assert wanted.name not in pins
            continue
        for pin in pins[wanted.name]:
            (version,) = [entry.version for entry in pin.specifier]
            assert version in wanted.specifier, f"{wanted}: {version} is locked, run make lock"
    assert "warp-lang" in pins and not any(line.startswith("warp") for line in locked.lines("cpu"))
    assert len(locked.lock_hash()) == 10 and shell("engine").managed_environment().name.endswith(locked.lock_hash())


SYSTEMS = {
    "here": {},
    "Windows": {"sys_platform": "win32", "platform_system": "Windows", "os_name": "nt", "platform_machine": "AMD64"},
    "macOS": {"sys_platform": "darwin", "platform_system": "Darwin", "os_name": "posix", "platform_machine": "arm64"},
}


@pytest.mark.parametrize("system", SYSTEMS)
def test_the_locked_list_is_complete(shell, system):
    """Nothing that a library of the list needs is missing in it: pip is told not to ask (``--no-deps``)."""
    from importlib.metadata import PackageNotFoundError, requires, version

    from packaging.markers import default_environment
    from packaging.requirements import Requirement

    def here(wanted: Requirement, extra: str = "") -> bool:
        environment = {**default_environment(), **SYSTEMS[system], "extra": extra}
        return wanted.marker is None or wanted.marker.evaluate(environment)

    def installed(name: str) -> str:
        try:
            return version(name)
        except PackageNotFoundError:
            assert system != "here", f"{name}: is not installed here, run make setup"
            return ""

    locked, parts = shell("locked"), shell("extras")
    asked = {wanted.name: wanted.extras for wanted in map(Requirement, shell("environment").requirements())}
    for chosen in ((), *((name,) for name in parts.CHOICES), tuple(parts.CHOICES)):
        pins = [Requirement(line.partition(" --hash=")[0]) for line in locked.lines("cpu", chosen)]
        there = {pin.name.lower().replace("_", "-"): pin for pin in pins if here(pin)}
        assert len(there) > 25
        for name, pin in there.items():
            if not (own := installed(name)):
                continue  # of another system: what it needs is not known here
            assert own in pin.specifier, f"{name}: make setup installs another version than the list"
            for wanted in map(Requirement, requires(name) or ()):
                if any(here(wanted, extra) for extra in ("", *asked.get(name, ()))):
                    needed = there.get(wanted.name.lower().replace("_", "-"))
                    assert needed is not None, f"{name} needs {wanted}, which the list ({chosen}) lacks: run make lock"
                    if found := installed(needed.name):
                        assert found in wanted.specifier, f"{name} needs {wanted}"


def test_what_is_needed_first_stands_first(qgis):
    """The dialog of the stand table, and layer inputs where a layer can be chosen."""
    done = qgis.python("""
from qgis.core import QgsProcessingParameterDefinition as D
for name in ("standtable", "pointcloudtodbh", "photostodbh", "matchplots", "reconstruct"):
    shown = [d for d in provider.algorithm(name).parameterDefinitions() if not d.isDestination()]
    print("SHOWN", name, [d.name() for d in shown if not d.flags() & D.FlagAdvanced][:6])
    print("KINDS", name, {d.name(): d.type() for d in shown if d.type() in ("vector", "raster")})
""")
    said = dict(line[6:].split(" ", 1) for line in done.stdout.splitlines() if line.startswith("SHOWN"))
    kinds = dict(line[6:].split(" ", 1) for line in done.stdout.splitlines() if line.startswith("KINDS"))
    assert said["standtable"] == "['TREES', 'PLOTS', 'SPECIES', 'PAIRS', 'FIELD', 'BOUNDARY']", done.stderr
    assert said["pointcloudtodbh"].startswith("['INPUT', 'PLOTS', 'DTM', 'CRS'")
    assert said["matchplots"].startswith("['TREES', 'FIELD', 'PLOTS', 'NORTH'")
    assert kinds["standtable"] == str(dict.fromkeys(("TREES", "PLOTS", "PAIRS", "BOUNDARY", "TAPED"), "vector"))
    assert kinds["reconstruct"] == kinds["pointcloudtodbh"] == "{'DTM': 'raster'}"
    assert kinds["photostodbh"] == "{'DTM': 'raster', 'FIELD_STEMS': 'vector', 'AT': 'vector', 'FLIGHT_PLAN': 'vector'}"


def test_make_setup_adds_its_own_locked_list(shell, tmp_path):
    """The tests' libraries, hashed too; nothing twice, so that the engine's versions are those of setupengine."""
    from packaging.requirements import Requirement

    locked, tools = shell("locked"), load("treedgs_tools_write_lock", ROOT / "tools" / "write_lock.py")
    both = tmp_path / "both.txt"
    locked.write_list("cuda", both, locked.DEVELOPERS)
    names: dict[str, set[str]] = {"engine": set(), "developers": set()}
    for line in both.read_text().splitlines():
        text, *hashes = line.partition("  #")[0].split(" --hash=")
        assert hashes and all(re.fullmatch(r"sha256:[0-9a-f]{64}", entry) for entry in hashes), line[:80]
        names["engine" if line in locked.lines() else "developers"].add(Requirement(text).name)
    assert not names["engine"] & names["developers"]
    for line in tools.wanted_by_developers():
        assert Requirement(line).name in names["engine"] | names["developers"], f"{line}: run make lock"
    # The editable library is built with what is installed: no build environment from the network.
    script = (ROOT / "tools" / "setup.sh").read_text()
    assert "requirements-dev-locked.txt" in script and "treedgs_qgis.environment" in script


def test_pip_takes_the_locked_list(shell, tmp_path):
    """pip itself reads it, hashes and all; a changed hash is refused before anything is installed."""
    locked = shell("locked")
    arguments = locked.write_list("cpu", tmp_path / "with space" / "list.txt")
    assert arguments[:1] == ["--require-hashes"] and Path(arguments[-1]).read_text().count("==") > 90
    (tmp_path / "empty").mkdir()
    pip = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--dry-run",
        "--no-index",
        "--no-deps",
        "--target",
        str(tmp_path / "t"),
    ]
    done = subprocess.run(
        [*pip, "--find-links", str(tmp_path / "empty"), *arguments], env=bare(), capture_output=True, text=True
    )
    # It understood every line, and looked for the first library.
    assert done.returncode == 1 and "No matching distribution found for affine" in done.stderr, done.stderr
    assert "Invalid" not in done.stderr and "hashes are required" not in done.stderr.lower()
    wheel = tmp_path / "wheels" / "tqdm-9.0-py3-none-any.whl"
    wheel.parent.mkdir()
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("tqdm-9.0.dist-info/METADATA", "Metadata-Version: 2.1\nName: tqdm\nVersion: 9.0\n")
        archive.writestr("tqdm-9.0.dist-info/WHEEL", "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
        archive.writestr("tqdm-9.0.dist-info/RECORD", "")
    (tmp_path / "one.txt").write_text(f"tqdm==9.0 --hash=sha256:{'0' * 64}\n")
    command = [*pip, "--find-links", str(wheel.parent), "--require-hashes", "-r", str(tmp_path / "one.txt")]
    done = subprocess.run(command, env=bare(), capture_output=True, text=True)
    assert done.returncode == 1 and "DO NOT MATCH THE HASHES" in done.stderr, done.stderr


def bare() -> dict[str, str]:
    """Without pip settings of this machine."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PIP_")} | {
        "PIP_CONFIG_FILE": os.devnull
    }


@pytest.mark.parametrize(
    ("code", "answer", "build", "words"),
    [
        (None, "", "cpu", "no NVIDIA driver"),
        (0, "NVIDIA GeForce RTX 3060 Laptop GPU, 551.61, 6144, 8.6", "cuda", "RTX 3060 Laptop GPU, driver 551.61"),
        (0, "NVIDIA H200, 570.86.15, 143771, 9.0", "cuda", "H200"),
        (0, "NVIDIA GB10, 580.95.05, [N/A], 12.1", "cuda", "GB10"),
        (0, "NVIDIA GeForce GTX 1060 6GB, 535.183.01, 6144, 6.1", "cuda", "GTX 1060"),
        (0, "NVIDIA GeForce GTX 1060 6GB, 470.223.02, 6144, 6.1", "cpu", "driver is 470.223.02, expected 525"),
        (0, "Quadro K620, 535.183.01, 2048, 5.0", "cpu", "too old"),
        (0, "NVIDIA GeForce GT 1030, 535.183.01, 1024, 6.1", "cpu", "1024 MB"),
        (0, "Quadro K620, 535.1, 2048, 5.0\nNVIDIA RTX A4000, 535.1, 16376, 8.6", "cuda", "RTX A4000"),
        (2, 'Field "compute_cap" is not a valid field to query.', "cpu", "does not answer (Field"),
        (6, "No devices were found", "cpu", "No devices were found"),
        (9, "NVIDIA-SMI has failed because it couldn't communicate with the NVIDIA driver. Make sure that the latest "
            "NVIDIA driver is installed and running.", "cpu", "couldn't communicate"),
        (18, "Failed to initialize NVML: Driver/library version mismatch", "cpu", "version mismatch"),
        (0, "", "cpu", "no NVIDIA card"),
        (0, "something else altogether", "cpu", "no NVIDIA card"),
        (0, "A card, [Unknown Error], [N/A], [N/A]", "cpu", "driver is [Unknown Error]"),
    ],
)  # fmt: skip
def test_the_build_follows_what_the_driver_says(shell, code, answer, build, words):
    choice = shell("gpu").choose(code, answer)
    assert choice.build == build and words in choice.why, choice


def test_the_driver_is_asked_by_its_own_program(shell, tmp_path, monkeypatch):
    gpu = shell("gpu")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert gpu.ask() == (None, "")
    program = tmp_path / "nvidia-smi"
    program.write_text(
        '#!/bin/sh\n[ "$2" = "--format=csv,noheader,nounits" ] || exit 3\necho "Card, 550.1, 8000, 8.9"\n'
    )
    program.chmod(0o755)
    assert gpu.choose(*gpu.ask()) == gpu.Choice("cuda", "Card, driver 550.1")
    program.write_text("#!/bin/sh\necho No devices were found\nexit 6\n")
    assert gpu.choose(*gpu.ask()).build == "cpu"


def test_every_stage_has_words():
    """What the log shows of a stage is a sentence's beginning, not a name from the sources."""
    source = (ROOT / "treedgs_qgis" / "listener.py").read_text(encoding="utf-8")
    named = set()
    for path in (ROOT / "treedgs_geo").rglob("*.py"):
        if path.parent.name != "campaign":
            named |= set(re.findall(r'(?:\.s|\bS)tage\(\s*"([^"]+)"', path.read_text(encoding="utf-8")))
    assert len(named) > 20
    assert not [name for name in sorted(named) if f'"{name}": "' not in source], "give it words in listener.STAGES"


def test_groups_are_in_the_order_of_work_and_common_words_find_algorithms(qgis):
    done = qgis.python(
        """
from collections import defaultdict
groups, found = defaultdict(list), defaultdict(list)
for algorithm in provider.algorithms():
    groups[algorithm.group()].append(algorithm.name())
    for word in ("canopy", "timber", "treetop", "export", "inventory"):
        if word in algorithm.tags():
            found[word].append(algorithm.name())
print("GROUPS", sorted(groups))
print("WORDS", {word: sorted(names) for word, names in found.items()})
"""
    )
    groups = (
        "GROUPS ['1 Plan', '2 Measure', '3 Check', '4 Report', '5 Steps and research', 'Ready-made models', 'Setup']"
    )
    assert groups in done.stdout, done.stdout + done.stderr
    words = done.stdout.partition("WORDS ")[2]
    for word, name in (("canopy", "photostodbh"), ("timber", "standtable"), ("treetop", "photostodbh"),
                       ("export", "standtable"), ("inventory", "compare")):  # fmt: skip
        assert f"'{word}'" in words and name in words.partition(f"'{word}'")[2].partition("]")[0], words


def test_dialogs_speak_in_words_and_help_is_found_by_the_label(qgis):
    done = qgis.python(
        """
algorithm = provider.algorithm("planflight").create({})
shown = {definition.name(): definition for definition in algorithm.parameterDefinitions()}
print("LABEL", shown["HIGHEST_M"].description(), shown["HIGHEST_M"].metadata())
print("HELP", "<b>Highest flight over the ground [m]</b> (HIGHEST_M): " in algorithm.shortHelpString())
"""
    )
    assert "LABEL Highest flight over the ground [m] {'widget_wrapper': {'decimals': 2}}" in done.stdout, done.stdout
    assert "HELP True" in done.stdout


def test_advice_names_the_zone_of_the_inputs_and_no_number_that_qgis_gave(qgis, tmp_path):
    """The engine gets the definition of a CRS of the user's own; a receiver writes zeros before its first fix."""
    (tmp_path / "a.MRK").write_text("1\t1.0\t[2000]\t0.0,Lat\t0.0,Lon\n2\t2.0\t[2000]\t48.14,Lat\t11.57,Lon\n")
    done = qgis.python(
        """
from qgis.core import QgsCoordinateReferenceSystem as Crs, QgsProcessingContext, QgsProcessingFeedback
from treedgs.treedgs_qgis.checks import crs_problem
from treedgs.treedgs_qgis.parameters import engine_values
degrees, own = Crs("EPSG:4326"), Crs.fromProj("+proj=tmerc +lat_0=0 +lon_0=-90.5 +x_0=500000 +datum=WGS84 +units=m")
own.saveAsUserCrs("Mine")
print("CODE", own.authid())
for given, crs in (("EPSG:4326", degrees), ("nonsense", Crs())):
    for inputs in ([], [sys.argv[1]]):
        print("SAYS", crs_problem("CRS", given, crs, inputs))
made, context = provider.algorithm("pointcloudtodbh").create({}), QgsProcessingContext()
print("ENGINE", engine_values(made, made.declaration, {"CRS": own}, context, QgsProcessingFeedback(False))["crs"])
""",
        tmp_path / "a.MRK",
    )
    refused = "SAYS CRS: EPSG:4326 (WGS 84) is geographic (degrees), expected a projected CRS in metres; "
    zone = "EPSG:32632 (WGS 84 / UTM zone 32N)"
    assert re.findall("^SAYS.*", done.stdout, re.M) == [
        f"{refused}use the UTM zone of your plot.",
        f"{refused}use the UTM zone of your plot, {zone}.",
        "SAYS CRS: 'nonsense' is not a coordinate reference system; give one like EPSG:CODE.",
        f"SAYS CRS: 'nonsense' is not a coordinate reference system; give one like {zone}.",
    ]
    assert "CODE USER:" in done.stdout and "ENGINE PROJCS[" in done.stdout, done.stdout + done.stderr
