"""What a verb prints, held to the figures of its JSON object: each line, each cell, nothing left.

A layout lists the lines and tables that a text consists of, with the values of the JSON object in
the places where they are printed. A printed number agrees with a value if it is the value rounded
to the digits that are printed; of figures that are not whole there have to be two at least.
"""

import math
import re
from dataclasses import dataclass
from typing import Any

_NUMBER = re.compile(r"[+-]?(\d[\d,]*)?(?:\.(\d+))?(?:e([+-]?\d+))?")


@dataclass(frozen=True)
class Percent:
    """A share, printed in per cent; what is but rounding is "0 %"."""

    share: float | None
    digits: int = 1


@dataclass(frozen=True)
class Rough:
    """A number of which a single digit may be printed: seconds, errors of errors."""

    value: Any


@dataclass(frozen=True)
class Exact:
    """A number that is printed in full, however it is written."""

    value: Any


class Words:
    """A template with values in the places of ``{}``, as a cell of a table or as a line."""

    def __init__(self, template: str, *values: Any) -> None:
        self.template, self.values = template, values

    def take(self, lines: list[str]) -> list[str]:
        """Check the first line; return the others."""
        assert lines, f"no line is left for {self.template!r}"
        assert agrees(lines[0], self), f"{lines[0]!r} is not {self.template!r} of {self.values}"
        return lines[1:]


class Table:
    """A table: its heads, and the values of its rows.

    Columns in which all rows print the same, where a swap would not be seen, are refused unless
    they hold nothing but rounding or are named in ``alike``.
    """

    def __init__(
        self, heads: list[str], rows: list[list[Any]], alike: tuple[str, ...] = ()
    ) -> None:
        self.heads, self.rows, self.alike = heads, rows, alike

    def take(self, lines: list[str]) -> list[str]:
        """Check the table; return the lines after it."""
        printed = [cells_of(line) for line in lines[: 1 + len(self.rows)]]
        assert printed[0] == [head for head in self.heads if head]
        assert len(printed) == 1 + len(self.rows), "rows are missing"
        for cells, values in zip(printed[1:], self.rows, strict=True):
            cells += [""] * (len(self.heads) - len(cells))
            for head, cell, value in zip(self.heads, cells, values, strict=True):
                assert agrees(cell, value), f"{cells[0]}, {head}: {cell!r} is not {value!r}"
        for k, head in enumerate(self.heads):
            column = {row[k] for row in printed[1:] if len(row) > k}
            is_empty = all(is_nothing(row[k]) for row in self.rows)
            told_apart = is_empty or len(column) > 1 or len(self.rows) < 2 or head in self.alike
            assert told_apart, f"all rows have the same {head}: swaps would not be seen"
        return lines[1 + len(self.rows) :]


def is_nothing(value: Any) -> bool:
    """Whether there is no value, or one that is but rounding."""
    return value is None or (isinstance(value, Percent) and abs(value.share or 0.0) < 1e-9)


def cells_of(line: str) -> list[str]:
    """Cells stand two spaces or more apart."""
    return re.split(r" {2,}", line.strip())


def check(text: str, layout: list[Any]) -> None:
    """Hold a text to a layout, to its end."""
    lines = [line for line in text.splitlines() if line.strip()]
    for part in layout:
        lines = part.take(lines)
    assert not lines, f"printed, and in no layout: {lines}"


def agrees(text: str, value: Any) -> bool:
    """Whether a printed text is the value."""
    if isinstance(value, Words):
        return _fills(text, value)
    if isinstance(value, Percent):
        return _is_percent(text, value.share, value.digits)
    if isinstance(value, Rough):
        return _is_number(text, value.value, digits=0)
    if isinstance(value, Exact):
        return float(text.replace(",", "")) == value.value
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return text == "-"
    if isinstance(value, str):
        return text == value
    return _is_number(text, value, digits=2)


def _fills(text: str, words: Words) -> bool:
    values: list[Any] = []
    found = re.fullmatch(_pattern(words, values), text.strip())
    return found is not None and all(map(agrees, found.groups(), values))


def _pattern(value: Any, values: list[Any]) -> str:
    """What a value may look like; it is appended to ``values`` where that is to be looked at."""
    if isinstance(value, Words):
        parts = [re.escape(part) for part in value.template.split("{}")]
        filled = [_pattern(each, values) for each in value.values]
        return "".join(part + fill for part, fill in zip(parts, [*filled, ""], strict=True))
    if isinstance(value, str):
        return re.escape(value)
    values.append(value)
    return r"(\S+ %)" if isinstance(value, Percent) else r"([-+]?[\d.][\d,.]*(?:e[-+]?\d+)?|-)"


def _is_percent(text: str, share: float | None, digits: int) -> bool:
    if share is None:
        return text == "-"
    if abs(share) < 1e-9 and text == "0 %":
        return True
    return text.endswith(" %") and _is_number(text[:-2], 100.0 * share, digits)


def _is_number(text: str, value: Any, digits: int) -> bool:
    """Whether a number is the value, rounded to its own digits."""
    found = _NUMBER.fullmatch(text)
    if found is None or value is None or not any(each.isdigit() for each in text):
        return False
    if isinstance(value, int):
        return text.lstrip("+") == f"{value:,}" or text.lstrip("+") == f"{value}"
    whole, decimals, exponent = (each or "" for each in found.groups())
    printed = float(text.replace(",", ""))
    # Zeros at the end are left out: 1.004 to three digits is 1.
    if math.isclose(printed, float(f"{value:.{max(digits, 1)}g}"), rel_tol=1e-12):
        return True
    significant = len((whole.replace(",", "") + decimals).lstrip("0"))
    half = 0.5 * 10.0 ** (int(exponent or 0) - len(decimals))
    is_enough = significant >= digits or len(decimals) >= 3
    return is_enough and abs(printed - value) <= half * (1.0 + 1e-9)
