"""Constants of a dialect: single numbers, and arrays with a value for each channel in a row."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import KernelError
from sssfit.export.dialects import KINDS, Dialect
from sssfit.messages import shown

_LONGEST = 96  # characters of a line of numbers
_MOST_HALF = float(np.finfo(np.float16).max)
_MANY = 8  # rows of an array from which on two share a line


def check_prefix(prefix: str) -> None:
    """Refuse what names cannot begin with.

    Raises
    ------
    KernelError
    """
    if not (prefix.isascii() and prefix.isidentifier() and not prefix.startswith("_")):
        raise KernelError(
            f"prefix = {shown(prefix)}; expected letters, digits and _, such as SKIN."
        )
    if f"{prefix}_".lower().startswith("gl_") or "__" in f"{prefix}_":
        raise KernelError(
            f"prefix = {shown(prefix)}; names that begin with gl_ or have two _ in a row are "
            "reserved, so choose another, such as SKIN."
        )


class Writer:
    """Constants of one dialect and prefix, in single precision or rounded to half floats."""

    def __init__(self, dialect: Dialect, prefix: str, *, half: bool = False) -> None:
        self.dialect, self.prefix, self.half = dialect, prefix, half

    def scalar(self, kind: str, name: str, values: Sequence[float]) -> str:
        """Return a single constant."""
        value = f"{values[0]:d}u" if kind == "uint" else self.dialect.literal(values)
        return self.dialect.constant.format(
            kind=self.dialect.types[kind], name=f"{self.prefix}_{name}", dims="", value=value
        )

    def vector(self, name: str, values: Sequence[float]) -> str:
        """Return a single constant with a value for each channel."""
        count = len(values)
        if count > len(KINDS) and self.dialect.has_passes:
            return next(iter(self.rows(name, [values])))
        return self.dialect.constant.format(
            kind=self.dialect.types[KINDS[min(count, len(KINDS)) - 1]],
            name=f"{self.prefix}_{name}",
            dims=f"[{count}]" if count > 1 else "",
            value=self._literal(values),
        )

    def wholes(self, name: str, values: Sequence[int]) -> str:
        """Return an array of whole numbers, in one line."""
        before, after = self._ends("uint", name, len(values), "")
        return f"{before}{', '.join(f'{each}u' for each in values)}{after}"

    def rows(self, name: str, rows: Iterable[Sequence[float]]) -> Iterator[str]:
        """Yield the lines of an array with a value for each channel in a row.

        Where a dialect has no type for so many channels they follow one another.
        """
        table = [list(each) for each in rows]
        width = len(table[0])
        if width > len(KINDS) and self.dialect.has_passes:
            table, width = [[each] for row in table for each in row], 1
        kind = KINDS[min(width, len(KINDS)) - 1]
        before, after = self._ends(kind, name, len(table), f"[{width}]" if width > 1 else "")
        values = [self._literal(each) for each in table]
        lines = [", ".join(values)] if width == 1 else values
        if len(lines[0]) > _LONGEST:
            lines = [", ".join(values[k : k + 8]) for k in range(0, len(values), 8)]
        elif width > 1 and 2 * max(map(len, values)) < _LONGEST and len(values) > _MANY:
            lines = [", ".join(values[k : k + 2]) for k in range(0, len(values), 2)]
        if len(lines) == 1:
            yield f"{before}{lines[0]}{after}"
            return
        yield from (before, *(f"    {each}," for each in lines[:-1]), f"    {lines[-1]}", after)

    def _literal(self, values: Sequence[float]) -> str:
        return self.dialect.literal(_in_half(values) if self.half else values)

    def _ends(self, kind: str, name: str, count: int, dims: str) -> tuple[str, str]:
        """Return what stands before and after the rows of an array."""
        words = {"kind": self.dialect.types[kind], "name": f"{self.prefix}_{name}"}
        before, after = self.dialect.array
        return before.format(count=count, dims=dims, **words), after.format()


def _in_half(values: Sequence[float]) -> list[float]:
    """Return values as half floats hold them.

    Raises
    ------
    KernelError
        One is too large for them.
    """
    most = max(values, key=abs)
    if abs(most) > _MOST_HALF:
        raise KernelError(
            f"{most:.6g} does not fit in a half float, of which {_MOST_HALF:.0f} is the largest; "
            "export in single precision."
        )
    rounded: list[float] = in_half(np.array(values)).tolist()
    return rounded


def in_half(values: FloatArray) -> FloatArray:
    """Return an array of the nearest half floats, in double precision."""
    return values.astype(np.float16).astype(np.float64)
