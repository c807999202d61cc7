"""R(k), a medium's response to sinusoids of light, as a figure: `frequency_figure`.

``sssfit.profile.frequency`` computes the record.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sssfit.arrays import FloatArray
from sssfit.chart.page import (
    COLOURS,
    LINE_STYLES,
    LINE_WIDTH,
    Style,
    add_legend,
    name_axes,
    new_page,
    tick,
    tick_decades,
)
from sssfit.chart.text import channel_label, in_legend, legend_title, subtitle, titled
from sssfit.profile.frequency import FrequencyResponse

HEIGHT_INCHES = 4.4
_TURN = 2.0 * np.pi
_FALLEN = 0.25  # of R(0), where the linear panel ends
_DECADES = 4.0  # most decades of the other's ordinate


def frequency_figure(found: FrequencyResponse) -> Figure:
    """Draw R(k) of each channel, logarithmic over k and linear over lines per mm.

    Parameters
    ----------
    found : FrequencyResponse
        If it has more than eight channels, the first eight are drawn.

    Returns
    -------
    matplotlib.figure.Figure
        8 x 4.4 inches; bands of one standard error where it is known.
    """
    profile = found.profile
    shown = in_legend(min(profile.n_channels, len(COLOURS)))
    title = titled(profile, "response to sinusoids of light")
    with new_page(HEIGHT_INCHES, title, subtitle(profile), [_note(found)]) as (figure, below):
        handles = [Line2D([], [], **_style(c)) for c in shown]
        labels = [channel_label(profile, c, is_drawn=True) for c in shown]
        rest = add_legend(below, handles, labels, title=legend_title(profile))
        left, right = rest.subplots(1, 2)
        for channel in shown:
            _draw(left, found.k_per_mm, found, channel)
            _draw(right, found.k_per_mm / _TURN, found, channel)
        _limit(left, right, found)
        name_axes(left, "(a) logarithmic, over k", "k (rad/mm)", "R(k)")
        name_axes(right, "(b) linear, over lines per mm", "k / 2π (1/mm)", "")
    return figure


def _note(found: FrequencyResponse) -> str:
    beyond = float((found.profile.beyond_grid / _nonzero(found.response[0])).max())
    is_known = np.isfinite(found.stderr[1:]).any()  # not under a beam
    return (
        "R(k) = 2π ∫ R_d(r) J_0(kr) r dr, the amplitude that returns of light cos(kx)"
        f"{'; bands show one standard error' if is_known else ''}. Light beyond the grid, at most "
        f"{100.0 * beyond:.2g} % of a channel, counts at k = 0 only."
    )


def _nonzero(values: FloatArray) -> FloatArray:
    return np.where(values > 0.0, values, np.inf)


def _style(channel: int) -> Style:
    return {
        "color": COLOURS[channel],
        "linestyle": LINE_STYLES[channel % len(LINE_STYLES)],
        "lw": LINE_WIDTH,
    }


def _draw(axes: Axes, x: FloatArray, found: FrequencyResponse, channel: int) -> None:
    """Draw a channel's curve, and a band where it has errors."""
    mean, error = found.response[:, channel], found.stderr[:, channel]
    axes.plot(x, mean, **_style(channel))
    if np.isfinite(error).all():
        band: Style = {"lw": 0, "alpha": 0.3, "color": COLOURS[channel]}
        axes.fill_between(x, mean - error, mean + error, **band)


def _limit(left: Axes, right: Axes, found: FrequencyResponse) -> None:
    """End the linear panel where every channel has fallen to a quarter."""
    response, k = found.response, found.k_per_mm
    top = float(response.max()) or 1.0
    left.set_xscale("log")
    left.set_yscale("log")
    left.set_xlim(k[1], k[-1])
    least = response[response > 0.0].min(initial=top)
    left.set_ylim(max(float(least), top * 10.0**-_DECADES) / 1.5, 1.5 * top)
    tick_decades(left.xaxis, 9)
    tick_decades(left.yaxis, 9)
    above = (response > _FALLEN * response[0]).any(axis=1)
    last = min(int(np.flatnonzero(above)[-1]) + 1 if above.any() else 1, len(k) - 1)
    right.set_xlim(0.0, k[last] / _TURN)
    right.set_ylim(0.0, 1.05 * top)
    tick(right.xaxis)
    tick(right.yaxis)
