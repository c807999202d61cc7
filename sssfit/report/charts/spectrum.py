"""How much of the 2D kernel a number of separable terms leaves out."""

import numpy as np

from sssfit.report.charts.profile import kinds_of
from sssfit.report.charts.svg import Chart, Plot, limits
from sssfit.report.record import Report

_MOST = 12  # terms


def spectrum_chart(report: Report) -> Chart:
    """Draw the relative Frobenius error that is left after 1, 2, ... terms."""
    left = 1.0 - np.cumsum(report.spectrum.squared_share[:_MOST], axis=0)
    errors = np.sqrt(np.maximum(left, 0.0))
    terms = np.arange(1, len(errors) + 1, dtype=float)
    plot = Plot(
        (1.0, max(float(terms[-1]), 2.0)),
        limits(errors.ravel().tolist(), is_log=True, decades=6.0),
        ("separable terms", "relative Frobenius error"),
        log=(False, True),
        describe="Error of the best separable kernel over its number of terms, by channel",
    )
    kinds = kinds_of(report.profile)
    for kind, own in zip(kinds, errors.T, strict=True):
        plot.curve(terms.tolist(), np.where(own > 0.0, own, np.nan).tolist(), kind)
    legend = tuple(zip(kinds, report.profile.channels, strict=True))
    note = "The error of the best sum of so many separable terms: a singular value decomposition."
    return Chart("spectrum", "Singular values", note, legend, (("", plot.svg()),))
