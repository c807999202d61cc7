"""Tables of taps as source of a language: constants, and the passes that use them."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.errors import KernelError
from sssfit.export.certificate import certificate, how_to_run, pass_table
from sssfit.export.dialects import DIALECTS, KINDS, Dialect
from sssfit.export.functions import Functions
from sssfit.kernel import Taps
from sssfit.messages import printable, shown

_LONGEST = 80  # of a line of numbers
KIND_NUMBERS = ("pair", "star", "disk")


@dataclass(frozen=True, slots=True)
class Style:
    """How a table is written.

    Parameters
    ----------
    prefix : str
        Of all names.
    with_passes : bool
        Whether the functions of the passes follow the constants.
    normalized : bool
        Whether the blend adds up to 1 and the energy is a constant of its own.
    features : tuple of str
        Of `FEATURES`: which are on where nothing else is said.
    """

    prefix: str = "SSS"
    with_passes: bool = True
    normalized: bool = True
    features: tuple[str, ...] = ()


FEATURES = ("COVERAGE",)
MARKS = {name: f"// sssfit.{name}/1" for name in DIALECTS}  # of our files, which may be replaced


def source(tables: Sequence[Taps], dialect: Dialect, style: Style) -> str:
    """Return source of a dialect for one table, or for several with the same stages.

    Raises
    ------
    KernelError
        The prefix is no identifier, the tables have other stages or channels, or passes cannot be
        written for them.
    """
    _check(tables, dialect, style)
    passes = dialect.has_passes and style.with_passes
    words = [line for each in tables for line in certificate(each)]
    words += pass_table(tables[0], style.prefix) if passes else how_to_run(tables[0])
    words += list(_notes(tables, style, passes=passes))
    lines = [MARKS[dialect.name], *(f"// {printable(each)}".rstrip() for each in words)]
    lines += _defines(dialect, style) if passes else []
    lines += _constants(tables, dialect, style, passes=passes)
    if passes:
        functions = Functions(tables[0], dialect, style.prefix, is_indexed=len(tables) > 1)
        lines += ["", *functions.lines()]
    text = lines if dialect.has_defines else _resolved(lines, style)
    return "\n".join(text).rstrip("\n") + "\n"


def _notes(tables: Sequence[Taps], style: Style, *, passes: bool) -> Iterator[str]:
    """Yield what else has to be known of the constants."""
    p = style.prefix
    if style.normalized:
        yield f"The passes have unit energy: multiply by {p}_ALBEDO, or by a texture's own albedo."
    if any(each.has_negative_weights for each in tables):
        yield "Some weights are negative: unsigned formats between the passes would cut light off."
    if passes and tables[0].chained:
        yield "Intermediate pictures: half floats cost nothing that is seen; linear light throughout."


def _check(tables: Sequence[Taps], dialect: Dialect, style: Style) -> None:
    prefix = style.prefix
    if not (prefix.isascii() and prefix.isidentifier() and not prefix.startswith("__")):
        raise KernelError(
            f"prefix = {shown(prefix)}; expected letters, digits and _, such as SKIN."
        )
    first = tables[0]
    for each in tables[1:]:
        if (each.structure, each.channels, each.chained) != (
            first.structure,
            first.channels,
            first.chained,
        ):
            raise KernelError(
                f"tables of one file share their passes, and {each.structure} of "
                f"{', '.join(each.channels)} is not {first.structure} of "
                f"{', '.join(first.channels)}; fit them with the same stages."
            )


def _defines(dialect: Dialect, style: Style) -> Iterator[str]:
    """Yield the switches, which may be set before the file is included."""
    if not dialect.has_defines:
        return
    for each in FEATURES:
        name = f"{style.prefix}_{each}"
        yield from (f"#ifndef {name}", f"#define {name} {int(each in style.features)}", "#endif")


def _resolved(lines: Sequence[str], style: Style) -> Iterator[str]:
    """Yield the lines that a preprocessor would leave, for a dialect without one."""
    kept = [True]
    for line in lines:
        word = line.split()[0] if line.strip() else ""
        if word == "#if":
            kept.append(line.split()[1].removeprefix(f"{style.prefix}_") in style.features)
        elif word == "#else":
            kept[-1] = not kept[-1]
        elif word == "#endif":
            kept.pop()
        elif all(kept):
            yield line


def _constants(
    tables: Sequence[Taps], dialect: Dialect, style: Style, *, passes: bool
) -> Iterator[str]:
    """Yield the constants: stages, offsets, weights and blend, profile after profile."""
    first, write = tables[0], _Writer(dialect, style.prefix)
    counts = [len(each.weights) for each in first.stages]
    yield write.scalar("float", "MM_PER_PIXEL", [first.mm_per_pixel])
    if len(tables) > 1:
        yield write.scalar("uint", "TAPS", [sum(counts)])
        yield write.scalar("uint", "PICTURES", [len(first.blend)])
    if style.normalized:
        yield from write.rows("ALBEDO", [each.energy for each in tables])
    if passes:
        sizes = [2.0**each.level for each in first.stages]
        yield from write.rows("SIZE", [[each] for each in sizes])
    else:
        yield write.wholes("LEVEL", [each.level for each in first.stages])
        yield write.wholes("KIND", [KIND_NUMBERS.index(each.kind) for each in first.stages])
    yield write.wholes("FIRST", [0, *np.cumsum(counts).tolist()])
    places = [row for each in tables for row in _places(each)]
    yield from write.rows("PLACE_MM" if first.is_disk else "OFFSET_MM", places)
    yield from write.rows(
        "WEIGHT", [row for each in tables for s in each.stages for row in s.weights]
    )
    yield from write.rows("BLEND", [row for each in tables for row in _blend(each, style)])


def _places(taps: Taps) -> Iterator[list[float]]:
    """Yield where the taps lie [mm]: a distance, or of a disk right and down."""
    for stage in taps.stages:
        yield [0.0, 0.0] if taps.is_disk else [0.0]
        for k, each in enumerate(stage.offsets_mm.tolist()):
            turn = 2.0 * math.pi * (k * 2.0 / (1.0 + math.sqrt(5.0)) % 1.0)
            yield [each * math.cos(turn), each * math.sin(turn)] if taps.is_disk else [each]


def _blend(taps: Taps, style: Style) -> np.ndarray:
    """Return the blend, of unit energy where the energy is written apart."""
    energy = np.where(taps.energy != 0.0, taps.energy, 1.0)
    return taps.blend / energy if style.normalized else taps.blend


class _Writer:
    """Constants of one dialect and prefix."""

    def __init__(self, dialect: Dialect, prefix: str) -> None:
        self.dialect, self.prefix = dialect, prefix

    def scalar(self, kind: str, name: str, values: Sequence[float]) -> str:
        """Return a single constant."""
        value = f"{values[0]:d}u" if kind == "uint" else self.dialect.literal(values)
        return self.dialect.constant.format(
            kind=self.dialect.types[kind], name=f"{self.prefix}_{name}", dims="", value=value
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
        values = [self.dialect.literal(each) for each in table]
        lines = [", ".join(values)] if width == 1 else values
        if len(lines[0]) > _LONGEST:
            lines = [", ".join(values[k : k + 8]) for k in range(0, len(values), 8)]
        if len(lines) == 1:
            yield f"{before}{lines[0]}{after}"
            return
        yield from (before, *(f"    {each}," for each in lines[:-1]), f"    {lines[-1]}", after)

    def _ends(self, kind: str, name: str, count: int, dims: str) -> tuple[str, str]:
        """Return what stands before and after the rows of an array."""
        words = {"kind": self.dialect.types[kind], "name": f"{self.prefix}_{name}"}
        before, after = self.dialect.array
        return before.format(count=count, dims=dims, **words), after.format()
