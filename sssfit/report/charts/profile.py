"""A profile over the radius, with bands of one standard error."""

import numpy as np

from sssfit.profile import Profile
from sssfit.profile.bins import Bins, merged
from sssfit.report.charts.svg import Chart, Plot, limits
from sssfit.report.record import Report

_KINDS = ("c0", "c1", "c2")


def kinds_of(profile: Profile) -> tuple[str, ...]:
    """Return the class of each channel's line: one channel alone is no red."""
    return _KINDS if profile.n_channels > 1 else ("grey",)


def profile_chart(report: Report) -> Chart:
    """Draw 2 pi r R_d of each channel over r, logarithmic."""
    profile = report.profile
    bins = [merged(profile, channel) for channel in range(profile.n_channels)]
    values = [each.per_mm()[0] for each in bins]
    everything = np.concatenate(values)
    plot = Plot(
        (0.0, float(profile.r_edges_mm[-1])),
        limits(everything.tolist(), is_log=True),
        ("r (mm)", "2π r R_d (1/mm)"),
        log=(False, True),
        describe="Diffuse reflectance profile over the radius, by channel",
    )
    kinds = kinds_of(profile)
    for kind, each in zip(kinds, bins, strict=True):
        _draw(plot, each, kind)
    legend = tuple(zip(kinds, profile.channels, strict=True))
    note = (
        "Energy that leaves the surface at a radius; bands show one standard error of a walk, or a "
        "solver's estimate, which may be thinner than the line."
    )
    return Chart("profile", "Profile", note, legend, (("", plot.svg()),))


def _draw(plot: Plot, bins: Bins, kind: str) -> None:
    middles = (0.5 * (bins.edges_mm[1:] + bins.edges_mm[:-1])).tolist()
    mean, error = bins.per_mm()
    if np.isfinite(error).any() and (error > 0.0).any():
        low = np.maximum(mean - error, plot.y.low)
        plot.band(middles, low.tolist(), (mean + error).tolist(), kind)
    plot.curve(middles, mean.tolist(), kind)
