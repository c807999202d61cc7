"""Diffusion models and the photon walk beside the exact solution."""

import numpy as np

from sssfit.report.charts.svg import Chart, Plot, limits
from sssfit.report.record import Report

_NAMES = {
    "exact": "exact solution",
    "montecarlo": "photon walk",
    "dipole": "dipole",
    "dipole-grosjean": "dipole, Grosjean's D",
    "burley": "normalised diffusion",
}
_SECOND = 1  # of three channels green is drawn, whose light goes neither far nor near


def models_chart(report: Report) -> Chart | None:
    """Draw 2 pi r R_d of one channel by each method."""
    if report.models is None:
        return None
    channel = min(_SECOND, report.profile.n_channels - 1)
    edges = report.models.edges_mm[channel]
    middles = (0.5 * (edges[1:] + edges[:-1])).tolist()
    width = np.diff(edges)
    curves = [each.energy[channel] / width for each in report.models.curves]
    plot = Plot(
        (0.0, float(edges[-1])),
        limits(curves[0].tolist(), is_log=True, decades=5.0),
        ("r (mm)", "2π r R_d (1/mm)"),
        log=(False, True),
        describe="The profile of one channel by every model",
    )
    legend = []
    for k, (model, curve) in enumerate(zip(report.models.curves, curves, strict=True)):
        plot.curve(middles, curve.tolist(), f"m{k}")
        legend.append((f"m{k}", _NAMES.get(model.method, model.method)))
    name = report.profile.channels[channel]
    note = f"Channel {name}, as far as the walk has 100 hits in each annulus."
    return Chart("models", "Models", note, tuple(legend), plot.svg())
