"""Volume, biomass and height equations kept as data: read, chosen per tree, evaluated in SI with their range."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from ...core.column_names import QUANTITIES as BOOK
from ...core.errors import InputError
from ...core.tables import read_table
from .species import Species, species_of

#: Longest formula, and how deep it may nest: what no real equation reaches.
_LONGEST, _DEEPEST = 600, 40
#: Operators of a formula -> their functions.
_OPERATORS: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}
#: name -> (function, number of arguments)
_FUNCTIONS: dict[str, tuple[Callable, int]] = {
    "exp": (np.exp, 1),
    "ln": (np.log, 1),
    "log10": (np.log10, 1),
    "sqrt": (np.sqrt, 1),
    "min": (np.minimum, 2),
    "max": (np.maximum, 2),
    "where": (np.where, 3),
}
#: Inputs of a formula: diameter and height.
_INPUTS = ("D", "H")


class Formula:
    """A formula over D and H, for example ``exp(-2.5356 + 2.4349*ln(D))``.

    Understood: numbers, the inputs' names, ``pi``, ``+ - * / **``, brackets, ``< <= > >=`` (inside ``where``), and
    ``exp, ln, log10, sqrt, min, max, where(condition, then, else)``. Nothing else can be reached from it.
    """

    def __init__(self, text: str, where: str = "formula") -> None:
        """Parse and check.

        Raises:
            InputError: ``where`` and what in the formula is not understood.
        """
        self.text = text.strip()
        if not self.text or len(self.text) > _LONGEST:
            raise InputError(f"{where}: has {len(self.text)} characters, expected a formula of 1 to {_LONGEST}.")
        try:
            tree = ast.parse(self.text, mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise InputError(
                f"{where}: {self.text!r} is no formula; expected one like a*D**b*H**c (D, H, + - * / **, exp, ln)."
            ) from None
        self.uses: set[str] = set()
        self._value = self._compiled(tree, where, 0)

    def __call__(self, **values: Any) -> np.ndarray:
        """Evaluate on arrays or numbers; where the mathematics fails the result is NaN or infinite, never an error."""
        with np.errstate(all="ignore"):
            found = self._value({name: np.asarray(value, float) for name, value in values.items()})
        return np.asarray(found, float)

    def _compiled(self, node: ast.AST, where: str, depth: int) -> Callable[[dict[str, np.ndarray]], Any]:
        """The node as a function of the inputs' values, checked."""
        if depth > _DEEPEST:
            raise InputError(f"{where}: {self.text!r} nests too deep; write it simpler.")
        function, parts = None, list[ast.expr]()
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
            if abs(node.value) > 1e300:
                raise InputError(f"{where}: a number in {self.text!r} is too large.")
            number = float(node.value)
            return lambda _: number
        if isinstance(node, ast.Name) and node.id in (*_INPUTS, "pi"):
            self.uses.add(name := node.id)
            return lambda values: np.pi if name == "pi" else values[name]
        if isinstance(node, ast.BinOp):
            function, parts = _OPERATORS.get(type(node.op)), [node.left, node.right]
        elif isinstance(node, ast.UnaryOp):
            function, parts = _OPERATORS.get(type(node.op)), [node.operand]
        elif isinstance(node, ast.Compare) and len(node.ops) == 1:
            function, parts = _OPERATORS.get(type(node.ops[0])), [node.left, *node.comparators]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            known, n = _FUNCTIONS.get(node.func.id, (None, 0))
            function, parts = known if len(node.args) == n else None, node.args
        if function is None:
            part = ast.get_source_segment(self.text, node) or type(node).__name__
            raise InputError(
                f"{where}: {part!r} is not allowed in a formula; use numbers, {', '.join(_INPUTS)}, + - * / **, "
                f"{', '.join(_FUNCTIONS)}."
            )
        of = [self._compiled(part, where, depth + 1) for part in parts]
        return lambda values: function(*(value(values) for value in of))


QUANTITIES = ("volume", "biomass", "height")
ORIGINS = ("natural", "planted")
_DBH_CM, _HEIGHT_M = BOOK["dbh"].units, BOOK["height"].units
#: Where a row says nothing.
_USUAL = {"origin": "any", "dbh_unit": "cm", "height_unit": "m"}
#: Result unit -> factor to m3, kg or m.
_RESULT = {
    "volume": {"m3": 1.0, "dm3": 1e-3, "l": 1e-3, "ft3": 0.3048**3},
    "biomass": {"kg": 1.0, "t": 1000.0, "lb": 0.45359237},
    "height": _HEIGHT_M,
}


