"""A parameter of an engine: its name, unit, range and default, and how it is read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sssfit.errors import ArgumentError
from sssfit.messages import shown

CHANNELS = 3
Value = float | int | bool | str | tuple[float, ...]
Values = Mapping[str, Value]
_EXAMPLES = {"number": "1.2", "colour": "1,0.4,0.2", "whole": "25"}


@dataclass(frozen=True, slots=True)
class Field:
    """A parameter of an engine.

    Parameters
    ----------
    name : str
        As the engine spells it.
    unit : str
        "mm", "cm", "m", "1/mm", "1" for a share or a count, "" for a word.
    meaning : str
    kind : str
        "number", "colour" (one number a channel), "whole", "flag" or "choice".
    least, most : float
        Allowed range, both included.
    is_above : bool
        Whether ``least`` itself is excluded.
    among : tuple
        Words of a choice, or allowed whole numbers.
    default : optional
        Value where none is given; without it the parameter is required.
    is_chosen : bool
        Whether a user chooses it: it says how to convert, and does not come from the material.
    """

    name: str
    unit: str
    meaning: str
    kind: str = "number"
    least: float = 0.0
    most: float = math.inf
    is_above: bool = False
    among: tuple[Any, ...] = ()
    default: Value | None = None
    is_chosen: bool = False

    def read(self, given: object) -> Value:
        """Return a value, or the words of one, as this parameter's.

        Raises
        ------
        ArgumentError
            It is of another kind or out of range.
        """
        try:
            value = self._parsed(given)
        except (TypeError, ValueError):
            value = None
        if value is None or not self._is_allowed(value):
            raise ArgumentError(f"{self.name} = {shown(given)}; expected {self.expected}.")
        return value

    def _parsed(self, given: object) -> Value | None:
        """Return numbers of texts, and tuples of lists."""
        if self.kind == "choice":
            return str(given)
        if self.kind == "flag":
            return {"true": True, "false": False, "1": True, "0": False}.get(str(given).lower())
        if self.kind == "colour":
            parts = given.split(",") if isinstance(given, str) else list(given)  # type: ignore[call-overload]
            return tuple(float(each) for each in parts)
        number = float(given)  # type: ignore[arg-type]
        return number if self.kind == "number" else int(number) if number.is_integer() else None

    def _is_allowed(self, value: Value) -> bool:
        """Return whether a value is in the range."""
        if self.kind == "flag":
            return True
        if self.among:
            return value in self.among
        numbers = value if isinstance(value, tuple) else (float(value),)
        count = CHANNELS if self.kind == "colour" else 1
        return len(numbers) == count and all(
            (each > self.least if self.is_above else each >= self.least)
            and each <= self.most
            and math.isfinite(each)
            for each in numbers
        )

    @property
    def expected(self) -> str:
        """What a message asks for."""
        if self.kind == "flag":
            return "true or false"
        if self.among:
            return f"one of {', '.join(str(each) for each in self.among)}"
        what = {"colour": "three numbers", "whole": "a whole number"}.get(self.kind, "a number")
        low = f"{'above' if self.is_above else 'from'} {self.least:g}"
        to = ", at most" if self.is_above else " to"
        high = "" if math.isinf(self.most) else f"{to} {self.most:g}"
        unit = "" if self.unit in ("", "1") else f", in {self.unit}"
        return f"{what} {low}{high}{unit}, such as {self._example}"

    @property
    def _example(self) -> str:
        """A value that is allowed, as text."""
        if isinstance(self.default, tuple):
            return ",".join(f"{each:g}" for each in self.default)
        if self.default is not None:
            return f"{self.default:g}" if isinstance(self.default, float) else str(self.default)
        return _EXAMPLES[self.kind]
