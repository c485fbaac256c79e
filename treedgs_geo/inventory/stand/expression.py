"""Formulas from a table, evaluated without ``eval``: arithmetic on named inputs and a few functions, nothing else."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from ...core.errors import InputError

#: Longest formula, and how deep it may nest: what no real equation reaches.
_LONGEST, _DEEPEST = 600, 40
_BINARY: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
_UNARY: dict[type, Callable] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_COMPARE: dict[type, Callable] = {
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
_CONSTANTS = {"pi": np.pi}


class Formula:
    """A formula over named inputs, for example ``exp(-2.5356 + 2.4349*ln(D))``.

    Understood: numbers, the inputs' names, ``pi``, ``+ - * / **``, brackets, ``< <= > >=`` (inside ``where``), and
    ``exp, ln, log10, sqrt, min, max, where(condition, then, else)``. Nothing else can be reached from it.
    """

    def __init__(self, text: str, inputs: tuple[str, ...] = ("D", "H"), where: str = "formula") -> None:
        """Parse and check.

        Raises:
            InputError: ``where`` and what in the formula is not understood.
        """
        self.text, self.inputs = text.strip(), inputs
        if not self.text or len(self.text) > _LONGEST:
            raise InputError(f"{where}: has {len(self.text)} characters, expected a formula of 1 to {_LONGEST}.")
        try:
            self._tree = ast.parse(self.text, mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise InputError(
                f"{where}: {self.text!r} is no formula; expected one like a*D**b*H**c (D, H, + - * / **, exp, ln)."
            ) from None
        self.uses: set[str] = set()
        self._check(self._tree, where, 0)

    def __call__(self, **values: Any) -> np.ndarray:
        """Evaluate on arrays or numbers; where the mathematics fails the result is NaN or infinite, never an error."""
        with np.errstate(all="ignore"):
            found = self._value(self._tree, {name: np.asarray(value, float) for name, value in values.items()})
        return np.asarray(found, float)

    def _check(self, node: ast.AST, where: str, depth: int) -> None:
        if depth > _DEEPEST:
            raise InputError(f"{where}: {self.text!r} nests too deep; write it simpler.")
        children: list[ast.AST] = []
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
            if abs(node.value) > 1e300:
                raise InputError(f"{where}: a number in {self.text!r} is too large.")
        elif isinstance(node, ast.Name) and node.id in (*self.inputs, *_CONSTANTS):
            self.uses.add(node.id)
        elif isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            children = [node.left, node.right]
        elif isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
            children = [node.operand]
        elif isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in _COMPARE:
            children = [node.left, *node.comparators]
        elif (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in _FUNCTIONS
            and len(node.args) == _FUNCTIONS[node.func.id][1]
            and not node.keywords
        ):
            children = list(node.args)
        else:
            part = ast.get_source_segment(self.text, node) or type(node).__name__
            raise InputError(
                f"{where}: {part!r} is not allowed in a formula; use numbers, {', '.join(self.inputs)}, + - * / **, "
                f"{', '.join(_FUNCTIONS)}."
            )
        for child in children:
            self._check(child, where, depth + 1)

    def _value(self, node: ast.AST, values: dict[str, np.ndarray]) -> Any:
        if isinstance(node, ast.Constant):
            return float(node.value)  # type: ignore[arg-type]
        if isinstance(node, ast.Name):
            return _CONSTANTS[node.id] if node.id in _CONSTANTS else values[node.id]
        if isinstance(node, ast.BinOp):
            return _BINARY[type(node.op)](self._value(node.left, values), self._value(node.right, values))
        if isinstance(node, ast.UnaryOp):
            return _UNARY[type(node.op)](self._value(node.operand, values))
        if isinstance(node, ast.Compare):
            left, right = self._value(node.left, values), self._value(node.comparators[0], values)
            return _COMPARE[type(node.ops[0])](left, right)
        assert isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
        return _FUNCTIONS[node.func.id][0](*(self._value(argument, values) for argument in node.args))
