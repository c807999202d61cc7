"""Error over fetches: every kernel a point that tells about itself and can be chosen."""

from markupsafe import Markup

from sssfit.compare.comparison import KernelRow
from sssfit.report.charts.svg import Chart, Plot, limits
from sssfit.report.record import COST, ERROR, Report

_NOTICED = 1.0  # Delta E, just noticeable
_LETTER, _LINE = 7.0, 14.0  # width and height of a label's letter on a phone, its largest
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
    places = [(plot.x.place(r.fetches), plot.y.place(r.delta_e_2000_mean)) for r in front]
    plot.line(_staircase(places, plot.x.end), "front")
    for row in sorted(rows, key=lambda each: each in front):
        plot.add(_point(plot, row, is_front=row in front))
    plot.text(plot.x.end - 4, noticed - 5, "ΔE 1, just noticeable", "small end")
    _name_front(plot, places, [row.label for row in front])
    legend = (("front-point", "on the Pareto front"), ("other-point", "another kernel is better"))
    words = (
        f"On {name}. Choose a point to run its kernel above; the arrow keys move along the front."
    )
    return Chart("pareto", "Error and cost", words, legend, (("", plot.svg(role="group")),))


def _name_front(plot: Plot, places: list[tuple[float, float]], labels: list[str]) -> None:
    """Write labels left of and below the front, where no point is; of two that meet, one."""
    taken: list[tuple[float, float, float, float]] = []
    for (x, y), label in zip(places, labels, strict=True):
        words = label.replace(" on ", "\non ").split("\n")
        end, top, low = x - 9.0, y, y + _LINE * len(words)
        begin = end - _LETTER * max(map(len, words))
        meets = any(begin < b and a < end and top < d and c < low for a, b, c, d in taken)
        if meets or begin < plot.x.begin or low > plot.y.begin:
            continue
        taken.append((begin, end, top, low))
        for k, line in enumerate(words):
            plot.text(end, top + _LINE * (k + 1), line, "small end")


def _fetches(rows: list[KernelRow]) -> tuple[float, float]:
    """Return the ends of the axis of fetches, with room for a label left of the cheapest."""
    low, high = limits([row.fetches for row in rows], is_log=True)
    return low * (low / high) ** _LABEL, high


def _errors(rows: list[KernelRow]) -> tuple[float, float]:
    """Return the ends of the axis of errors, with room for the label below the best kernel."""
    low, high = limits([*(row.delta_e_2000_mean for row in rows), _NOTICED], is_log=True)
    return low * (low / high) ** _ROOM, high


def _staircase(places: list[tuple[float, float]], end: float) -> list[tuple[float, float]]:
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
    x, y = plot.x.place(row.fetches), plot.y.place(row.delta_e_2000_mean)
    kind = "point front-point" if is_front else "point other-point"
    place = (f"{6 if is_front else 4.5}", "0" if is_front else "-1")
    return head.format(kind, x, y, *place, row.label, words, words)
