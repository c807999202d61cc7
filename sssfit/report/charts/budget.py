"""The error budget: what each cause alone does to a picture."""

from markupsafe import Markup

from sssfit.compare.budget import Budget
from sssfit.report.charts.svg import (
    WIDTH,
    Axis,
    Chart,
    limits,
    line_of,
    picture,
    text_of,
    written,
)
from sssfit.report.record import Report

_ROW, _TOP, _LEFT, _RIGHT = 38.0, 8.0, 188.0, WIDTH - 58.0
_FOOT = 48.0  # of the axis' numbers and name
_SIZE = 4.5  # half of a mark
_APART, _DIGIT = 10.0, 7.5  # a figure from its mark's middle, and width of a digit on a phone
_LEAST = 1e-4  # Delta E: smaller ones stand at the left end
_NOTICED = 1.0


def budget_chart(report: Report) -> Chart | None:
    """Draw the mean Delta E of each cause as a mark on a logarithmic axis, for every picture."""
    if not report.budgets:
        return None
    names = _names(report.budgets[0])
    values = [[_value(each, name) for name in names] for each in report.budgets]
    every = [max(each, _LEAST) for own in values for each in own]
    low, high = limits([*every, _NOTICED], is_log=True)
    x = Axis(max(low, _LEAST), high, _LEFT, _RIGHT, is_log=True)
    parts = _scale(x, _TOP + _ROW * len(names))
    for row, name in enumerate(names):
        parts += _marks(x, _TOP + _ROW * row, name, [each[row] for each in values])
    legend = tuple((f"b{k}", each.scene.name) for k, each in enumerate(report.budgets))
    words = (
        "Mean ΔE 2000 of each cause alone, for a separable kernel of rank 3; dashed: ΔE 1, just "
        "noticeable."
    )
    describe = "Mean Delta E of each cause of the error, on a logarithmic axis"
    svg = picture(parts, _TOP + _ROW * len(names) + _FOOT, describe)
    return Chart("budget", "Error budget", words, legend, (("", svg),))


def _scale(x: Axis, low: float) -> list[Markup]:
    """Return the axis under the rows, with a line through them at each of its numbers."""
    parts = []
    for value in x.ticks():
        at = x.place(value)
        parts.append(line_of([(at, _TOP), (at, low)], "grid"))
        parts.append(text_of(at, low + 16.0, written(value), "tick middle"))
    noticed = x.place(_NOTICED)
    parts.append(line_of([(noticed, _TOP), (noticed, low)], "noticed"))
    parts.append(line_of([(x.begin, _TOP), (x.begin, low), (x.end, low)], "axis"))
    name = "mean ΔE 2000, logarithmic"
    return [*parts, text_of(0.5 * (x.begin + x.end), low + 40.0, name, "name middle")]


def _names(budget: Budget) -> list[str]:
    inside = [each.name for each in budget.causes if each.is_in_whole]
    return [*inside, budget.interaction.name, budget.whole.name]


def _value(budget: Budget, name: str) -> float:
    every = (*budget.causes, budget.interaction, budget.whole)
    cause = next(each for each in every if each.name == name)
    return float(cause.score.delta_e_2000_mean)


def _marks(x: Axis, top: float, name: str, values: list[float]) -> list[Markup]:
    """Return the name of a cause, and a mark with its figure for each picture."""
    parts = [text_of(_LEFT - 8.0, top + 0.5 * _ROW + 4.0, name, "tick end")]
    high = (_ROW - 6.0) / len(values)
    for k, value in enumerate(values):
        at, y = x.place(max(value, x.low)), top + 3.0 + (k + 0.5) * high
        parts.append(_mark(at, y, k))
        place, kind = _beside(at, _figure(value), x.place(_NOTICED))
        parts.append(text_of(place, y + 4.0, _figure(value), kind))
    return parts


def _beside(at: float, words: str, noticed: float) -> tuple[float, str]:
    """Return where a mark's figure stands: right of it, but left where the dashed line would be."""
    begin = at + _APART
    is_crossed = begin - 2.0 < noticed < begin + _DIGIT * len(words)
    return (at - _APART, "small end") if is_crossed else (begin, "small")


def _mark(x: float, y: float, k: int) -> Markup:
    """Return a disk for the first picture and a square for others: not the colour alone tells."""
    if k == 0:
        return Markup('<circle class="bar b0" cx="{:.1f}" cy="{:.1f}" r="{}"/>').format(x, y, _SIZE)
    square = '<rect class="bar b{}" x="{:.1f}" y="{:.1f}" width="{}" height="{}"/>'
    return Markup(square).format(k, x - _SIZE, y - _SIZE, 2.0 * _SIZE, 2.0 * _SIZE)


def _figure(value: float) -> str:
    """Return a Delta E, which has no digits where its mark is not at its place."""
    return f"{value:#.2g}" if value >= _LEAST else f"< {_LEAST:g}" if value > 0.0 else "0"
