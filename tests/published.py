"""Figures of books and papers, each with its place, and the program's value for it.

A file ``tests/validation/test_<source>.py`` has a ``SOURCE`` and a list ``FIGURES``.
docs/make_validation.py tabulates all of them in docs/validation.md, and `check` holds that page to
the program.
"""

import functools
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from checks import LIMIT, Figure

PAGE = Path(__file__).parents[1] / "docs" / "validation.md"
NUMBER = re.compile(r"[-+]?\d*\.?\d+")


@dataclass(frozen=True)
class Row:
    """The program's value, its difference from the published one, and whether that is allowed."""

    ours: str
    difference: str
    holds: bool


@dataclass(frozen=True)
class Published:
    """One figure of a source.

    ``printed`` has its numbers as the source prints them. ``compute`` returns as many numbers, or a
    `Figure` of a photon walk, which is compared by its standard errors. ``within`` is the allowed
    difference, by default half a unit of each number's last printed digit.
    """

    place: str
    what: str
    printed: str
    compute: Callable[[], object]
    within: float | None = None

    @functools.cached_property
    def row(self) -> Row:
        found = self.compute()
        if isinstance(found, Figure):
            holds = abs(found.sigmas) < LIMIT
            return Row(found.ours, f"{found.sigmas:+.2f} standard errors", holds)
        texts = NUMBER.findall(self.printed)
        ours = np.atleast_1d(np.asarray(found, dtype=float))
        assert len(texts) == len(ours), self.what
        apart = np.abs(ours - np.array(texts, dtype=float))
        decimals = [len(each.partition(".")[2]) for each in texts]
        allowed = [self.within or 0.5 * 10.0**-each for each in decimals]
        shown = (f"{value:.{k + 2}f}" for value, k in zip(ours, decimals, strict=True))
        # 1e-15: of a tie between two decimals.
        holds = bool(np.all(apart <= np.array(allowed) * (1.0 + 1e-9) + 1e-15))
        difference = f"{apart.max():.1e}"
        if self.within is not None and self.within > 0.5 * 10.0 ** -min(decimals):
            difference += f", allowed {self.within:g}"
        return Row(" ".join(shown), difference, holds)


def cells(figure: Published) -> list[str]:
    """Return what names a figure in its table, as cells."""
    return [each.replace("|", "\\|") for each in (figure.place, figure.what, figure.printed)]


def row_text(figure: Published) -> str:
    """Return a figure's row of docs/validation.md."""
    return f"| {' | '.join([*cells(figure), figure.row.ours, figure.row.difference])} |"


def check(figure: Published) -> None:
    """Assert that a figure holds, and that docs/validation.md has the same value."""
    row = figure.row
    assert row.holds, f"{figure.what}: {row.ours}, published {figure.printed}, {row.difference}"
    start = f"| {' | '.join(cells(figure))} | "
    (line,) = [each for each in PAGE.read_text(encoding="utf-8").splitlines() if start in each]
    written = NUMBER.findall(line.removeprefix(start).partition(" | ")[0])
    found = NUMBER.findall(row.ours)
    assert len(written) == len(found), line
    for theirs, ours in zip(written, found, strict=True):
        unit = 10.0 ** -len(ours.partition(".")[2])
        apart = abs(float(theirs) - float(ours))
        assert apart < 1.01 * unit, f"{line}: run python docs/make_validation.py"


def what(figure: Published) -> str:
    """Name a figure in the list of tests."""
    return figure.what
