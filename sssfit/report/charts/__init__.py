"""The charts of a page as inline SVG, from the records; a new one is one file and one line."""

from collections.abc import Callable

from sssfit.report.charts.budget import budget_chart
from sssfit.report.charts.convergence import convergence_chart
from sssfit.report.charts.models import models_chart
from sssfit.report.charts.pareto import pareto_chart
from sssfit.report.charts.profile import profile_chart
from sssfit.report.charts.spectrum import spectrum_chart
from sssfit.report.charts.svg import Chart
from sssfit.report.record import Report

CHARTS: tuple[Callable[[Report], Chart | None], ...] = (
    pareto_chart,
    profile_chart,
    models_chart,
    spectrum_chart,
    budget_chart,
    convergence_chart,
)


def charts_of(report: Report) -> list[Chart]:
    """Return the charts that a report has the records for."""
    drawn = (draw(report) for draw in CHARTS)
    return [each for each in drawn if each is not None]
