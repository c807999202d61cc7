"""The axes of a plan: a list, a range, or a table of wavelengths, and what a point has on each."""

import csv
import keyword
import math
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sssfit.errors import PlanError
from sssfit.messages import counted, did_you_mean, printable, shown
from sssfit.sweep.keys import UNITS
from sssfit.text import finite_number, read_text

MOST_VALUES = 100_000
_KEYS = ("name", "key", "units", "values", "from", "to", "count", "spacing", "table")
_ENDINGS = {"_per_mm": "1/mm", "_mm": "mm", "_nm": "nm", "_per_cm": "1/cm"}


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis of a sweep.

    Parameters
    ----------
    name : str
        Name of its dimension in the store, and in formulas.
    values : tuple of float (n,)
        Its coordinates.
    units : str
        Units of the coordinates: "1/mm", "mm", "nm", "1" or others. They are written to the store,
        and no value is converted; those of an axis with a key are the key's own.
    key : str
        The coefficient that it sets; empty where only formulas use it.
    columns : mapping
        The further columns of a table by name, each (n,).
    """

    name: str
    values: tuple[float, ...]
    units: str = "1"
    key: str = ""
    columns: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    def at(self, k: int) -> dict[str, float]:
        """Return the value of each name at position ``k``."""
        return {self.name: self.values[k]} | {name: each[k] for name, each in self.columns.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return the axis as JSON values."""
        columns = {name: list(each) for name, each in self.columns.items()}
        return {
            "name": self.name,
            "key": self.key,
            "units": self.units,
            "values": list(self.values),
            **({"columns": columns} if columns else {}),
        }


def read_axis(table: object, folder: Path, where: str) -> Axis:
    """Read one ``[[axes]]`` table of a plan; CSV files lie in ``folder``.

    Raises
    ------
    PlanError
        A key is unknown or missing, or a value is invalid; the message begins with ``where``.
    """
    if not isinstance(table, dict):
        raise PlanError(f"{where} = {shown(table)} is not a table; write it under [[axes]].")
    for key in table:
        if key not in _KEYS:
            raise PlanError(
                f"{where}.{key} is not a key of an axis; {did_you_mean(key, _KEYS)}expected "
                f"{', '.join(_KEYS)}."
            )
    given = [key for key in ("values", "from", "table") if key in table]
    if len(given) != 1:
        raise PlanError(
            f"{where} has {' and '.join(given) or 'no values'}; give one of values = [...], "
            "from, to and count, or table = a CSV file."
        )
    _check_alone(given[0], table, where)
    texts = {key: table[key] for key in ("name", "key", "units", "table") if key in table}
    for key, each in texts.items():
        if not isinstance(each, str) or not each:
            raise PlanError(f"{where}.{key} = {shown(each)}; expected a text in quotes.")
    if "table" in table:
        return _of_table(table, folder, where)
    coefficient = table.get("key", "")
    last = coefficient.split("].")[-1].split(".")[0]
    name = _checked_name(table.get("name") or last, f"{where}.name =")
    values = _listed(table, where) if "values" in table else _ranged(table, where)
    own = UNITS.get(last, "1") if coefficient else _units(name)
    units = table.get("units", own)
    if units != own and last in UNITS:
        raise PlanError(
            f"{where}.units = {shown(units)}; {last} is set in {own}: give the values in that, and "
            "leave units out."
        )
    return Axis(name, values, units, coefficient)


def _check_alone(given: str, table: Mapping[str, Any], where: str) -> None:
    """Raise an error for keys of a range beside a list or a table, which would do nothing."""
    others = [key for key in ("to", "count", "spacing") if key in table]
    if given != "from" and others:
        raise PlanError(
            f"{where} has {given} and {' and '.join(others)}; only a range, which begins with "
            f"from, has {others[0]}: leave it out."
        )


def _checked_name(name: str, where: str) -> str:
    """Return a name as formulas have it: Python takes the micro sign for the Greek letter."""
    if not name.isidentifier():
        raise PlanError(
            f"{where} {shown(name)}; an axis that sets no key has a name of letters, "
            "digits and _, a letter first."
        )
    if keyword.iskeyword(name):
        raise PlanError(
            f"{where} {shown(name)}; the word has another meaning in formulas, give another name, "
            f"such as {name}_nm."
        )
    return unicodedata.normalize("NFKC", name)


