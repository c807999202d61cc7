"""Arithmetic of a plan: numbers, names of axes and columns, + - * / ** and parentheses."""

import ast
import operator
from collections.abc import Callable, Mapping
from typing import Any

from sssfit.errors import PlanError
from sssfit.messages import did_you_mean, shown

_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_MOST_CHARACTERS = 1000


class Expression:
    """A formula that was checked for its names, and is evaluated for each point.

    Parameters
    ----------
    text : str
        Such as ``"melanin * melanin_per_mm + (1 - melanin) * baseline_per_mm"``.
    known : collection of str
        The names that it may use.

    Raises
    ------
    PlanError
        It is not arithmetic, or it uses an unknown name.
    """

    def __init__(self, text: str, known: Mapping[str, Any]) -> None:
        self.text = text
        try:
            # Python's parser ends the process on some texts of many thousand brackets.
            tree = ast.parse(text.strip() if len(text) <= _MOST_CHARACTERS else "", mode="eval")
            self._tree = tree.body
            _check(self._tree, known)
        except PlanError:
            raise
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise PlanError(
                f"{shown(text)} is not arithmetic; expected numbers, names of axes and columns, "
                "+ - * / ** and parentheses."
            ) from None

    @property
    def names(self) -> set[str]:
        """The names that it uses."""
        return {each.id for each in ast.walk(self._tree) if isinstance(each, ast.Name)}

    def __call__(self, names: Mapping[str, float]) -> float:
        """Evaluate with a value for each name; raises PlanError where there is no result."""
        try:
            found = float(_value(self._tree, names))
        except (ArithmeticError, TypeError, ValueError):
            raise PlanError(f"{shown(self.text)} has no real value at a point.") from None
        return found


def _check(node: ast.expr, known: Mapping[str, Any]) -> None:
    """Raise an error for anything but arithmetic of known names."""
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        _check(node.left, known)
        _check(node.right, known)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        _check(node.operand, known)
    elif isinstance(node, ast.Name):
        if node.id not in known:
            raise PlanError(
                f"{shown(node.id)} is no axis and no column of a table. "
                f"{did_you_mean(node.id, [*known])}Known names: {', '.join(known) or 'none'}."
            )
    elif not (isinstance(node, ast.Constant) and type(node.value) in (int, float)):
        raise ValueError


def _value(node: Any, names: Mapping[str, float]) -> Any:
    """Evaluate a tree that `_check` accepted, in floats: powers of integers could fill memory."""
    if isinstance(node, ast.BinOp):
        return _BINARY[type(node.op)](_value(node.left, names), _value(node.right, names))
    if isinstance(node, ast.UnaryOp):
        value = _value(node.operand, names)
        return -value if isinstance(node.op, ast.USub) else value
    return float(names[node.id] if isinstance(node, ast.Name) else node.value)
