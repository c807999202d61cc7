"""The error budget: what each cause alone does to a picture."""

from markupsafe import Markup

from sssfit.compare.budget import Budget
from sssfit.report.charts.svg import WIDTH, Axis, Chart, limits, picture
from sssfit.report.record import Report

_ROW, _TOP, _LEFT = 34.0, 12.0, 188.0
_LEAST = 1e-4  # Delta E that stands for 0 on a logarithmic axis


def budget_chart(report: Report) -> Chart | None:
    """Draw the mean Delta E of each cause as a bar, for every picture."""
    if not report.budgets:
        return None
    names = _names(report.budgets[0])
    values = [[_value(each, name) for name in names] for each in report.budgets]
    low, high = limits([v for each in values for v in each], is_log=True, decades=4.0)
    x = Axis(low, high, _LEFT, WIDTH - 50.0, is_log=True)
    parts: list[Markup] = []
    for row, name in enumerate(names):
        parts += _bars(x, _TOP + _ROW * row, name, [each[row] for each in values])
    legend = tuple((f"b{k}", each.scene.name) for k, each in enumerate(report.budgets))
    words = (
        "Mean ΔE 2000 of each cause alone, for a separable kernel of rank 3; bars are "
        "logarithmic, since causes differ by powers of ten."
    )
    describe = "Mean Delta E of each cause of the error"
    svg = picture(parts, _TOP + _ROW * len(names) + 8.0, describe)
    return Chart("budget", "Error budget", words, legend, (("", svg),))


def _names(budget: Budget) -> list[str]:
    inside = [each.name for each in budget.causes if each.is_in_whole]
    return [*inside, budget.interaction.name, budget.whole.name]


def _value(budget: Budget, name: str) -> float:
    every = (*budget.causes, budget.interaction, budget.whole)
    cause = next(each for each in every if each.name == name)
    return max(float(cause.score.delta_e_2000_mean), _LEAST)


def _bars(x: Axis, top: float, name: str, values: list[float]) -> list[Markup]:
    """Return the name of a cause and a bar for each picture."""
    text = Markup('<text class="{}" x="{:.1f}" y="{:.1f}">{}</text>')
    parts = [text.format("tick end", _LEFT - 8.0, top + 15.0, name)]
    high = (_ROW - 8.0) / len(values)
    for k, value in enumerate(values):
        y, end = top + k * high, x.place(value)
        bar = '<rect class="bar b{}" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>'
        parts.append(Markup(bar).format(k, _LEFT, y, max(end - _LEFT, 1.0), high - 1.0))
        parts.append(text.format("small", end + 5.0, y + high - 2.5, f"{value:.2g}"))
    return parts
