"""The tables of a page, by title: heads and rows of values, as the records have them."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from sssfit.arrays import plain_value
from sssfit.compare.comparison import Comparison, KernelRow
from sssfit.compare.convergence import Convergence
from sssfit.report.charts.svg import digits
from sssfit.report.record import COST, ERROR, Report


@dataclasses.dataclass(frozen=True, slots=True)
class Table:
    """A table that sorts.

    Parameters
    ----------
    key, title, note : str
    heads : tuple of str
    rows : tuple of tuple
        Numbers, texts, or None where nothing was measured.
    """

    key: str
    title: str
    note: str
    heads: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def cells(self) -> list[list[tuple[str, str, bool]]]:
        """Return what is shown of each cell, its exact value, and whether it is a number."""
        are_whole = [all(map(_is_whole, column)) for column in zip(*self.rows, strict=True)]
        return [[_cell(*each) for each in zip(row, are_whole, strict=True)] for row in self.rows]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_whole(value: Any) -> bool:
    """Return whether a value asks for no decimals: what is no number does not."""
    return not _is_number(value) or float(value).is_integer()


def _cell(value: Any, is_whole: bool) -> tuple[str, str, bool]:
    """Return a cell; numbers of a column have four digits, or are all whole ones."""
    if value is None:
        return "-", "", False
    if not _is_number(value):
        return str(value), str(value), False
    return f"{value:.0f}" if is_whole else digits(value), repr(value), True


def tables_of(report: Report) -> list[Table]:
    """Return the tables of a report."""
    found = [_kernels(report), _reflectance(report)]
    if report.models is not None:
        found.append(_models(report))
    if report.budgets:
        found.append(_budget(report))
    if report.convergence is not None:
        found.append(_convergence(report.convergence))
    return found


def _kernels(report: Report) -> Table:
    keys = ("delta_e_2000_mean", "delta_e_2000_p95", "delta_e_2000_p99", "relative_l2")
    costs = ("fetches", "passes", "bytes_per_pixel", "seconds_per_megapixel")
    rows = []
    for row in _ordered(report.comparison):
        figures = _plain([getattr(row, key) for key in (*keys, *costs)])
        rows.append((row.label, row.picture, "yes" if _is_on_front(row) else "no", *figures))
    heads: tuple[str, ...] = ("kernel", "picture", "on the front", "mean ΔE", "95 % ΔE", "99 % ΔE")
    heads += ("relative L2", "fetches", "passes", "bytes a pixel", "s a megapixel")
    words = (
        "Picture by picture: first the kernels of its Pareto front, cheapest first, then the "
        "others by mean ΔE. A click on a head sorts. Errors are against the picture by the "
        "profile's whole 2D kernel. Seconds are the library's, the least of some turns on the "
        "processor that made this page; the page measures its own passes."
    )
    return Table("kernels", "Kernels", words, heads, tuple(rows))


def _ordered(comparison: Comparison) -> list[KernelRow]:
    """Return rows by picture, those of its front first by cost, then the others by error."""
    found: list[KernelRow] = []
    for picture in comparison.pictures:
        front = comparison.front(picture.name, ERROR, COST)
        others = [row for row in comparison.rows_of(picture.name) if not _is_on_front(row)]
        found += [*front, *sorted(others, key=lambda row: row.delta_e_2000_mean)]
    return found


def _is_on_front(row: KernelRow) -> bool:
    return (ERROR, COST) in row.fronts


def _reflectance(report: Report) -> Table:
    profile = report.profile
    radii = profile.energy_radii_mm([0.5, 0.9, 0.99])
    columns = (
        profile.channels,
        profile.diffuse_reflectance,
        profile.diffuse_reflectance_stderr,
        *radii,
        profile.beyond_grid,
    )
    rows = tuple(zip(*map(_plain, columns), strict=True))
    heads: tuple[str, ...] = (
        "channel",
        "diffuse reflectance",
        "its error",
        "50 % within mm",
        "90 % within mm",
    )
    heads += ("99 % within mm", "beyond the grid")
    words = "How much light each channel returns, and the radii that it returns within."
    return Table("profile", "Profile", words, heads, rows)


def _models(report: Report) -> Table:
    assert report.models is not None
    rows = []
    for each in report.models.curves:
        errors = (each.total_error, each.cumulative_error, each.l2_error)
        for name, *values in zip(report.models.material.channels, *errors, strict=True):
            rows.append((each.method, name, *_plain(values)))
    heads = ("model", "channel", "error of the total", "largest error of F(r)", "L2 error of R_d")
    words = "Shares, against the exact solution; the photon walk differs by its noise."
    return Table("models", "Models", words, heads, tuple(rows))


def _budget(report: Report) -> Table:
    rows = []
    for budget in report.budgets:
        for row in budget.to_dict()["rows"]:
            keys = ("picture", "cause", "delta_e_2000_mean", "delta_e_2000_p99", "share_of_whole")
            rows.append(tuple(row[key] for key in keys))
    heads = ("picture", "cause", "mean ΔE alone", "99 % ΔE alone", "share of the squared error")
    words = (
        "Each cause switched on alone, for a separable kernel of rank 3. Shares of the causes and "
        "of the interaction add up to 1."
    )
    return Table("budget", "Error budget", words, heads, tuple(rows))


def _convergence(found: Convergence) -> Table:
    rows: list[tuple[Any, ...]] = [
        ("photon walk", each.photons, each.seed, *_plain([each.error, None, each.seconds]))
        for each in found.walks
    ]
    rows += [
        ("exact solution", None, None, *_plain([each.error, each.estimate, each.seconds]))
        for each in found.resolutions
    ]
    heads = ("method", "photons", "seed", "largest error of F(r)", "its own estimate", "seconds")
    words = (
        "Error of the energy within a radius as a share of the total, of the worst channel. The "
        "finest exact solution is what the others are compared with. Seconds were measured while "
        "other parts of this page were computed."
    )
    return Table("convergence", "Convergence", words, heads, tuple(rows))


def _plain(values: Sequence[Any]) -> list[Any]:
    """Return values without NaN, arrays as lists."""
    found: list[Any] = plain_value(values if hasattr(values, "tolist") else list(values))
    return found
