"""Error over fetches: every kernel a point that tells about itself and can be chosen."""

from itertools import pairwise

from markupsafe import Markup

from sssfit.compare.comparison import KernelRow
from sssfit.report.charts.names import Box, Place, named
from sssfit.report.charts.svg import Chart, Plot, limits
from sssfit.report.record import COST, ERROR, Report

_NOTICED = 1.0  # Delta E, just noticeable
_POINT, _STROKE = 6.0, 2.0  # radius of the largest point, and what a line takes beside it
_ROOM = 0.12  # of a label below a point, in lengths of the axis
_LABEL = 0.45  # room of a label of 15 letters, in lengths of the axis


def pareto_chart(report: Report) -> Chart:
    """Draw mean Delta E over fetches on the first picture; points carry their kernel's label."""
    comparison = report.comparison
    name = comparison.pictures[0].name
    rows, front = comparison.rows_of(name), comparison.front(name, ERROR, COST)
    plot = Plot(
        _fetches(rows),
        _errors(rows),
        ("texture fetches a pixel", "mean ΔE 2000"),
        log=(True, True),
        describe=f"Error over fetches of {len(rows)} kernels on {name}; all are in the table",
    )
    noticed = plot.y.place(_NOTICED)
    plot.line([(plot.x.begin, noticed), (plot.x.end, noticed)], "noticed")
    plot.line(_staircase([_place(plot, row) for row in front], plot.x.end), "front")
    for row in sorted(rows, key=lambda each: each in front):
        plot.add(_point(plot, row, is_front=row in front))
    _name_front(plot, rows, [row.label for row in front], noticed)
    # Words at the dashed line would lie on points wherever they stood, with many kernels.
    legend = (
        ("front-point", "on the Pareto front"),
        ("other-point", "another kernel is better"),
        ("noticed", "ΔE 1, just noticeable"),
    )
    words = (
        f"On {name}. Choose a point to run its kernel above; the arrow keys move along the front."
    )
    return Chart("pareto", "Error and cost", words, legend, (("", plot.svg(role="group")),))


def _name_front(plot: Plot, rows: list[KernelRow], front: list[str], noticed: float) -> None:
    """Write the names of the front's kernels beside their points."""
    places = {row.label: _place(plot, row) for row in rows}
    stairs = _staircase([places[label] for label in front], plot.x.end)
    lines = [((plot.x.begin, noticed), (plot.x.end, noticed)), *pairwise(stairs)]
    taken = [_around(each, each, _POINT) for each in places.values()]
    taken += [_around(*each, _STROKE) for each in lines]
    room = (plot.x.begin, plot.y.end, plot.x.end, plot.y.begin)
    for name in named([(places[label], label) for label in front], taken, room).values():
        for base, words in name.placed_lines():
            plot.text(name.x, base, words, f"small {name.kind}")


def _place(plot: Plot, row: KernelRow) -> Place:
    return plot.x.place(row.fetches), plot.y.place(row.delta_e_2000_mean)


def _around(one: Place, other: Place, apart: float) -> Box:
    """Return the box around a line that goes along an axis, or around a point."""
    (left, right), (top, low) = (sorted(each) for each in zip(one, other, strict=True))
    return left - apart, top - apart, right + apart, low + apart


def _fetches(rows: list[KernelRow]) -> tuple[float, float]:
    """Return the ends of the axis of fetches, with room for a label left of the cheapest."""
    low, high = limits([row.fetches for row in rows], is_log=True)
    return low * (low / high) ** _LABEL, high


def _errors(rows: list[KernelRow]) -> tuple[float, float]:
    """Return the ends of the axis of errors, with room for the label below the best kernel."""
    low, high = limits([*(row.delta_e_2000_mean for row in rows), _NOTICED], is_log=True)
    return low * (low / high) ** _ROOM, high


def _staircase(places: list[Place], end: float) -> list[Place]:
    """Return the corners of a falling front."""
    found = []
    for k, (x, y) in enumerate(places):
        found.append((x, y))
        found.append((places[k + 1][0] if k + 1 < len(places) else end, y))
    return found


def _point(plot: Plot, row: KernelRow, *, is_front: bool) -> Markup:
    """Return a point that says its kernel's name, settings and figures."""
    settings = ", ".join(f"{key} {value}" for key, value in row.settings.items())
    words = (
        f"{row.label}: mean ΔE {row.delta_e_2000_mean:.3g}, 99 % {row.delta_e_2000_p99:.3g}, "
        f"{row.fetches:.3g} fetches in {row.passes} passes{f'; {settings}' if settings else ''}"
    )
    head = Markup(
        '<circle class="{}" cx="{:.1f}" cy="{:.1f}" r="{}" tabindex="{}" role="button" '
        'data-kernel="{}" aria-label="{}"><title>{}</title></circle>'
    )
    x, y = _place(plot, row)
    kind = "point front-point" if is_front else "point other-point"
    place = (f"{_POINT if is_front else 4.5:g}", "0" if is_front else "-1")
    return head.format(kind, x, y, *place, row.label, words, words)
