"""The documentation as one site: make docs (Sphinx, MyST, pydata-sphinx-theme)."""

from __future__ import annotations

import pkgutil
import re
import sys
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
import numba  # noqa: E402

# Compiled functions stay Python functions, so that their signatures and docstrings are shown; not in the notebooks.
numba.config.DISABLE_JIT = True  # type: ignore[attr-defined]

from docutils import nodes  # noqa: E402
from sphinx.application import Sphinx  # noqa: E402
from sphinx.ext.napoleon import Config, GoogleDocstring  # noqa: E402
from sphinx.util.docutils import SphinxDirective  # noqa: E402

import treedgs_geo  # noqa: E402
from treedgs_geo import cli  # noqa: E402
from treedgs_geo.core.command import ordered_params  # noqa: E402
from treedgs_geo.verbs import all_commands  # noqa: E402

project = "TreeDGS"
author = "TreeDGS contributors"
copyright = "TreeDGS contributors, GPL-3.0-or-later"
version = release = treedgs_geo.__version__

extensions = ["sphinx.ext.autodoc", "myst_nb"]
exclude_patterns = ["results", "gallery/*/**"]
suppress_warnings = ["config.cache"]

# Notebooks run once and again when their text changes (make clean: all of them), one after the other in docs/gallery:
# later ones go on with the flight of the first.
nb_execution_mode = "cache"
nb_execution_cache_path = str(ROOT / "build" / "notebooks")
nb_execution_raise_on_error = True
nb_execution_timeout = 1800
nb_output_stderr = "remove"

myst_enable_extensions = ["attrs_inline", "deflist"]
myst_heading_anchors = 3

nitpicky = True
# Types of other libraries in signatures (np.ndarray, Path); functions, data, modules and our own types must resolve.
nitpick_ignore_regex = [
    (r"py:(class|obj|exc)", r"(?!treedgs_geo|\.).*"),
    (r"py:.*", r"(numpy|multiprocessing)\b.*|.*\._\w+|.*\.stage\.J"),
]
autodoc_default_options = {"members": True, "show-inheritance": True, "ignore-module-all": True}
autodoc_member_order = "bysource"
# Blender's own modules, which only Blender has.
autodoc_mock_imports = ["addon_utils", "bpy", "mathutils"]
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
add_module_names = False

man_pages = [("technician/commands", "treedgs", "tree diameters from drone photos or LiDAR clouds", author, 1)]

html_theme = "pydata_sphinx_theme"
html_title = f"TreeDGS {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_theme_options = {
    "logo": {"text": "TreeDGS"},
    "navbar_align": "left",
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": ["sphinx-version"],
    "show_toc_level": 2,
}


class Room(SphinxDirective):
    """``{room} treedgs_geo.core``: every module of a package, one heading each, documented from its docstrings."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        package, *modules = modules_of(self.arguments[0])
        text = [f".. automodule:: {package}", ""]
        for name in modules:
            short = name.removeprefix("treedgs_geo.")
            text += [short, "-" * len(short), "", f".. automodule:: {name}", ""]
        return self.parse_text_to_nodes("\n".join(text), allow_section_headings=True)


class FrontDoor(SphinxDirective):
    """``{front-door}``: the names of ``import treedgs_geo as tg``, each with its first line and its home."""

    def run(self) -> list[nodes.Node]:
        text = [".. list-table::", "   :widths: 30 70", ""]
        for name in sorted(treedgs_geo.__all__, key=str.lower):
            found = getattr(treedgs_geo, name)
            lines = (found.__doc__ or "").strip().split("\n\n")[0].split("\n")
            first = re.split(r"(?<=[.:])\s", " ".join(line.strip() for line in lines))[0].rstrip(":.")
            first = re.sub(r":\w+:`[~.]*([^`]*)`", r"``\1``", first)
            home = f"{found.__module__}.{found.__qualname__}"
            verb = treedgs_geo._VERBS.get(name)
            shown = f"``tg.{name}``, the verb ``{verb}``" if verb else f":py:obj:`tg.{name} <{home}>`"
            text += [f"   * - {shown}", f"     - {first}", ""]
        return self.parse_text_to_nodes("\n".join(text))


class Commands(SphinxDirective):
    """``{commands}``: every verb with its options, from the declaration of the command line."""

    def run(self) -> list[nodes.Node]:
        text = []
        for command in all_commands():
            text += [f"## {command.name}", "", plain(f"{command.summary} {command.help}"), ""]
            text += ["```sh", command.example, "```", "", f"```{{program}} treedgs {command.name}", "```", ""]
            for name, spec, default in ordered_params(command):
                text += [f"```{{option}} --{name.replace('_', '-')} <{cli._metavar(spec)}>"]
                text += [plain(cli._help_line(spec, default)), ""]
                text += [f"- `{key}=`{plain(line)}" for key, line in cli._keys(spec)]
                text += ["```", ""]
        return self.parse_text_to_nodes("\n".join(text), allow_section_headings=True)


def plain(text: str) -> str:
    """Text in which nothing is mark-up."""
    return re.sub(r"([\\*`|_<>\[\]{}$#])", r"\\\1", text)


def modules_of(name: str) -> list[str]:
    """The package itself and its modules, sub-packages included, in alphabetical order."""
    package = import_module(name)
    if not hasattr(package, "__path__"):
        return [name]
    return [name, *sorted(found.name for found in pkgutil.walk_packages(package.__path__, f"{name}."))]


def read_sections(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Raises:, Returns: and the like of functions and classes; the comment of a constant is plain text."""
    if what in ("function", "method", "class", "exception"):
        lines[:] = GoogleDocstring(lines, Config(), what=what, name=name, obj=obj).lines()


def setup(app: Sphinx) -> dict[str, bool]:
    app.add_directive("room", Room)
    app.add_directive("front-door", FrontDoor)
    app.add_directive("commands", Commands)
    app.connect("autodoc-process-docstring", read_sections)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