def _units(name: str) -> str:
    return next((unit for ending, unit in _ENDINGS.items() if name.endswith(ending)), "1")


def _number(key: str, value: object, where: str) -> float:
    if (found := as_float(value)) is None or math.isnan(found):
        raise PlanError(f"{where}.{key} = {shown(value)}; expected a number.")
    return found


def as_float(value: object) -> float | None:
    """Return a number of TOML as a float; None for anything else, and beyond what floats hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return None


def _listed(table: Mapping[str, Any], where: str) -> tuple[float, ...]:
    """Return the values of a list."""
    values = table["values"]
    if not isinstance(values, list) or not 1 <= len(values) <= MOST_VALUES:
        raise PlanError(f"{where}.values = {shown(values)}; expected a list of 1 number or more.")
    return tuple(_number(f"values[{k}]", each, where) for k, each in enumerate(values))


def _ranged(table: Mapping[str, Any], where: str) -> tuple[float, ...]:
    """Return the values of a range, both ends included."""
    missing = [key for key in ("from", "to", "count") if key not in table]
    if missing:
        raise PlanError(f"{where} has no {missing[0]}; a range has from, to and count.")
    low, high = (_number(key, table[key], where) for key in ("from", "to"))
    count, spacing = table["count"], table.get("spacing", "linear")
    if type(count) is not int or not 1 <= count <= MOST_VALUES:
        raise PlanError(
            f"{where}.count = {shown(count)}; expected a whole number from 1 to {MOST_VALUES}."
        )
    if spacing not in ("linear", "log"):
        raise PlanError(f"{where}.spacing = {shown(spacing)}; expected linear or log.")
    if math.isinf(low) or math.isinf(high) or (spacing == "log" and not (low > 0 and high > 0)):
        raise PlanError(
            f"{where} goes from {low:g} to {high:g}; expected finite ends, above 0 for log."
        )
    # Python's power and not numpy's, whose last bit differs between processors.
    parts = [k / (count - 1) for k in range(1, count - 1)]
    if spacing == "log":
        inner = [low * (high / low) ** part for part in parts]
    else:
        inner = [low + (high - low) * part for part in parts]
    return (low, *inner, high) if count > 1 else (low,)


def _cells(line: str, where: str) -> list[str]:
    """Cut a line by the rules of CSV."""
    try:
        return [cell.strip() for cell in next(csv.reader([line]))]
    except csv.Error as error:
        raise PlanError(f"{where} is not valid CSV: {printable(str(error))}.") from None


def _of_table(table: Mapping[str, Any], folder: Path, where: str) -> Axis:
    """Return the axis of a CSV file: its first column is the coordinate, the others are names."""
    if "key" in table:
        raise PlanError(f"{where} has table and key; a table's columns are used in [set].")
    path = folder / table["table"]
    text = read_text(path, str(path), expected="a CSV file with a head", error=PlanError).content
    rows = [
        (number, _cells(line, f"{path}: line {number}"))
        for number, line in enumerate(text.split("\n"), 1)
        if line.strip() and not line.startswith("#")
    ]
    if not 2 <= len(rows) <= MOST_VALUES + 1:
        raise PlanError(
            f"{path} has {max(len(rows) - 1, 0)} rows below its head; expected 1 to {MOST_VALUES}."
        )
    (_, head), *body = rows
    head = [_checked_name(name, f"{path}: column") for name in head]
    if len({*head}) < len(head):
        raise PlanError(f"{path} names a column twice: {', '.join(head)}.")
    columns: list[list[float]] = [[] for _ in head]
    for number, row in body:
        if len(row) != len(head):
            raise PlanError(
                f"{path}: line {number} has {counted(len(row), 'cell')}, and the head has "
                f"{len(head)}; give as many."
            )
        for column, cell in zip(columns, row, strict=True):
            if (value := finite_number(cell)) is None:
                raise PlanError(f"{path}: line {number}: {shown(cell)} is not a number.")
            column.append(value)
    name = _checked_name(table["name"], f"{where}.name =") if "name" in table else head[0]
    others = {key: tuple(each) for key, each in zip(head[1:], columns[1:], strict=True)}
    return Axis(name, tuple(columns[0]), table.get("units") or _units(name), "", others)
