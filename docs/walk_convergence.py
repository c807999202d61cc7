"""Draws what accuracy costs a simulation: error of F(r) against photons and seconds.

`sssfit.compare.convergence` makes the record, and ``make_convergence.py`` is the command.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sssfit.chart.page import COLOURS, Style, name_axes, new_page, tick_decades
from sssfit.chart.text import titled
from sssfit.compare.convergence import Convergence

_HEIGHT_INCHES = 4.2
_WALK: Style = {"color": COLOURS[0], "marker": "o", "markersize": 4, "linestyle": "none"}
_EXACT: Style = {"color": COLOURS[2], "marker": "s", "markersize": 5, "linestyle": "none"}
_HOLLOW: Style = _EXACT | {"markerfacecolor": "white"}


def convergence_figure(found: Convergence) -> Figure:
    """Draw the walk's error over photons, and both methods' over seconds.

    Parameters
    ----------
    found : Convergence

    Returns
    -------
    matplotlib.figure.Figure
        8 inches wide; errors of F(r) as a share of the total, logarithmic on both axes.
    """
    title = titled(found.exact, "what accuracy costs the simulation")
    with new_page(_HEIGHT_INCHES, title, _subtitle(found), [_NOTE]) as (figure, panels):
        left, right = panels.subplots(1, 2, sharey=True)
        _draw_photons(left, found)
        _draw_seconds(right, found)
        error = "error of F(r), share of the total"
        name_axes(left, "(a) photon walk", "photons", error)
        name_axes(right, "(b) both methods", "seconds, without compiling", "")
        for axes in (left, right):
            axes.set_xscale("log")
            axes.set_yscale("log")
            tick_decades(axes.xaxis, 9)
            tick_decades(axes.yaxis, 9)
            axes.legend(loc="lower left")
    return figure


_NOTE = (
    "Error: the largest |F - exact F| at an annulus edge, of the worst channel; F is the energy "
    "that leaves within r. Estimate: the exact method's difference to the next coarser resolution. "
    "Each walk has a seed of its own."
)


def _subtitle(found: Convergence) -> str:
    """Say what the truth is, and the slope."""
    line, estimate = found.line, found.resolutions[-1].estimate
    return (
        f"against the exact solution, itself good to {estimate:.1g} of the total · fitted slope "
        f"{line.slope:.3f} ± {line.slope_stderr:.3f}; theory -0.5 · sssfit "
        f"{found.exact.meta.get('version')}"
    )


def _draw_photons(axes: Axes, found: Convergence) -> None:
    """Draw walks, the line through them, and one of slope -1/2 through their middle."""
    photons = np.array([each.photons for each in found.walks], dtype=np.float64)
    errors = np.array([each.error for each in found.walks])
    ends = np.array([photons.min(), photons.max()])
    middle = np.exp(np.log(photons).mean()), np.exp(np.log(errors).mean())
    half = middle[1] * (ends / middle[0]) ** -0.5
    slope = f"fitted, slope {found.line.slope:.3f}"
    axes.plot(ends, half, color="black", ls=(0, (4, 3)), lw=1.0, zorder=3, label="slope -1/2")
    axes.plot(ends, found.line.at(ends), color=COLOURS[0], lw=2.2, alpha=0.6, label=slope)
    axes.plot(photons, errors, label="photon walks", **_WALK)


def _draw_seconds(axes: Axes, found: Convergence) -> None:
    """Draw both methods by what they took; hollow: the exact method's own estimate."""
    seconds = [each.seconds for each in found.walks]
    axes.plot(seconds, [each.error for each in found.walks], label="photon walks", **_WALK)
    known = [(each.seconds, each.error) for each in found.resolutions if each.error is not None]
    if known:
        axes.plot(*zip(*known, strict=True), label="exact, error", **_EXACT)
    own = [(each.seconds, each.estimate) for each in found.resolutions]
    axes.plot(*zip(*own, strict=True), label="exact, its estimate", **_HOLLOW)
