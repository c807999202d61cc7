"""Diffusion models and the photon walk beside the exact solution, a panel for each channel."""

import numpy as np
from markupsafe import Markup

from sssfit.compare.models import ModelComparison
from sssfit.methods import SIMULATIONS
from sssfit.report.charts.svg import Chart, Plot, limits
from sssfit.report.record import Report

_FIRST = 1  # of three channels green is shown first, whose light goes neither far nor near


def models_chart(report: Report) -> Chart | None:
    """Draw 2 pi r R_d of each channel by each method."""
    if report.models is None:
        return None
    names = report.profile.channels
    panels = [(name, _panel(report.models, k, name)) for k, name in enumerate(names)]
    every = enumerate(report.models.curves)
    legend = tuple((f"m{k}", SIMULATIONS[each.method].label) for k, each in every)
    note = "One channel at a time; curves end where the walk has fewer than 100 hits in an annulus."
    return Chart("models", "Models", note, legend, tuple(panels), min(_FIRST, len(names) - 1))


def _panel(models: ModelComparison, channel: int, name: str) -> Markup:
    """Return the curves of one channel."""
    edges = models.edges_mm[channel]
    middles = (0.5 * (edges[1:] + edges[:-1])).tolist()
    width = np.diff(edges)
    curves = [each.energy[channel] / width for each in models.curves]
    plot = Plot(
        (0.0, float(edges[-1])),
        limits(curves[0].tolist(), is_log=True, decades=5.0),
        ("r (mm)", "2π r R_d (1/mm)"),
        log=(False, True),
        describe=f"The profile of channel {name} by every model",
    )
    for k, curve in enumerate(curves):
        plot.curve(middles, curve.tolist(), f"m{k}")
    return plot.svg()