@dataclass(frozen=True)
class Equation:
    """One row. species: symbols, names or numbers, ``group:pine``, or ``*``. Limits in the row's own units (NaN: none).

    limits: who set them (the source, or us). source: the citation.
    """

    id: str
    quantity: str
    species: str
    origin: str
    formula: Formula
    dbh_unit: str
    height_unit: str
    result_unit: str
    dbh_min: float
    dbh_max: float
    height_min: float
    height_max: float
    limits: str
    source: str

    @property
    def needs_height(self) -> bool:
        """Whether the formula has H in it."""
        return "H" in self.formula.uses

    def fits(self, species: Species, origin: str) -> bool:
        """Whether the row is for this species and stand origin."""
        if self.origin not in ("any", origin):
            return False
        tokens = [token.replace("_", " ") for token in self.species.lower().split()]
        symbols = {species_of(name).symbol.upper() for name in self.named} | {name.upper() for name in self.named}
        group = f"group:{species.group.lower()}"
        return "*" in tokens or (bool(species.group) and group in tokens) or species.symbol.upper() in symbols

    @property
    def named(self) -> list[str]:
        """Species that the row names one by one."""
        tokens = [token.replace("_", " ") for token in self.species.split()]
        return [token for token in tokens if token != "*" and not token.startswith("group:")]

    def value(self, dbh_cm: np.ndarray, height_m: np.ndarray | float = np.nan) -> np.ndarray:
        """m3, kg or m for each tree; NaN where the formula gives none."""
        diameter = np.asarray(dbh_cm, float) / _DBH_CM[self.dbh_unit]
        height = np.asarray(height_m, float) / _HEIGHT_M[self.height_unit]
        found = np.broadcast_to(self.formula(D=diameter, H=height), np.broadcast(diameter, height).shape)
        found = np.where(np.isfinite(found) & (found >= 0), found, np.nan)
        return found * _RESULT[self.quantity][self.result_unit]

    def outside(self, dbh_cm: np.ndarray, height_m: np.ndarray | float = np.nan) -> np.ndarray:
        """True where the tree is outside the range that the equation holds for."""
        diameter = np.asarray(dbh_cm, float) / _DBH_CM[self.dbh_unit]
        # A hair of tolerance: 2.54 cm is 1 inch, whatever the last bit says.
        beyond = (diameter < self.dbh_min - 1e-6) | (diameter > self.dbh_max + 1e-6)
        if self.needs_height:
            height = np.asarray(height_m, float) / _HEIGHT_M[self.height_unit]
            beyond = beyond | (height < self.height_min - 1e-6) | (height > self.height_max + 1e-6)
        return beyond

    @property
    def range_text(self) -> str:
        """``DBH 1 to 40 in, height 4.5 to 160 ft``."""
        parts = []
        for name, low, high, unit in (
            ("DBH", self.dbh_min, self.dbh_max, self.dbh_unit),
            ("height", self.height_min, self.height_max, self.height_unit),
        ):
            if np.isfinite(low) and np.isfinite(high):
                parts.append(f"{name} {low:g} to {high:g} {unit}")
            elif np.isfinite(low):
                parts.append(f"{name} from {low:g} {unit}")
            elif np.isfinite(high):
                parts.append(f"{name} up to {high:g} {unit}")
        return ", ".join(parts) or "no limits stated"


COLUMNS = tuple(Equation.__dataclass_fields__)


def read_equations(own: Path | None = None) -> list[Equation]:
    """The built-in table, behind the user's ``own`` rows, which are tried first.

    Raises:
        InputError: file, line, and what is wrong in it; an id twice in one file.
    """
    with as_file(files(__package__) / "data" / "equations.csv") as path:
        built_in = _read(path, "built-in equations")
    if own is None:
        return built_in
    mine = _read(Path(own), str(own))
    names = {equation.id for equation in mine}
    return [*mine, *(equation for equation in built_in if equation.id not in names)]


def choose(book: list[Equation], quantity: str, species: Species, origin: str, has_height: bool) -> Equation | None:
    """The first row of ``book`` for this tree."""
    usable = (equation for equation in book if equation.quantity == quantity and equation.fits(species, origin))
    return next((equation for equation in usable if has_height or not equation.needs_height), None)


def _read(path: Path, where: str) -> list[Equation]:
    table = read_table(path).fillna("")
    lost = [name for name in ("id", "quantity", "species", "formula", "result_unit", "source") if name not in table]
    if lost:
        raise InputError(f"{where}: lacks the columns {', '.join(lost)}; expected {', '.join(COLUMNS)}.")
    found: list[Equation] = []
    for number, row in table.iterrows():
        cell: dict[str, Any] = {name: row.get(name, "") for name in COLUMNS}
        line = f"{where}, line {number}"
        if cell["id"] in {equation.id for equation in found} or not cell["id"]:
            raise InputError(f"{line}: id {cell['id']!r} is empty or appears twice; give every equation its own id.")
        if cell["quantity"] not in QUANTITIES:
            raise InputError(f"{line}: quantity {cell['quantity']!r}, expected one of {', '.join(QUANTITIES)}.")
        cell |= {name: cell[name] or usual for name, usual in _USUAL.items()}
        units = {"dbh_unit": _DBH_CM, "height_unit": _HEIGHT_M, "result_unit": _RESULT[cell["quantity"]]}
        for name, known in units.items():
            if cell[name] not in known:
                raise InputError(f"{line}: {name} {cell[name]!r}, expected one of {', '.join(known)}.")
        if cell["origin"] not in ("any", *ORIGINS):
            raise InputError(f"{line}: origin {cell['origin']!r}, expected any, {' or '.join(ORIGINS)}.")
        if not cell["source"] or not cell["species"]:
            raise InputError(
                f"{line}: has no {'species' if cell['source'] else 'source'}; say it, or * for any species."
            )
        for name, empty in (("dbh_min", -np.inf), ("dbh_max", np.inf), ("height_min", -np.inf), ("height_max", np.inf)):
            try:
                cell[name] = float(cell[name] or empty)
            except ValueError:
                raise InputError(f"{line}: {name} is {cell[name]!r}, expected a number or nothing.") from None
        cell["formula"] = formula = Formula(cell["formula"], where=line)
        if cell["quantity"] == "height" and "H" in formula.uses:
            raise InputError(f"{line}: the height formula {formula.text!r} needs H itself; use D alone.")
        found.append(Equation(**cell))
    return found
